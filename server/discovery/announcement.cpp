// SPDX-License-Identifier: MIT
#include "server/discovery/announcement.h"

#include <exception>
#include <stdexcept>
#include <utility>

#include <avahi-client/client.h>
#include <avahi-client/publish.h>
#include <avahi-common/alternative.h>
#include <avahi-common/domain.h>
#include <avahi-common/error.h>
#include <avahi-common/malloc.h>
#include <avahi-common/strlst.h>
#include <avahi-common/thread-watch.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "proto/discovery/service.h"

namespace clothstream::discovery {
namespace {

struct FreeList {
  void operator()(AvahiStringList* list) const { avahi_string_list_free(list); }
};
using TextRecord = std::unique_ptr<AvahiStringList, FreeList>;

TextRecord textRecord(const AnnouncedServer& server) {
  AvahiStringList* list = nullptr;
  const auto add = [&](const char* key, const std::string& value) {
    list = avahi_string_list_add_pair(list, key, value.c_str());
  };
  add(kVersionKey, server.version);
  if (!server.fingerprint.empty()) add(kFingerprintKey, server.fingerprint);
  if (server.encrypted) add(kTlsKey, "1");
  add(kGrpcPortKey, std::to_string(server.grpcPort));
  return TextRecord(list);
}

}  // namespace

// All calls but construction and destruction happen on Avahi's thread.
class Announcement::Avahi {
 public:
  // Throws std::runtime_error without D-Bus or memory.
  explicit Avahi(AnnouncedServer server) : server_(std::move(server)), poll_(avahi_threaded_poll_new()) {
    if (poll_ == nullptr) throw std::runtime_error("out of memory");
    if (!connect()) {
      avahi_threaded_poll_free(poll_);
      throw std::runtime_error(problem_);
    }
    avahi_threaded_poll_start(poll_);
  }
  ~Avahi() {
    avahi_threaded_poll_stop(poll_);
    // Frees the entry group as well, which withdraws the announcement.
    if (client_ != nullptr) avahi_client_free(client_);
    avahi_threaded_poll_free(poll_);
  }
  Avahi(const Avahi&) = delete;
  Avahi& operator=(const Avahi&) = delete;

 private:
  // No exception may reach Avahi, which is written in C.
  static void attempt(const auto& step) {
    try {
      step();
    } catch (const std::exception& failure) {
      spdlog::warn("the server is not announced by mDNS: {}", failure.what());
    }
  }

  bool connect() {
    int error = 0;
    group_ = nullptr;
    client_ = avahi_client_new(
        avahi_threaded_poll_get(poll_), AVAHI_CLIENT_NO_FAIL,
        [](AvahiClient* client, AvahiClientState state, void* self) {
          Avahi& avahi = *static_cast<Avahi*>(self);
          attempt([&] { avahi.onClient(client, state); });
        },
        this, &error);
    if (client_ == nullptr) problem_ = avahi_strerror(error);
    return client_ != nullptr;
  }

  // Also called before avahi_client_new() returns.
  void onClient(AvahiClient* client, AvahiClientState state) {
    client_ = client;
    switch (state) {
      case AVAHI_CLIENT_S_RUNNING:
        return publish();
      case AVAHI_CLIENT_S_COLLISION:
      case AVAHI_CLIENT_S_REGISTERING:
        // The host's name changes; publish() follows.
        if (group_ != nullptr) avahi_entry_group_reset(group_);
        return;
      case AVAHI_CLIENT_CONNECTING:
        spdlog::info("the server is not announced by mDNS until avahi-daemon runs");
        return;
      case AVAHI_CLIENT_FAILURE:
        if (avahi_client_errno(client) != AVAHI_ERR_DISCONNECTED) return giveUp(avahi_client_errno(client));
        // The daemon ended. A new client waits for the next one.
        avahi_client_free(client);
        if (!connect()) spdlog::warn("the server is not announced by mDNS any more: {}", problem_);
        return;
    }
  }

  void onGroup(AvahiEntryGroupState state) {
    if (state == AVAHI_ENTRY_GROUP_ESTABLISHED) spdlog::info("announced by mDNS as '{}'", name_);
    if (state == AVAHI_ENTRY_GROUP_COLLISION) {
      takeNextName();
      publish();
    }
    if (state == AVAHI_ENTRY_GROUP_FAILURE) giveUp(avahi_client_errno(client_));
  }

  void publish() {
    if (group_ == nullptr)
      group_ = avahi_entry_group_new(
          client_,
          [](AvahiEntryGroup* group, AvahiEntryGroupState state, void* self) {
            Avahi& avahi = *static_cast<Avahi*>(self);
            avahi.group_ = group;
            attempt([&] { avahi.onGroup(state); });
          },
          this);
    if (group_ == nullptr) return giveUp(avahi_client_errno(client_));
    avahi_entry_group_reset(group_);
    if (name_.empty()) {
      const char* const host = avahi_client_get_host_name(client_);
      if (host == nullptr) return giveUp(avahi_client_errno(client_));  // the daemon does not answer
      name_ = fmt::format("ClothStream on {}", host).substr(0, AVAHI_LABEL_MAX - 1);
    }
    const TextRecord text = textRecord(server_);
    const auto add = [&] {
      return avahi_entry_group_add_service_strlst(group_, AVAHI_IF_UNSPEC, AVAHI_PROTO_UNSPEC,
                                                  AvahiPublishFlags{}, name_.c_str(), kServiceType, nullptr,
                                                  nullptr, server_.pagePort, text.get());
    };
    int result = add();
    // Another server on this machine has the name. Others in the network are reported to onGroup().
    while (result == AVAHI_ERR_COLLISION) {
      takeNextName();
      result = add();
    }
    if (result >= 0) result = avahi_entry_group_commit(group_);
    if (result < 0) giveUp(result);
  }

  void takeNextName() {
    char* const next = avahi_alternative_service_name(name_.c_str());
    if (next == nullptr) throw std::runtime_error("out of memory");
    name_ = next;
    avahi_free(next);
  }

  static void giveUp(int error) {
    spdlog::warn("the server is not announced by mDNS: {}", avahi_strerror(error));
  }

  const AnnouncedServer server_;
  std::string name_, problem_;
  AvahiThreadedPoll* const poll_;
  AvahiClient* client_ = nullptr;
  AvahiEntryGroup* group_ = nullptr;  // belongs to client_
};

Announcement::Announcement(AnnouncedServer server) {
  try {
    avahi_ = std::make_unique<Avahi>(std::move(server));
  } catch (const std::exception& failure) {
    spdlog::warn("the server is not announced by mDNS: {}", failure.what());
  }
}

Announcement::~Announcement() = default;

}  // namespace clothstream::discovery
