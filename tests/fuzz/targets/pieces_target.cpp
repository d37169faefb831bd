// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/pieces_target.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "clients/core/core.h"
#include "inputs.pb.h"
#include "proto/datagram/frame_assembly.h"
#include "proto/datagram/frame_pieces.h"

namespace clothstream::fuzz {
namespace {

using Bytes = std::vector<std::byte>;

constexpr int kMaxSteps = 256;
constexpr unsigned kParity = 2;
constexpr std::size_t kMaxBytes = 20'000;  // parity takes time

Bytes pieceOf(const PiecesInput::Piece& message) {
  const std::size_t bytes = 1 + message.bytes() % kMaxBytes;
  const datagram::FramePieces frame(
      std::make_shared<const Bytes>(bytes, static_cast<std::byte>(message.frame())), kParity);
  Bytes datagram(datagram::kMaxDatagramBytes);
  datagram.resize(frame.write({.packet = message.packet(), .sentUs = 0, .frame = message.frame()},
                              message.index() % frame.pieces(), datagram));
  for (const Patch& patch : message.patches()) {
    if (datagram.empty()) break;
    const std::size_t at = patch.offset() % datagram.size();
    if (patch.cut() > 0)
      datagram.resize(at);
    else
      std::memcpy(datagram.data() + at, patch.bytes().data(),
                  std::min(patch.bytes().size(), datagram.size() - at));
  }
  return datagram;
}

void checkReadAsWritten(const datagram::Piece& piece, const Bytes& bytes) {
  std::array<std::byte, datagram::kMaxDatagramBytes> out;
  const std::size_t written = datagram::writePiece(piece, out);
  require(std::ranges::equal(std::span(out).first(written), bytes), "a piece has one encoding");
}

// Takes everything that the client would use at this time.
void use(datagram::FrameAssembly& assembly, std::uint64_t nowUs) {
  while (const auto frame = assembly.next(nowUs))
    require(!frame->message.empty() && frame->message.size() <= datagram::kMaxFrameBytes,
            "a frame has a possible length");
  std::uint32_t requests = 0;
  while (assembly.nextRequest(nowUs)) ++requests;
  require(requests <= datagram::FrameAssembly::kMaxFrames + 1, "each frame is requested once at a time");
  const auto due = assembly.dueUs();
  require(!due || *due > nowUs, "nothing is due that was just done");
}

// The same datagrams for the client core, which also gets each input as a message of the stream.
class Core {
 public:
  void receive(const Bytes& bytes, std::uint64_t nowUs) {
    const auto* const data = reinterpret_cast<const std::uint8_t*>(bytes.data());
    cs_receive_datagram(datagrams_.get(), data, bytes.size(), nowUs);
    use(nowUs);
    cs_hold_message(datagrams_.get(), data, bytes.size(), nowUs);
    cs_send_in_datagram(datagrams_.get(), data, bytes.size(), nowUs);
    use(nowUs);
  }

  void use(std::uint64_t nowUs) {
    std::size_t bytes = 0;
    while (cs_next_datagram_message(datagrams_.get(), nowUs, &bytes))
      require(bytes > 0, "messages are not empty");
    while (cs_next_datagram(datagrams_.get(), nowUs, &bytes))
      require(bytes > 0 && bytes <= CS_MAX_DATAGRAM_BYTES, "a datagram has a possible length");
    while (cs_next_stream_message(datagrams_.get(), nowUs, &bytes))
      require(bytes > 0, "messages are not empty");
    require(cs_datagrams_due_at(datagrams_.get()) > nowUs, "nothing is due that was just done");
  }

 private:
  std::unique_ptr<cs_datagrams, decltype(&cs_destroy_datagrams)> datagrams_{cs_create_datagrams(),
                                                                            &cs_destroy_datagrams};
};

void run(const PiecesInput& input) {
  Core core;
  datagram::FrameAssembly assembly;
  std::uint64_t nowUs = 0;
  int steps = 0;
  for (const PiecesInput::Step& step : input.steps()) {
    if (++steps > kMaxSteps) break;
    nowUs += step.microseconds();
    use(assembly, nowUs);
    // Exactly sized, so that the sanitizer detects a read past the end.
    Bytes bytes;
    if (step.has_piece()) {
      bytes = pieceOf(step.piece());
    } else {
      const auto raw = std::as_bytes(std::span(step.raw()));
      bytes.assign(raw.begin(), raw.end());
    }
    bytes.shrink_to_fit();
    core.use(nowUs);
    core.receive(bytes, nowUs);
    const auto piece = datagram::parsePiece(bytes);
    if (!piece) continue;
    checkReadAsWritten(*piece, bytes);
    assembly.add(*piece, nowUs);
    use(assembly, nowUs);
  }
  // An idle stream ends with nothing left to do.
  for (int i = 0; i < 1'000; ++i) {
    const auto due = assembly.dueUs();
    if (!due) break;
    nowUs = std::max(nowUs, *due);
    use(assembly, nowUs);
  }
  require(!assembly.dueUs(), "requests end");
  const datagram::AssemblyStatistics& statistics = assembly.statistics();
  require(statistics.frames + statistics.uselessPieces <= statistics.pieces, "every piece is counted once");
}

}  // namespace

const Target kPiecesTarget{.name = "pieces",
                           .run = &runStructured<PiecesInput, &run>,
                           .structure = &PiecesInput::default_instance()};

}  // namespace clothstream::fuzz
