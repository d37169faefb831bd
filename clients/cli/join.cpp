// SPDX-License-Identifier: MIT
// Joins, follows the stream to its end, prints the summary.
#include "clients/cli/join.h"

#include <chrono>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include "clients/cli/error.h"
#include "clients/cli/event_lines.h"
#include "clients/cli/input_lines.h"
#include "clients/cli/obj_file.h"
#include "clients/cli/presence.h"
#include "clients/cli/print.h"
#include "clients/cli/report.h"
#include "clients/cli/signals.h"
#include "clients/cli/stream_time.h"
#include "clients/datagram/datagram_transport.h"
#include "clients/grpc/grpc_client.h"

namespace clothstream::cli {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLineInterval{100};

constexpr std::chrono::milliseconds kInputInterval{5};

// Prints the events of the stream, except frames, to standard error, and lines of events to standard output.
class Listener {
 public:
  Listener(const StatusLine& line, const JoinOptions& options)
      : line_(line), report_(options.report), lines_(options.events), eventLines_(options.frames) {}

  void operator()(cs_client* client, std::uint32_t events) {
    if (lines_) {
      put(eventLines_.of(client, events));
      std::fflush(stdout);
    }
    if (events == 0 && cs_get_state(client) == CS_STATE_RECONNECTING)
      say("the connection is lost; reconnecting");
    if ((events & CS_EVENT_RETURNED) != 0)
      say(cs_resumed(client) != 0 ? "reconnected as the same participant"
                                  : "reconnected as a new participant");
    if ((events & CS_EVENT_NOTICE) != 0) {
      const std::uint64_t by = cs_notice_participant(client);
      say(fmt::format("notice from the server: {}{}", cs_notice_text(client),
                      by == 0 ? "" : fmt::format(" (by {})", nameOf(client, by))));
    }
    if ((events & CS_EVENT_ERROR) != 0 && cs_get_state(client) != CS_STATE_FAILED)
      say(fmt::format("error from the server: {}", cs_error_text(client)));
    if ((events & CS_EVENT_PRESENCE) != 0) {
      cs_presence presence;
      cs_participant participant;
      if (cs_get_presence(client, &presence, &participant) != 0) say(text(client, presence, participant));
    } else if ((events & CS_EVENT_PARTICIPANTS) != 0) {
      sayParticipants(client);
    }
    if (report_ && (events & CS_EVENT_REPORT) != 0) {
      line_.clear();
      for (const ClothFigures& figures : Report::of(client, NativeClient::nowUs()).cloths)
        put(text(figures) + '\n');
      std::fflush(stdout);
    }
  }

 private:
  void say(const std::string& text) const {
    line_.clear();
    print(stderr, "clothstream: {}\n", text);
  }

  void sayParticipants(cs_client* client) const {
    say(fmt::format("joined as {}", roleName(cs_get_role(client))));
    cs_participant other;
    for (std::uint32_t i = 0; cs_get_participant(client, i, &other) != 0; ++i)
      if (other.id != cs_participant_id(client))
        say(fmt::format("{} is here as {}{}{}", nameOf(other), roleName(other.role), numberOf(other),
                        other.away != 0 ? ", currently disconnected" : ""));
  }

  const StatusLine& line_;
  bool report_, lines_;
  EventLines eventLines_;
};

void sendInput(NativeClient& client, const JoinOptions& options) {
  client.visit([&](cs_client* core) {
    if (options.events) cs_want_contacts(core, 1, NativeClient::nowUs());
    if (options.colliders.empty()) return;
    cs_set_colliders(core, options.colliders.data(), static_cast<std::uint32_t>(options.colliders.size()),
                     NativeClient::nowUs());
  });
}

// Lines of input, and the body that they move. It moves between two lines as well: its arms and feet follow.
class Input {
 public:
  explicit Input(InputLines lines) : lines_(std::move(lines)) {}

  // Sends the lines whose time has come, and the body about 90 times in a second.
  tl::expected<void, Error> send(NativeClient& client) {
    tl::expected<void, Error> sent;
    for (;;) {
      const auto line = lines_.next(SteadyClock::now());
      if (!line) return tl::unexpected(Error{kUnreadable, line.error()});
      if (!*line) break;
      client.visit([&](cs_client* core) {
        if (auto done = (*line)->send(core, NativeClient::nowUs()); !done)
          sent = tl::unexpected(Error{kUnreadable, fmt::format("{}: {}", lines_.place(), done.error())});
      });
      if (!sent) return sent;
      if ((*line)->body) body_ = (*line)->body;
    }
    if (!body_ || SteadyClock::now() < nextBody_) return sent;
    nextBody_ = SteadyClock::now() + kBodyInterval;
    client.visit([&](cs_client* core) { cs_set_body(core, &*body_, NativeClient::nowUs()); });
    return sent;
  }
  // Whether nothing is left to send.
  bool atEnd() const { return lines_.atEnd() && !body_; }

