// SPDX-License-Identifier: MIT
#include "server/fleet/nats.h"

#include <chrono>
#include <exception>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nats/nats.h>
#include <spdlog/spdlog.h>

#include "server/fleet/random_id.h"
#include "server/fleet/subjects.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::fleet {
namespace {

// Milliseconds.
constexpr std::int64_t kReconnectWait = 250, kReconnectJitter = 100, kPingInterval = 2000,
                       kWriteDeadline = 2000, kConnectTimeout = 2000;
constexpr int kMaxPingsOut = 2;
constexpr std::chrono::milliseconds kLookAgain{1};
constexpr std::size_t kCostOfMessage = 256;  // bytes counted besides its data

natsConnection* connectionOf(void* handle) {
  return static_cast<natsConnection*>(handle);
}

void require(natsStatus status, const std::string& what) {
  if (status == NATS_OK) return;
  const char* const details = nats_GetLastError(nullptr);
  throw std::runtime_error(fmt::format("{}: {}{}{}", what, natsStatus_GetText(status), details ? ": " : "",
                                       details ? details : ""));
}

struct OptionsDeleter {
  void operator()(natsOptions* options) const { natsOptions_Destroy(options); }
};

std::string lastErrorOf(natsConnection* connection) {
  const char* text = nullptr;
  natsConnection_GetLastError(connection, &text);
  return text != nullptr && *text != '\0' ? fmt::format(": {}", text) : "";
}

}  // namespace

// Shared with the library, which may call it until it has noticed the end of the subscription.
struct Nats::Subscription::Receiver {
  Receiver(Handler wanted, telemetry::NatsMetrics& counted) : handler(std::move(wanted)), metrics(counted) {}

  std::mutex mutex;
  Handler handler;  // null after the end
  telemetry::NatsMetrics& metrics;

  static void receive(natsConnection*, natsSubscription*, natsMsg* message, void* closure) {
    const std::unique_ptr<natsMsg, decltype(&natsMsg_Destroy)> owner(message, &natsMsg_Destroy);
    Receiver& receiver = **static_cast<std::shared_ptr<Receiver>*>(closure);
    const std::lock_guard lock(receiver.mutex);
    if (!receiver.handler) return;
    const char* const wanted = natsMsg_GetReply(message);
    const char* const reply = wanted != nullptr && isInbox(wanted) ? wanted : "";
    const std::span data(reinterpret_cast<const std::byte*>(natsMsg_GetData(message)),
                         static_cast<std::size_t>(natsMsg_GetDataLength(message)));
    receiver.metrics.received.add();
    receiver.metrics.receivedBytes.add(data.size());
    try {
      receiver.handler(natsMsg_GetSubject(message), reply, data);
    } catch (const std::exception& failure) {  // the library is written in C
      spdlog::error("a message from NATS failed: {}", failure.what());
    }
  }

  static void complete(void* closure) { delete static_cast<std::shared_ptr<Receiver>*>(closure); }
};

Nats::Subscription::~Subscription() {
  {
    const std::lock_guard lock(receiver_->mutex);
    receiver_->handler = nullptr;
  }
  auto* const subscription = static_cast<natsSubscription*>(handle_);
  natsSubscription_Unsubscribe(subscription);
  natsSubscription_Destroy(subscription);
}

