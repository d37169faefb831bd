// SPDX-License-Identifier: MIT
// Connection to NATS, which carries frames and events between servers.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/delivery/envelope.h"
#include "server/telemetry/metrics.h"

namespace clothstream::fleet {

class Bucket;

struct NatsOptions {
  std::vector<std::string> servers;   // such as nats://127.0.0.1:4222, or tls://...
  std::filesystem::path credentials;  // file with JWT and seed of a NATS user; empty: none
  std::filesystem::path
      authority;     // PEM file of the authorities of the servers' certificates; empty: the system's
  std::string name;  // of this program, for the servers' lists of connections
  std::string role;  // `server` or `edge`; answers have a subject of this role (inboxSubject)
};

// Thread-safe. Connects again as often as it takes; servers that cannot be reached are not an error.
class Nats {
 public:
  // `reply` is empty, or the subject for an answer, which is an inbox: others may belong to what the sender
  // must not publish.
  using Handler = std::function<void(const std::string& subject, const std::string& reply,
                                     std::span<const std::byte> data)>;

  // Ends with its destructor, which waits for a running handler. Must not be destroyed by its own handler,
  // nor after the connection.
  class Subscription {
   public:
    ~Subscription();
    Subscription(const Subscription&) = delete;
    Subscription& operator=(const Subscription&) = delete;

   private:
    friend class Nats;
    struct Receiver;
    Subscription() = default;
    void* handle_ = nullptr;
    std::shared_ptr<Receiver> receiver_;
  };

  // Bytes of the messages that wait until they are sent. A further one is dropped.
  static constexpr std::size_t kMaxWaiting = 16 << 20;
  // Messages and bytes that wait for the handler of one subscription. A further one is dropped.
  static constexpr int kMaxPending = 1024;
  static constexpr int kMaxPendingBytes = 64 << 20;

  // Counts into `metrics`, which must outlive the connection. Throws std::runtime_error for options that
  // cannot be used, such as a file that cannot be read.
  Nats(const NatsOptions& options, telemetry::NatsMetrics& metrics);
  ~Nats();
  Nats(const Nats&) = delete;
  Nats& operator=(const Nats&) = delete;

  bool connected() const;
  // Queues a message and returns at once. Without connection, or beyond kMaxWaiting, the message is dropped.
  void publish(std::string subject, delivery::SharedBytes data, std::string reply = {});
  // All handlers of the process run on one thread. While there is no connection, nothing arrives; the
  // subscription continues with the next connection. `subject` may have the wildcards of NATS.
  std::unique_ptr<Subscription> subscribe(const std::string& subject, Handler handler);
  // Subject for answers to one request.
  std::string inbox() const;

 private:
  friend class Bucket;
  struct Waiting {
    std::string subject, reply;
    delivery::SharedBytes data;
  };

  void run();
  void send(const Waiting& message);

  const std::string inboxes_;  // start of the subjects for answers, without a dot at its end
  telemetry::NatsMetrics& metrics_;
  std::atomic<bool> closed_{false};  // the library's last call was made
  void* connection_ = nullptr;

  std::mutex mutex_;  // protects the next four
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  std::size_t waitingBytes_ = 0;
  bool stopping_ = false;

  std::thread thread_;
};

}  // namespace clothstream::fleet
