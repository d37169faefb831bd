// SPDX-License-Identifier: MIT
// WebAssembly: the host reads the bytes of a recording, and decompresses its chunks. The module imports two
// functions from "clothstream".
#include <cstdint>

#include "clients/recording/recording_handle.h"
#include "proto/recording/decompress.h"

using namespace clothstream;
using namespace clothstream::client;

extern "C" {

// Copies bytes of a source to `out`. Returns 1, or 0 if they cannot be read.
[[clang::import_module("clothstream"), clang::import_name("read")]] int clothstream_host_read(
    std::uint32_t source, double offset, char* out, std::uint32_t count);
// Decompresses a zstd frame. Returns 1 if it has exactly this size, else 0.
[[clang::import_module("clothstream"), clang::import_name("decompress")]] int clothstream_host_decompress(
    const char* frame, std::uint32_t frameBytes, char* out, std::uint32_t size);

// Opens a source of the host. `source` is its number; `bytes` its size; `maxVertices` as in
// recording.h.
cs_recording* cs_recording_open_host(std::uint32_t source, double bytes, std::uint32_t maxVertices);

}  // extern "C"

namespace {

class HostSource : public recording::ByteSource {
 public:
  HostSource(std::uint32_t source, std::uint64_t size) : source_(source), size_(size) {}
  std::uint64_t size() const override { return size_; }
  bool read(std::uint64_t offset, std::uint64_t count, std::string& out) const override {
    out.resize(static_cast<std::size_t>(count));
    return clothstream_host_read(source_, static_cast<double>(offset), out.data(),
                                 static_cast<std::uint32_t>(count)) == 1;
  }

 private:
  std::uint32_t source_;
  std::uint64_t size_;
};

}  // namespace

namespace clothstream::recording {

bool decompressZstd(std::string_view frame, std::uint64_t size, std::string& out) {
  out.resize(static_cast<std::size_t>(size));
  return clothstream_host_decompress(frame.data(), static_cast<std::uint32_t>(frame.size()), out.data(),
                                     static_cast<std::uint32_t>(size)) == 1;
}

}  // namespace clothstream::recording

cs_recording* cs_recording_open_host(std::uint32_t source, double bytes, std::uint32_t maxVertices) {
  return openRecording(std::make_unique<HostSource>(source, static_cast<std::uint64_t>(bytes)),
                       "the recording", maxVertices);
}
