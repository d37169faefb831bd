// SPDX-License-Identifier: MIT
// Sample recording of a small waving cloth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/stream_layout.h"
#include "proto/recording/mcap_writer.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::recording {

inline constexpr std::uint64_t kSampleStart = 1'700'000'000'000'000'000;  // ns
inline constexpr std::uint32_t kSampleRate = 60;                          // frames/s
inline constexpr std::uint32_t kSampleFrames = 150;                       // usual length: 2.5 s, 13 chunks
constexpr std::uint64_t sampleTime(std::uint64_t frame) {
  return kSampleStart + frame * 1'000'000'000 / kSampleRate;
}

// Layout of its stream.
const codec::StreamLayout& sampleLayout();
v1::StreamDescription sampleDescription();

// Writes a recording of `frames` frames and their ticks to the sink.
void writeSample(const Sink& sink, std::uint32_t frames);
std::string sampleRecording(std::uint32_t frames);

// Interval of parameter changes in frames, starting after the first frame. At every second change the wind's
// x becomes the frame's number, at the others the stiffness of the structural springs.
inline constexpr std::uint32_t kFramesAChange = 6;
void writeSampleWithSliders(const Sink& sink, std::uint32_t frames,
                            const codec::StreamLayout& layout = sampleLayout());
// Wind and stiffness at this frame.
struct SampleSliders {
  float wind = 0, stiffness = 0;
};
SampleSliders sampleSliders(std::uint32_t frame);

// The same recording with other messages of a topic; all checksums of the file are valid. `change` takes the
// number of the message and its bytes.
std::string withMessages(const std::string& recording, Topic topic,
                         const std::function<void(std::size_t, std::string&)>& change);
// The same for frames.
std::string withFrames(const std::string& recording,
                       const std::function<void(std::size_t, v1::Frame&)>& change);
// Every packet is a text.
std::string withGarbage(const std::string& recording);

// The frames from this one on have quality 1. It must be a key frame.
std::string withCoarseFrames(const std::string& recording, std::uint32_t first);

// Fails the test if the bytes cannot be opened.
RecordingReader readerOf(std::string bytes, CutFiles cutFiles = CutFiles::refused);

// Reads to the end or the first error and counts the messages of this topic.
std::size_t countMessages(RecordingReader& reader, Topic topic);

}  // namespace clothstream::recording
