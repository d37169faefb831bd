// SPDX-License-Identifier: MIT
#include "server/endpoint/datagram/association_table.h"

#include <algorithm>
#include <exception>
#include <string_view>
#include <vector>

#include <spdlog/spdlog.h>

#include "server/endpoint/listen/address_rate.h"

namespace clothstream::endpoint {

std::size_t AssociationTable::Hash::operator()(const Address& address) const {
  const std::string_view bytes(reinterpret_cast<const char*>(address.bytes.data()), address.bytes.size());
  return std::hash<std::string_view>()(bytes) ^ (std::size_t{address.port} << 16);
}

AssociationTable::AssociationTable(const AssociationContext& context, Transmit transmit)
    : context_(context), transmit_(std::move(transmit)) {}

void AssociationTable::add(ice::Credentials local, hosting::DatagramPeer peer, std::function<void()> wake,
                           Time now) {
  decltype(entries_) added;  // the entry keeps its address when it moves to the others
  Entry& entry = added[local.ufrag];
  entry.association = std::make_unique<Association>(
      context_, std::move(local), std::move(peer), std::move(wake),
      [this, &entry](const Address& to, std::span<const std::byte> datagram) {
        transmit(entry, to, datagram);
      },
      [this](const Address& from) { return admit(from); }, now);
  entries_.merge(added);
  attempt(entry, [&] { advance(entry, now); });
}

void AssociationTable::remove(const std::string& ufrag) {
  const auto found = entries_.find(ufrag);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  entry.association.reset();  // may say goodbye, by the route that is known
  setDue(entry, Time::max());
  forget(entry, &Entry::proven);
  forget(entry, &Entry::checked);
  entries_.erase(found);
}

void AssociationTable::clear() {
  while (!entries_.empty()) remove(std::string(entries_.begin()->first));
}

void AssociationTable::handle(const Route& route, std::span<const std::byte> datagram, Time now) {
  if (datagram.empty()) return;
  const auto give = [&](Entry& entry) { attempt(entry, [&] { handle(entry, route, datagram, now); }); };
  const auto proven = proven_.find(route.peer);
  if (Entry* const named = findByName(datagram)) {
    give(*named);
  } else if (proven != proven_.end() && !ice::isStun(datagram)) {
    give(*proven->second);
  } else {
    // An answer to a check has no name, and several associations may await one from there. So do records that
    // come before the answer.
    std::vector<Entry*> receivers;
    if (proven != proven_.end()) receivers.push_back(proven->second);
    for (auto [each, end] = checked_.equal_range(route.peer); each != end; ++each)
      receivers.push_back(each->second);
    for (Entry* const entry : receivers) give(*entry);
  }
}

template <typename Step>
void AssociationTable::attempt(Entry& entry, Step step) {
  try {
    step();
  } catch (const std::exception& failure) {
    spdlog::error("an association of datagrams ends: {}", failure.what());
    current_.reset();
    remove(std::string(entry.association->ufrag()));
  }
}

// Association of a check, by its user name "SERVER:CLIENT" (RFC 8445, section 7.2.2).
AssociationTable::Entry* AssociationTable::findByName(std::span<const std::byte> datagram) {
  if (!ice::isStun(datagram)) return nullptr;
  const auto message = ice::readStun(datagram);
  if (!message) return nullptr;
  const auto found = entries_.find(std::string(message->username.substr(0, message->username.find(':'))));
  return found == entries_.end() ? nullptr : &found->second;
}

void AssociationTable::handle(Entry& entry, const Route& route, std::span<const std::byte> datagram,
                              Time now) {
  Association& association = *entry.association;
  current_ = route;
  const Association::Handled handled = association.handle(route.peer, datagram, now);
  current_.reset();
  if (handled == Association::Handled::dropped) return;
  // Other datagrams can have a forged source, so they say nothing about the way to the peer.
  const bool isCheck = handled == Association::Handled::check;
  if (association.selected(now) == route.peer) {
    if (!entry.proven || entry.proven->peer != route.peer) {
      forget(entry, &Entry::proven);
      forget(entry, &Entry::checked);
      // The newest proof counts: the former owner cannot receive there any more.
      if (const auto former = proven_.find(route.peer); former != proven_.end())
        forget(*former->second, &Entry::proven);
      proven_[route.peer] = &entry;
      entry.proven = route;
    } else if (isCheck) {
      entry.proven = route;
    }
  } else if (isCheck && !(entry.checked && entry.checked->peer == route.peer)) {
    forget(entry, &Entry::checked);
    checked_.emplace(route.peer, &entry);
    entry.checked = route;
  }
  advance(entry, now);
}

void AssociationTable::forget(Entry& entry, std::optional<Route> Entry::*route) {
  const std::optional<Route> former = std::exchange(entry.*route, std::nullopt);
  if (!former) return;
  if (route == &Entry::proven) {
    proven_.erase(former->peer);
    return;
  }
  const auto [begin, end] = checked_.equal_range(former->peer);
  const auto found = std::find_if(begin, end, [&](const auto& each) { return each.second == &entry; });
  if (found != end) checked_.erase(found);
}

void AssociationTable::wake(const std::string& ufrag, Time now) {
  if (const auto found = entries_.find(ufrag); found != entries_.end())
    attempt(found->second, [&] { advance(found->second, now); });
}

void AssociationTable::advance(Time now) {
  while (!due_.empty() && due_.begin()->first <= now) {
    Entry& entry = *due_.begin()->second;
    if (entry.association->isOver(now))
      remove(std::string(entry.association->ufrag()));
    else
      attempt(entry, [&] { advance(entry, now); });
  }
}

void AssociationTable::advance(Entry& entry, Time now) {
  entry.association->advance(now);
  setDue(entry, std::max(entry.association->nextTime(), now + Time::duration(1)));
}

void AssociationTable::setDue(Entry& entry, Time due) {
  if (entry.due == due) return;
  if (entry.due != Time::max()) due_.erase({entry.due, &entry});
  entry.due = due;
  if (due != Time::max()) due_.emplace(due, &entry);
}

void AssociationTable::transmit(const Entry& entry, const Address& to,
                                std::span<const std::byte> datagram) const {
  for (const std::optional<Route>* route : {&current_, &entry.proven, &entry.checked})
    if (*route && (*route)->peer == to) return transmit_(**route, datagram);
  transmit_({.peer = to}, datagram);
}

std::shared_ptr<const void> AssociationTable::admit(const Address& from) {
  const std::string key = addressKey(boost::asio::ip::address_v6(from.bytes));
  Handshakes& handshakes = *handshakes_;
  if (handshakes.all == kMaxHandshakes) return nullptr;
  if (!key.empty() && handshakes.ofAddress[key] == kMaxHandshakesOfAddress) return nullptr;
  ++handshakes.all;
  if (!key.empty()) ++handshakes.ofAddress[key];
  return {&handshakes, [shared = handshakes_, key](const void*) {
            --shared->all;
            if (!key.empty() && --shared->ofAddress[key] == 0) shared->ofAddress.erase(key);
          }};
}

}  // namespace clothstream::endpoint
