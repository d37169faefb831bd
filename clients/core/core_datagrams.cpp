// SPDX-License-Identifier: MIT
// C interface: datagrams.
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"
#include "clients/core/datagrams/datagram_link.h"

using namespace clothstream::client;

struct cs_datagrams {
  DatagramLink link;
};

namespace {

Bytes messageOf(const std::uint8_t* message, std::size_t bytes) {
  return {reinterpret_cast<const char*>(message), bytes};
}

// Data and size of a view; NULL if it is empty.
template <typename View>
const std::uint8_t* given(const View& view, std::size_t* bytes) {
  *bytes = view.size();
  return view.empty() ? nullptr : reinterpret_cast<const std::uint8_t*>(view.data());
}

}  // namespace

int cs_offer_datagrams(cs_client* client, const cs_datagram_offer* offer) noexcept {
  return client->client.offerDatagrams(*offer) ? 1 : 0;
}

int cs_get_datagram_answer(const cs_client* client, cs_datagram_answer* out) noexcept {
  const std::optional<DatagramAnswer>& answer = client->client.datagramAnswer();
  if (!answer || out->version != CS_DATAGRAM_ANSWER_VERSION) return 0;
  *out = {};
  out->addresses = static_cast<std::uint32_t>(answer->addresses.size());
  out->port = answer->port;
  out->ufrag = answer->ufrag.c_str();
  out->password = answer->password.c_str();
  copy(answer->fingerprint, out->fingerprint);
  return 1;
}

const char* cs_datagram_address(const cs_client* client, uint32_t index) noexcept {
  const std::optional<DatagramAnswer>& answer = client->client.datagramAnswer();
  const std::string* address = answer ? at(answer->addresses, index) : nullptr;
  return address ? address->c_str() : "";
}

cs_datagrams* cs_create_datagrams(void) noexcept {
  return new cs_datagrams;  // NOLINT(bugprone-unhandled-exception-at-new): out of memory ends the program.
}

void cs_destroy_datagrams(cs_datagrams* datagrams) noexcept {
  delete datagrams;
}

void cs_receive_datagram(cs_datagrams* datagrams, const uint8_t* datagram, size_t bytes,
                         uint64_t now_us) noexcept {
  datagrams->link.receive(std::as_bytes(std::span(datagram, bytes)), now_us);
}

int cs_hold_message(cs_datagrams* datagrams, const uint8_t* message, size_t bytes, uint64_t now_us) noexcept {
  return datagrams->link.holds(messageOf(message, bytes), now_us) ? 1 : 0;
}

int cs_send_in_datagram(cs_datagrams* datagrams, const uint8_t* message, size_t bytes,
                        uint64_t now_us) noexcept {
  return datagrams->link.sends(messageOf(message, bytes), now_us) ? 1 : 0;
}

const uint8_t* cs_next_datagram_message(cs_datagrams* datagrams, uint64_t now_us, size_t* bytes) noexcept {
  return given(datagrams->link.nextMessage(now_us), bytes);
}

const uint8_t* cs_next_datagram(cs_datagrams* datagrams, uint64_t now_us, size_t* bytes) noexcept {
  return given(datagrams->link.nextDatagram(now_us), bytes);
}

const uint8_t* cs_next_stream_message(cs_datagrams* datagrams, uint64_t now_us, size_t* bytes) noexcept {
  return given(datagrams->link.nextStreamMessage(now_us), bytes);
}

uint64_t cs_datagrams_due_at(const cs_datagrams* datagrams) noexcept {
  return datagrams->link.dueUs().value_or(std::numeric_limits<std::uint64_t>::max());
}

void cs_set_datagram_round_trip(cs_datagrams* datagrams, uint64_t microseconds) noexcept {
  datagrams->link.setRoundTrip(microseconds);
}

int cs_get_datagram_statistics(const cs_datagrams* datagrams, uint64_t now_us,
                               cs_datagram_statistics* out) noexcept {
  if (out->version != CS_DATAGRAM_STATISTICS_VERSION) return 0;
  *out = datagrams->link.statistics(now_us);
  return 1;
}
