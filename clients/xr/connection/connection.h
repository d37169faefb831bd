// SPDX-License-Identifier: MIT
// Joins a scene with libclothstream, and joins again after losses and with other choices of the user.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "clients/xr/connection/connection_state.h"

namespace clothstream::xr {

struct ConnectionOptions {
  std::string address;  // as in clothstream_open
  std::string scene;    // "" means the server's default
  std::string name;     // for other participants; may be ""
  std::string code;     // six digits of a pairing; "" means none
  std::string token;    // "" means none
  std::string caFile, fingerprint;
  std::uint32_t quality = 0;    // 0 (finest) to 3
  std::uint32_t role = 0;       // cs_role
  std::uint32_t transport = 0;  // clothstream_transport
  std::uint32_t joinTimeoutMs = 10'000;
};

// All functions are called from one thread, which draws and never waits for the network: a second thread of
// this class opens and closes streams. Decoding has its own thread in libclothstream; acquire() waits for at
// most the message that is being decoded.
class Connection {
 public:
  explicit Connection(ConnectionOptions options);
  // Leaves the scene. Waits for at most half a second for a server that is there, and for the end of an
  // attempt to join.
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Call once per frame, and ten times a second without frames. Returns the CS_EVENT bits of all changes
  // since the last call. A change of the client, such as by another scene, reports CS_EVENT_DESCRIPTION,
  // CS_EVENT_PARAMETERS and CS_EVENT_PARTICIPANTS.
  std::uint32_t update(std::uint64_t nowUs);

  // The client, whose last frame can still be read when the connection is lost. Null before the first join.
  // Its data does not change until the end of the block.
  class Acquired {
   public:
    explicit Acquired(clothstream_stream* stream)
        : stream_(stream), client_(stream ? clothstream_acquire(stream) : nullptr) {}
    ~Acquired() {
      if (stream_) clothstream_release(stream_);
    }
    Acquired(const Acquired&) = delete;
    Acquired& operator=(const Acquired&) = delete;
    cs_client* client() const { return client_; }

   private:
    clothstream_stream* stream_;
    cs_client* client_;
  };
  Acquired acquire() { return Acquired(stream_); }
  // Number of clients so far. Changes when acquire() gives another one.
  std::uint64_t clientNumber() const { return clientNumber_; }

  // Reason why the user stays where they are although they have chosen another scene or quality; "" if
  // nothing was refused since the last call.
  std::string takeNotice() { return std::exchange(notice_, {}); }
  // Whether the options are not allowed, so that no attempt can succeed.
  bool isInvalid() const { return isInvalid_; }

  // Leaves the scene, at the end of the program. Returns whether the second thread still waits for the
  // network, for at most joinTimeoutMs.
  bool leave();

  Phase phase() const { return phase_; }
  const Trouble& trouble() const { return trouble_; }
  const ConnectionOptions& options() const { return options_; }

  // Join another scene, with another limit of quality, or once more after a refusal.
  void join(const std::string& scene);
  void setQuality(std::uint32_t quality);
  void retry();

 private:
  struct Attempt {
    ConnectionOptions options;
    Step step = Step::joining;
    clothstream_result result = CLOTHSTREAM_FAILED;
    std::string error, token;
    clothstream_stream* stream = nullptr;
  };

  void begin();
  void take(Attempt attempt, std::uint64_t nowUs, std::uint32_t& events);
  void fail(Step step, clothstream_result result, const std::string& text, std::uint64_t nowUs);
  void show(Phase phase, Trouble trouble);
  void follow(std::uint64_t nowUs, std::uint32_t& events);
  // Closes a stream on the other thread; null is allowed.
  void close(clothstream_stream* stream);
  void work();
  static void run(Attempt& attempt);

  ConnectionOptions options_;
  ConnectionOptions joined_;  // of the stream
  clothstream_stream* stream_ = nullptr;
  std::uint64_t clientNumber_ = 0;
  Phase phase_ = Phase::connecting;
  Trouble trouble_;
  std::string notice_;
  bool isInvalid_ = false;
  std::uint32_t failures_ = 0;
  std::uint64_t retryUs_ = 0;
  bool ended_ = false;      // the stream has ended, but is still read
  bool isOpening_ = false;  // an attempt is with the other thread
  bool isStale_ = false;    // its options are no longer those of the user

  std::mutex mutex_;  // of all below
  std::condition_variable changed_;
  std::optional<Attempt> wanted_, finished_;
  std::vector<clothstream_stream*> closing_;
  bool ends_ = false;
  std::thread worker_;
};

}  // namespace clothstream::xr
