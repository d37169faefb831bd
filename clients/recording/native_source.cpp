// SPDX-License-Identifier: MIT
// C interface: recordings in files, and in sources of the program.
#include <clothstream/recording.h>

#include "clients/recording/recording_handle.h"

using namespace clothstream;
using namespace clothstream::client;

namespace {

class ProgramSource : public recording::ByteSource {
 public:
  explicit ProgramSource(const cs_recording_source& source) : source_(source) {}
  std::uint64_t size() const override { return source_.size; }
  bool read(std::uint64_t offset, std::uint64_t count, std::string& out) const override {
    out.resize(count);
    return source_.read(source_.user, offset, reinterpret_cast<std::uint8_t*>(out.data()), count) == 1;
  }

 private:
  cs_recording_source source_;
};

}  // namespace

cs_recording* cs_recording_open(const char* path, uint32_t max_vertices) noexcept {
  return openRecording(recording::openFile(path), path, max_vertices);
}

cs_recording* cs_recording_open_source(const cs_recording_source* source) noexcept {
  if (source->version != CS_RECORDING_SOURCE_VERSION || !source->read)
    return openRecording(
        tl::unexpected(std::string("cs_recording_source has an unknown version or no function "
                                   "`read`; use CS_RECORDING_SOURCE_VERSION.")),
        "", 0);
  return openRecording(std::make_unique<ProgramSource>(*source), "the recording", source->max_vertices);
}
