// SPDX-License-Identifier: MIT
// Entry points for libFuzzer. The program is linked with one target.
#include <algorithm>
#include <cstring>
#include <ctime>
#include <memory>
#include <string>

#include "tests/fuzz/mutator.h"
#include "tests/fuzz/target.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t maxSize);

namespace clothstream::fuzz {
namespace {

const Target& target() {
  return *targets().front();
}

// Seconds of processor time that all threads of the process have taken. Unlike libFuzzer's own limit this
// does not depend on other programs of the machine.
double processorSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void mutateBytes(std::string& bytes) {
  constexpr std::size_t kMost = 4096;
  const std::size_t size = bytes.size();
  bytes.resize(std::max(size + 64, std::min(2 * size, kMost)));
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), size, bytes.size()));
}

std::unique_ptr<google::protobuf::Message> read(const std::uint8_t* data, std::size_t size) {
  std::unique_ptr<google::protobuf::Message> message(target().structure->New());
  if (!parseText(std::as_bytes(std::span(data, size)), *message)) message->Clear();
  return message;
}

// Returns the number of bytes, or 0 if they do not fit.
std::size_t write(const google::protobuf::Message& message, std::uint8_t* data, std::size_t maxSize) {
  const std::string text = toText(message);
  if (text.size() > maxSize) return 0;
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

}  // namespace
}  // namespace clothstream::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace clothstream::fuzz;
  const double begin = processorSeconds();
  target().run(std::as_bytes(std::span(data, size)));
  require(processorSeconds() - begin <= 1, "an input takes at most a second");
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t maxSize,
                                               unsigned seed) {
  using namespace clothstream::fuzz;
  if (target().structure == nullptr) return LLVMFuzzerMutate(data, size, maxSize);
  const auto message = read(data, size);
  Mutator(seed, target().words, mutateBytes).mutate(*message, maxSize / 4);
  const std::size_t written = write(*message, data, maxSize);
  return written > 0 ? written : size;
}

extern "C" std::size_t LLVMFuzzerCustomCrossOver(const std::uint8_t* first, std::size_t firstSize,
                                                 const std::uint8_t* second, std::size_t secondSize,
                                                 std::uint8_t* out, std::size_t maxSize, unsigned seed) {
  using namespace clothstream::fuzz;
  if (target().structure == nullptr) {
    // The beginning of one input and the end of the other.
    const std::size_t kept = std::min({firstSize, maxSize, firstSize == 0 ? 0 : seed % firstSize});
    const std::size_t from = secondSize == 0 ? 0 : (seed >> 8) % secondSize;
    const std::size_t added = std::min(secondSize - from, maxSize - kept);
    std::memcpy(out, first, kept);
    std::memcpy(out + kept, second + from, added);
    return kept + added;
  }
  const auto message = read(first, firstSize);
  Mutator(seed, target().words).crossOver(*message, *read(second, secondSize));
  return write(*message, out, maxSize);
}