Nats::Nats(const NatsOptions& options, telemetry::NatsMetrics& metrics)
    : inboxes_(inboxSubject(options.role)), metrics_(metrics) {
  natsOptions* made = nullptr;
  require(natsOptions_Create(&made), "NATS");
  const std::unique_ptr<natsOptions, OptionsDeleter> own(made);
  std::vector<const char*> servers;
  for (const std::string& server : options.servers) servers.push_back(server.c_str());
  require(natsOptions_SetServers(made, servers.data(), static_cast<int>(servers.size())),
          fmt::format("--nats {}", fmt::join(options.servers, ",")));
  if (!options.credentials.empty())
    require(natsOptions_SetUserCredentialsFromFiles(made, options.credentials.c_str(), nullptr),
            fmt::format("--nats-credentials {}", options.credentials.string()));
  if (!options.authority.empty()) {
    require(natsOptions_LoadCATrustedCertificates(made, options.authority.c_str()),
            fmt::format("--nats-ca {}", options.authority.string()));
    require(natsOptions_SetSecure(made, true), "--nats-ca");
  }
  const auto disconnected = [](natsConnection* connection, void* closure) {
    static_cast<Nats*>(closure)->metrics_.connected = false;
    if (!natsConnection_IsClosed(connection))
      spdlog::warn("NATS: the connection is lost{}; trying again", lastErrorOf(connection));
  };
  const auto connected = [](natsConnection*, void* closure) {
    static_cast<Nats*>(closure)->metrics_.connected = true;
    spdlog::info("NATS: connected");
  };
  const auto closed = [](natsConnection* connection, void* closure) {
    Nats& nats = *static_cast<Nats*>(closure);
    nats.metrics_.connected = false;
    // The library gives up when the servers refuse the same credentials twice.
    const char* why = nullptr;
    if (const natsStatus status = natsConnection_GetLastError(connection, &why);
        status == NATS_CONNECTION_AUTH_FAILED || status == NATS_NOT_PERMITTED)
      spdlog::error("NATS: {}; correct --nats-credentials, and restart", why);
    nats.closed_ = true;
  };
  const auto failed = [](natsConnection*, natsSubscription*, natsStatus status, void* closure) {
    if (status == NATS_SLOW_CONSUMER) static_cast<Nats*>(closure)->metrics_.dropped.add();
    spdlog::warn("NATS: {}", natsStatus_GetText(status));
  };
  require(natsOptions_SetName(made, options.name.c_str()), "NATS");
  require(natsOptions_SetCustomInboxPrefix(made, inboxes_.c_str()), "NATS");
  require(natsOptions_SetTimeout(made, kConnectTimeout), "NATS");
  require(natsOptions_SetMaxReconnect(made, -1), "NATS");
  require(natsOptions_SetReconnectWait(made, kReconnectWait), "NATS");
  require(natsOptions_SetReconnectJitter(made, kReconnectJitter, kReconnectJitter), "NATS");
  require(natsOptions_SetPingInterval(made, kPingInterval), "NATS");
  require(natsOptions_SetMaxPingsOut(made, kMaxPingsOut), "NATS");
  require(natsOptions_SetWriteDeadline(made, kWriteDeadline), "NATS");
  require(natsOptions_SetNoEcho(made, true), "NATS");
  // Own messages are sent by a thread of ours, so that no other thread waits for a socket.
  require(natsOptions_SetSendAsap(made, true), "NATS");
  require(natsOptions_UseGlobalMessageDelivery(made, true), "NATS");
  require(natsOptions_SetErrorHandler(made, failed, this), "NATS");
  require(natsOptions_SetDisconnectedCB(made, disconnected, this), "NATS");
  require(natsOptions_SetReconnectedCB(made, connected, this), "NATS");
  require(natsOptions_SetClosedCB(made, closed, this), "NATS");
  require(natsOptions_SetRetryOnFailedConnect(made, true, connected, this), "NATS");

  natsConnection* connection = nullptr;
  const natsStatus status = natsConnection_Connect(&connection, made);
  if (status == NATS_NOT_YET_CONNECTED)
    spdlog::warn("NATS: {} cannot be reached yet; trying again", fmt::join(options.servers, ", "));
  else
    require(status, fmt::format("NATS at {}", fmt::join(options.servers, ", ")));
  if (status == NATS_OK) metrics_.connected = true;
  connection_ = connection;
  thread_ = std::thread([this] { run(); });
}

Nats::~Nats() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  natsConnection_Close(connectionOf(connection_));
  while (!closed_) std::this_thread::sleep_for(kLookAgain);
  natsConnection_Destroy(connectionOf(connection_));
}

bool Nats::connected() const {
  return natsConnection_Status(connectionOf(connection_)) == NATS_CONN_STATUS_CONNECTED;
}

void Nats::publish(std::string subject, delivery::SharedBytes data, std::string reply) {
  if (!connected()) return metrics_.dropped.add();
  {
    const std::lock_guard lock(mutex_);
    const std::size_t cost = data->size() + kCostOfMessage;
    if (waitingBytes_ + cost > kMaxWaiting) return metrics_.dropped.add();
    waitingBytes_ += cost;
    waiting_.push_back({std::move(subject), std::move(reply), std::move(data)});
  }
  changed_.notify_one();
}

void Nats::run() {
  telemetry::nameThread("nats sender");
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return stopping_ || !waiting_.empty(); });
    if (waiting_.empty()) return;  // what was queued before the end is sent
    const Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    send(next);
    lock.lock();
    waitingBytes_ -= next.data->size() + kCostOfMessage;
  }
}

void Nats::send(const Waiting& message) {
  // A message that waited while the connection was lost would be late.
  if (!connected()) return metrics_.dropped.add();
  natsConnection* const connection = connectionOf(connection_);
  const int bytes = static_cast<int>(message.data->size());
  const natsStatus status =
      message.reply.empty()
          ? natsConnection_Publish(connection, message.subject.c_str(), message.data->data(), bytes)
          : natsConnection_PublishRequest(connection, message.subject.c_str(), message.reply.c_str(),
                                          message.data->data(), bytes);
  if (status == NATS_OK) {
    metrics_.published.add();
    metrics_.publishedBytes.add(message.data->size());
    return;
  }
  metrics_.dropped.add();
  if (status == NATS_MAX_PAYLOAD)
    spdlog::error("NATS: a message of {} bytes to {} exceeds max_payload of the server ({}); raise it there",
                  message.data->size(), message.subject, natsConnection_GetMaxPayload(connection));
}

std::unique_ptr<Nats::Subscription> Nats::subscribe(const std::string& subject, Handler handler) {
  std::unique_ptr<Subscription> made(new Subscription);
  made->receiver_ = std::make_shared<Subscription::Receiver>(std::move(handler), metrics_);
  auto closure = std::make_unique<std::shared_ptr<Subscription::Receiver>>(made->receiver_);
  natsSubscription* subscription = nullptr;
  require(natsConnection_Subscribe(&subscription, connectionOf(connection_), subject.c_str(),
                                   &Subscription::Receiver::receive, closure.get()),
          fmt::format("NATS: {}", subject));
  made->handle_ = subscription;
  require(natsSubscription_SetPendingLimits(subscription, kMaxPending, kMaxPendingBytes), "NATS");
  require(natsSubscription_SetOnCompleteCB(subscription, &Subscription::Receiver::complete, closure.get()),
          "NATS");
  closure.release();
  return made;
}

std::string Nats::inbox() const {
  return fmt::format("{}.{:016x}", inboxes_, randomId());
}

}  // namespace clothstream::fleet
