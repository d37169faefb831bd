// SPDX-License-Identifier: MIT
// A recording of a small cloth that waves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "proto/codec/stream_layout.h"
#include "proto/recording/mcap_writer.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::recording {

inline constexpr std::uint64_t kSampleStart = 1'700'000'000'000'000'000;  // ns
inline constexpr std::uint32_t kSampleRate = 60;                          // frames/s
constexpr std::uint64_t sampleTime(std::uint64_t frame) {
  return kSampleStart + frame * 1'000'000'000 / kSampleRate;
}

// Of its stream, but that its description says how many temporal layers there are.
const codec::StreamLayout& sampleLayout();
v1::StreamDescription sampleDescription(std::uint8_t layers = 1);

// Of so many frames, with ticks beside them. As its sink got it.
void writeSample(const Sink& sink, std::uint32_t frames, std::uint8_t layers = 1);
std::string sampleRecording(std::uint32_t frames, std::uint8_t layers = 1);

// Before each frame of a number that this divides, but the first, sliders were moved: with each second of
// these the wind's x became that frame's number, with the others the stiffness of the structural springs.
inline constexpr std::uint32_t kFramesAChange = 6;
void writeSampleWithSliders(const Sink& sink, std::uint32_t frames,
                            const codec::StreamLayout& layout = sampleLayout());
// Of the wind and the stiffness, as they are with this frame.
struct SampleSliders {
  float wind = 0, stiffness = 0;
};
SampleSliders sampleSliders(std::uint32_t frame);

// Fails where the bytes cannot be opened.
RecordingReader readerOf(std::string bytes, CutFiles cutFiles = CutFiles::refused);

// What is read until the end or the first error: so many messages of this topic.
std::size_t countMessages(RecordingReader& reader, Topic topic);

}  // namespace clothstream::recording
