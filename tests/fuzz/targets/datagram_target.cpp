// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/datagram_target.h"

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "inputs.pb.h"
#include "proto/datagram/input_bundle.h"
#include "proto/datagram/receipt.h"
#include "proto/datagram/sent_frames.h"

namespace clothstream::fuzz {
namespace {

using Bytes = std::vector<std::byte>;

constexpr int kMaxSteps = 256;
constexpr unsigned kParity = 1;
constexpr std::size_t kMaxBytes = 20'000;  // parity takes time

class Server {
 public:
  void send(std::size_t bytes, std::uint64_t nowUs) {
    const auto frame =
        std::make_shared<const datagram::FramePieces>(std::make_shared<const Bytes>(bytes), kParity);
    sent_.add(frame, frame->dataPieces(), nowUs);
    first_ += frame->dataPieces() * frame->datagramBytes();
  }

  void receive(const Bytes& bytes, std::uint64_t nowUs) {
    std::array<std::byte, datagram::kMaxDatagramBytes> out;
    if (const auto request = datagram::parseRequest(bytes)) {
      require(std::ranges::equal(std::span(out).first(datagram::writeRequest(*request, out)), bytes),
              "a request has one encoding");
      answer(*request, nowUs);
    }
    if (const auto receipt = datagram::parseReceipt(bytes))
      require(std::ranges::equal(std::span(out).first(datagram::writeReceipt(*receipt, out)), bytes),
              "a receipt has one encoding");
    if (const auto messages = receiver_.receive(bytes)) {
      require(messages->count <= datagram::kBundledMessages, "a datagram has at most three messages");
      for (const std::span<const std::byte> message : *messages)
        require(!message.empty(), "messages are not empty");
      const auto again = receiver_.receive(bytes);
      require(again && again->count == 0, "each message is delivered once");
    }
  }

 private:
  void answer(const datagram::PieceRequest& request, std::uint64_t nowUs) {
    const auto repeat = sent_.answer(request, nowUs);
    if (!repeat) return;
    require(repeat->number == request.frame && (repeat->pieces & request.present).none(),
            "only missing pieces of the frame are repeated");
    require(repeat->pieces.any() && (repeat->pieces >> repeat->frame->pieces()).none(),
            "pieces that exist are repeated");
    again_ += repeat->pieces.count() * repeat->frame->datagramBytes();
    require(again_ <= first_ / 2 + datagram::SentFrames::kMaxBudget, "repeats stay within their share");
  }

  datagram::SentFrames sent_;
  datagram::InputReceiver receiver_;
  std::size_t first_ = 0, again_ = 0;  // bytes that the peer was sent
};

void run(const DatagramInput& input) {
  Server server;
  std::uint64_t nowUs = 0;
  int steps = 0;
  for (const DatagramInput::Step& step : input.steps()) {
    if (++steps > kMaxSteps) break;
    nowUs += step.microseconds();
    if (step.frame_bytes() > 0) server.send(1 + step.frame_bytes() % kMaxBytes, nowUs);
    const auto given = std::as_bytes(std::span(step.datagram()));
    // Exactly sized, so that the sanitizer detects a read past the end.
    Bytes bytes(given.begin(), given.end());
    bytes.shrink_to_fit();
    server.receive(bytes, nowUs);
  }
}

}  // namespace

const Target kDatagramTarget{.name = "datagram",
                             .run = &runStructured<DatagramInput, &run>,
                             .structure = &DatagramInput::default_instance()};

}  // namespace clothstream::fuzz