 private:
  static constexpr std::chrono::milliseconds kBodyInterval{11};

  InputLines lines_;
  std::optional<cs_tracked_body> body_;
  SteadyClock::time_point nextBody_;
};

Report reportOf(NativeClient& client) {
  Report report;
  client.visit([&](cs_client* core) { report = Report::of(core, NativeClient::nowUs()); });
  report.datagrams = client.datagrams();
  return report;
}

// Waits for the end of the time, a signal or the end of the stream. Returns an error if the stream ended, or
// the input is wrong.
std::optional<Error> follow(NativeClient& client, const JoinOptions& options, Input* input,
                            const StatusLine& line) {
  StreamTime time(options.seconds);
  auto nextLine = SteadyClock::now();  // of the terminal
  for (;;) {
    if (input != nullptr)
      if (auto sent = input->send(client); !sent) return std::move(sent).error();
    const auto wait = time.next(input != nullptr && !input->atEnd() ? kInputInterval : kLineInterval,
                                reportOf(client).statistics.frames);
    if (!wait || interrupted(*wait)) return std::nullopt;
    if (const std::optional<Failure> failure = client.ended())
      return Error{exitCodeOf(failure->kind), failure->text};
    if (!line.shown() || SteadyClock::now() < nextLine) continue;
    nextLine = SteadyClock::now() + kLineInterval;
    line.show(reportOf(client));
  }
}

}  // namespace

ExitCode join(const JoinOptions& options) {
  std::optional<files::NewFile> obj;
  if (!options.objPath.empty()) {
    auto created = files::NewFile::create(options.objPath);
    if (!created) return printError(kNotWritten, created.error());
    obj.emplace(std::move(*created));
  }
  std::optional<Input> input;
  if (!options.inputPath.empty()) {
    auto opened = InputLines::open(options.inputPath);
    if (!opened) return printError(kUnreadable, opened.error());
    input.emplace(std::move(*opened));
  }
  const StatusLine line(!options.json && !options.events && isatty(STDOUT_FILENO) != 0);
  NativeClientOptions clientOptions;
  clientOptions.scene = options.scene;
  clientOptions.clientName = "clothstream join";
  clientOptions.displayName = options.name;
  clientOptions.role = options.role;
  clientOptions.quality = options.quality;
  clientOptions.maxVertices = options.maxVertices;
  if (!options.reconnects) clientOptions.reconnectFor = std::chrono::milliseconds(0);
  clientOptions.cancelled = [] { return interrupted(); };
  auto joined = NativeClient::join(options.address,
                                   withDatagrams(makeGrpcTransport(options.address), options.datagrams),
                                   clientOptions, Listener(line, options));
  if (!joined) return printError(joined.error());
  NativeClient& client = **joined;
  sendInput(client, options);

  const std::optional<Error> failure = follow(client, options, input ? &*input : nullptr, line);
  line.clear();
  ExitCode code = kOk;
  if (failure) code = printError(*failure);
  std::string summary;
  client.visit([&](cs_client* core) {
    Report report = Report::of(core, NativeClient::nowUs());
    report.datagrams = client.datagrams();
    if (options.hash && report.statistics.hash_mismatches > 0)
      code =
          printError(kHashMismatch, fmt::format("{} of {} decoded frames differ from the server's",
                                                report.statistics.hash_mismatches, report.statistics.frames));
    if (obj && report.statistics.frames == 0)
      code = printError(kNotWritten, fmt::format("{} was not written: no frame arrived", options.objPath));
    else if (obj)
      if (auto written = writeObj(core, *obj); !written) code = printError(kNotWritten, written.error());
    summary = options.events ? summaryLine(report.json(options.hash))
                             : (options.json ? report.json(options.hash) : report.text(options.hash)) + '\n';
  });
  joined->reset();  // no event follows the summary
  put(summary);
  return code;
}

}  // namespace clothstream::cli
