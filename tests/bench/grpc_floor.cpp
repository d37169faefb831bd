// SPDX-License-Identifier: MIT
// clothstream-bench-grpc: processor time that gRPC itself takes to send paced messages to many streams. Its
// server is minimal: one thread, one completion queue, no serialisation. The exit status is 1 if a message
// was not delivered in time.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <absl/synchronization/mutex.h>
#include <fmt/format.h>
#include <grpcpp/alarm.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "clients/grpc/channel.h"

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::system_clock;

struct Options {
  std::size_t streams = 120;
  std::size_t bytes = 7400;
  double rate = 72;        // messages a second to each stream
  std::uint32_t acks = 1;  // every n-th message is acknowledged; 0: none
  double seconds = 6;      // measured seconds, after one second of warm-up
};

constexpr std::size_t kAckBytes = 8;
constexpr auto kOpeningTimeout = 10s;

// Processor time of this process, in seconds.
double processorSeconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Reads messages and answers every n-th of them.
class Client final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  Client(const std::string& address, std::uint32_t acks)
      : acks_(acks), stub_(clothstream::makeChannel(address)) {
    stub_.PrepareBidiStreamingCall(&context_, "/clothstream.bench/Floor", grpc::StubOptions(), this);
    StartRead(&incoming_);
    StartCall();
  }

 private:
  void OnReadDone(bool ok) override {
    if (!ok) return;
    acknowledge();
    StartRead(&incoming_);
  }
  void OnWriteDone(bool) override {
    const std::lock_guard lock(mutex_);
    writing_ = false;
  }
  void acknowledge() {
    const std::lock_guard lock(mutex_);
    if (acks_ == 0 || ++read_ % acks_ != 0 || writing_) return;
    writing_ = true;
    const grpc::Slice slice(std::string(kAckBytes, 'a'));
    outgoing_ = grpc::ByteBuffer(&slice, 1);
    StartWrite(&outgoing_);
  }

  const std::uint32_t acks_;
  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::ByteBuffer incoming_, outgoing_;
  std::mutex mutex_;
  std::uint64_t read_ = 0;
  bool writing_ = false;
};

// Clients in a separate process, so that their time is not the server's. It reads the server's port from a
// pipe and ends when the other end is closed.
[[noreturn]] void runClients(int pipe, const Options& options) {
  int port = 0;
  if (::read(pipe, &port, sizeof port) != sizeof port) ::_exit(1);
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  std::vector<std::unique_ptr<Client>> clients;
  for (std::size_t i = 0; i < options.streams; ++i)
    clients.push_back(std::make_unique<Client>(fmt::format("127.0.0.1:{}", port), options.acks));
  char end = 0;
  const ssize_t ended = ::read(pipe, &end, sizeof end);
  ::_exit(ended == 0 ? 0 : 1);
}

struct Figures {
  std::uint64_t messages = 0, acks = 0, late = 0;
  double seconds = 0, processor = 0;
};

