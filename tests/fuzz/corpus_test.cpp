// SPDX-License-Identifier: MIT
// Every target with every committed input, among them all that ever broke a promise.
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/fuzz/target.h"
#include "tests/serving/allocated_bytes.h"
#include "tests/support/eventually.h"

namespace clothstream::fuzz {
namespace {

constexpr std::size_t kMaxFiles = 100;
constexpr std::uintmax_t kMaxFolderBytes = 64 * 1024;
constexpr double kMebibyte = 1 << 20;
// Processor time of one input. The fuzzers allow one second; sanitizers and debug builds are slower.
constexpr double kMaxSeconds = 10;

std::vector<std::filesystem::path> filesOf(const Target& target) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::directory_iterator("tests/fuzz/corpus/" + std::string(target.name)))
    files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

std::vector<std::byte> readFile(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const auto view = std::as_bytes(std::span(bytes));
  return {view.begin(), view.end()};
}

// Processor time of all threads of the process, s. Does not depend on other programs of the machine.
double processorSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Largest memory of the process so far.
double peakBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024;
}

class Corpus : public ::testing::TestWithParam<const Target*> {};

TEST_P(Corpus, KeepsThePromises) {
  const Target& target = *GetParam();
  const std::vector<std::filesystem::path> files = filesOf(target);
  ASSERT_FALSE(files.empty());
  double settled = 0;
  // Constants and caches of the first pass stay in memory.
  for (const bool first : {true, false}) {
    for (const std::filesystem::path& file : files) {
      SCOPED_TRACE(file.string());
      const std::vector<std::byte> input = readFile(file);
      const double begin = processorSeconds();
      target.run(input);
      EXPECT_LE(processorSeconds() - begin, kMaxSeconds) << "the input costs too much";
    }
    if (first) settled = tests::allocatedBytes();
  }
  // Threads of the target may still be freeing what the last input has used.
  EXPECT_TRUE(tests::eventually([&] { return tests::allocatedBytes() < settled + kMebibyte; }))
      << "inputs leave memory behind: " << tests::allocatedBytes() - settled << " bytes";
#ifndef __SANITIZE_ADDRESS__
  EXPECT_LT(peakBytes(), 512 * kMebibyte);
#endif
}

TEST_P(Corpus, IsReadableAndSmall) {
  const std::vector<std::filesystem::path> files = filesOf(*GetParam());
  EXPECT_LE(files.size(), kMaxFiles);
  std::uintmax_t bytes = 0;
  for (const std::filesystem::path& file : files) {
    bytes += std::filesystem::file_size(file);
    if (GetParam()->structure == nullptr) continue;
    const std::unique_ptr<google::protobuf::Message> message(GetParam()->structure->New());
    EXPECT_TRUE(parseText(readFile(file), *message)) << file << " is not an input of this target";
  }
  EXPECT_LE(bytes, kMaxFolderBytes);
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Corpus, ::testing::ValuesIn(targets().begin(), targets().end()),
                         [](const auto& instance) { return std::string(instance.param->name); });

}  // namespace
}  // namespace clothstream::fuzz