// Everything runs on the thread that calls run().
class Server {
 public:
  explicit Server(const Options& options) : options_(options), payload_(options.bytes, 'x') {
    absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_WRITE_BUFFER_SIZE, 1);  // same as the server's
    builder.RegisterAsyncGenericService(&service_);
    queue_ = builder.AddCompletionQueue();
    server_ = builder.BuildAndStart();
    if (!server_) throw std::runtime_error("gRPC cannot listen");
  }
  ~Server() {
    server_->Shutdown(Clock::now());
    queue_->Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_->Next(&tag, &ok)) continue;
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  int port() const { return port_; }

  Figures run() {
    const auto period =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / options_.rate));
    const Clock::time_point started = Clock::now();
    std::optional<Clock::time_point> measured;
    Figures before;
    Clock::time_point due = started;
    grpc::Alarm alarm;
    Operation tick{nullptr, Operation::Kind::tick};
    alarm.Set(queue_.get(), due, &tick);
    accept();
    void* tag = nullptr;
    bool ok = false;
    while (queue_->Next(&tag, &ok)) {
      Operation& operation = *static_cast<Operation*>(tag);
      if (operation.kind != Operation::Kind::tick) {
        completed(operation, ok);
        continue;
      }
      const Clock::time_point now = Clock::now();
      if (!measured) {
        if (streams_.size() == options_.streams + 1) measured = now + 1s;
        if (now - started > kOpeningTimeout) throw std::runtime_error("not all clients connected in time");
      } else if (before.seconds == 0 && now >= *measured) {
        before = figures(started);
      } else if (before.seconds > 0 && now - *measured >= std::chrono::duration<double>(options_.seconds)) {
        return difference(figures(started), before);
      }
      for (const auto& stream : streams_) send(*stream);
      due += period;
      alarm.Set(queue_.get(), due, &tick);
    }
    throw std::runtime_error("gRPC's completion queue ended");
  }

 private:
  struct Stream;
  struct Operation {
    enum class Kind : std::uint8_t { begin, read, write, tick };
    Stream* stream = nullptr;
    Kind kind = Kind::tick;
  };
  struct Stream {
    grpc::GenericServerContext context;
    grpc::GenericServerAsyncReaderWriter io{&context};
    grpc::ByteBuffer incoming;
    bool open = false, writing = false;
    Operation begin{this, Operation::Kind::begin}, read{this, Operation::Kind::read},
        write{this, Operation::Kind::write};
  };

  void accept() {
    Stream& stream = *streams_.emplace_back(std::make_unique<Stream>());
    service_.RequestCall(&stream.context, &stream.io, queue_.get(), queue_.get(), &stream.begin);
  }

  void completed(const Operation& operation, bool ok) {
    Stream& stream = *operation.stream;
    if (!ok) throw std::runtime_error("a client disconnected");
    if (operation.kind == Operation::Kind::write) {
      stream.writing = false;
      ++sum_.messages;
      return;
    }
    if (operation.kind == Operation::Kind::begin) {
      stream.open = true;
      accept();
    } else {
      ++sum_.acks;
    }
    stream.io.Read(&stream.incoming, &stream.read);
  }

  void send(Stream& stream) {
    if (!stream.open) return;
    if (stream.writing) {
      ++sum_.late;
      return;
    }
    stream.writing = true;
    const grpc::Slice slice(payload_.data(), payload_.size(), grpc::Slice::STATIC_SLICE);
    stream.io.Write(grpc::ByteBuffer(&slice, 1), &stream.write);
  }

  Figures figures(Clock::time_point started) const {
    Figures now = sum_;
    now.seconds = std::chrono::duration<double>(Clock::now() - started).count();
    now.processor = processorSeconds();
    return now;
  }
  static Figures difference(const Figures& a, const Figures& b) {
    return {a.messages - b.messages, a.acks - b.acks, a.late - b.late, a.seconds - b.seconds,
            a.processor - b.processor};
  }

  const Options options_;
  const std::string payload_;
  int port_ = 0;
  grpc::AsyncGenericService service_;
  std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  std::unique_ptr<grpc::Server> server_;
  std::vector<std::unique_ptr<Stream>> streams_;  // the last one waits for its client
  Figures sum_;
};

void report(const Options& options, const Figures& figures) {
  const auto messages = static_cast<double>(figures.messages);
  fmt::print(
      "{} streams, {} bytes, {:.1f} messages/s each, {:.2f} acknowledgements a message\n"
      "{:.2f} cores, {:.1f} us a message, {:.2f} Gbit/s a core\n",
      options.streams, options.bytes, messages / figures.seconds / static_cast<double>(options.streams),
      static_cast<double>(figures.acks) / messages, figures.processor / figures.seconds,
      1e6 * figures.processor / messages,
      8e-9 * messages * static_cast<double>(options.bytes) / figures.processor);
  if (figures.late > 0)
    throw std::runtime_error(
        fmt::format("{} messages were due before the previous one was sent", figures.late));
}

void measure(const Options& options) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("cannot create a pipe");
  // Forks before gRPC starts threads.
  const pid_t clients = ::fork();
  if (clients < 0) throw std::runtime_error("cannot create a process");
  if (clients == 0) {
    ::close(ends[1]);
    runClients(ends[0], options);
  }
  ::close(ends[0]);
  Server server(options);
  const int port = server.port();
  if (::write(ends[1], &port, sizeof port) != sizeof port)
    throw std::runtime_error("the client process ended");
  const Figures figures = server.run();
  ::close(ends[1]);
  ::waitpid(clients, nullptr, 0);
  report(options, figures);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Measures the processor time that gRPC itself takes to send paced messages to many streams on "
      "loopback."};
  Options options;
  app.add_option("--streams", options.streams, "Clients, a stream and a connection each")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--bytes", options.bytes, "Bytes of a message")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  app.add_option("--rate", options.rate, "Messages a second to each stream")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
  app.add_option("--acks", options.acks, "Acknowledge every n-th message; 0: none")->capture_default_str();
  app.add_option("--seconds", options.seconds, "Seconds to measure")
      ->check(CLI::Range(1.0, 600.0))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    measure(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "clothstream-bench-grpc: %s\n", error.what());
    return 1;
  }
}
