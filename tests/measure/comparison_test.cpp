// SPDX-License-Identifier: MIT
// `clothstream diff` and `golden`, and `clothstream-server resimulate`, with recordings in which one thing
// was changed.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include "clothstream/v1/recording.pb.h"
#include "proto/recording/recorded_description.h"
#include "proto/recording/recording_writer.h"
#include "tests/e2e/process.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/recording/sample.h"

namespace clothstream::recording {
namespace {

using nlohmann::json;
using ::testing::EndsWith;
using ::testing::HasSubstr;

constexpr std::chrono::seconds kPatience{60};
constexpr std::uint32_t kFrames = 60;

struct Ended {
  int code = -1;
  std::string output, errors;
};

Ended run(const std::vector<std::string>& command) {
  e2e::Process process(command);
  const int code = process.waitForEnd(kPatience).value_or(-1);
  return {code, process.output(), process.errors()};
}

Ended clothstream(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), CLOTHSTREAM);
  return run(arguments);
}

// Changes a message, or returns false to leave it out.
using Change = std::function<bool(Topic, std::string& bytes)>;
const Change kNoChange = [](Topic, std::string&) { return true; };

// Changes the first tick with this number.
template <typename Apply>
Change changeTick(std::uint64_t number, const Apply& apply) {
  return [number, apply](Topic topic, std::string& bytes) {
    v1::RecordedTick tick;
    if (topic != Topic::ticks || !tick.ParseFromString(bytes) || tick.tick() != number) return true;
    apply(tick);
    bytes = tick.SerializeAsString();
    return true;
  };
}

class Comparison : public ::testing::Test {
 protected:
  std::string pathOf(const std::string& name) const { return (directory_.path() / name).string(); }

  // Writes the sample with a change and this hash of its kernels.
  std::string write(const std::string& name, const std::string& kernels = "1",
                    const Change& change = kNoChange) const {
    return rewrite(readerOf(sampleRecording(kFrames)), name, kernels, change);
  }
  std::string rewrite(RecordingReader reader, const std::string& name, const std::string& kernels,
                      const Change& change) const {
    std::string out;
    const Sink sink = [&](std::string_view more) {
      out += more;
      return Written();
    };
    Metadata metadata = reader.metadata();
    metadata["shaders"] = kernels;
    auto writer = RecordingWriter::begin(sink, "test", metadata);
    EXPECT_TRUE(writer);
    for (auto message = reader.next(); message && *message; message = reader.next()) {
      std::string bytes((*message)->bytes);
      if (!change((*message)->topic, bytes)) continue;
      EXPECT_TRUE(writer->write((*message)->topic, (*message)->time, bytes));
    }
    EXPECT_TRUE(writer->finish());
    save(name, out);
    return pathOf(name);
  }
  void save(const std::string& name, const std::string& bytes) const {
    std::ofstream(pathOf(name), std::ios::binary) << bytes;
  }
  std::string contentOf(const std::string& name) const {
    std::ifstream file(pathOf(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  json diff(const std::string& a, const std::string& b) const {
    const Ended ended = clothstream({"diff", a, b, "--json"});
    const json result = json::parse(ended.output, nullptr, false);
    EXPECT_TRUE(result.is_object()) << ended.errors << ended.output;
    EXPECT_EQ(result.value("exitCode", -1), ended.code);
    return result;
  }

  e2e::TemporaryDirectory directory_;
};

// Recordings that a server made, with changes.
class Resimulation : public Comparison {
 protected:
  void SetUp() override {
    if (run({CLOTHSTREAM_SERVER, "--list-devices"}).output.empty())
      GTEST_SKIP() << "there is no Vulkan device";
  }
  std::string writeFlag(const std::string& name, const std::string& kernels,
                        const Change& change = kNoChange) const {
    const std::string kept = "tests/replay/" CLOTHSTREAM_VERSION "/flag.mcap.gz";
    gzFile in = gzopen(kept.c_str(), "rb");
    std::string bytes;
    std::vector<char> part(65'536);
    for (int count = 1; in != nullptr && count > 0;) {
      count = gzread(in, part.data(), static_cast<unsigned>(part.size()));
      if (count > 0) bytes.append(part.data(), static_cast<std::size_t>(count));
    }
    EXPECT_TRUE(in != nullptr && gzclose(in) == Z_OK) << kept;
    return rewrite(readerOf(bytes), name, kernels, change);
  }
  json resimulate(const std::string& path) const {
    const Ended ended = run({CLOTHSTREAM_SERVER, "resimulate", path, "--json"});
    const json result = json::parse(ended.output, nullptr, false);
    EXPECT_TRUE(result.is_object()) << ended.errors << ended.output;
    EXPECT_EQ(result.value("exitCode", -1), ended.code);
    return result;
  }
};

// From here on the wind blows harder than it did, so that the recorded states cannot come again.
constexpr std::uint64_t kChangedTick = 15;
Change otherWind() {
  return changeTick(kChangedTick, [](v1::RecordedTick& tick) { tick.mutable_wind()->set_x(40); });
}

using Diff = Comparison;
using GoldenRecordings = Comparison;

TEST_F(Diff, EqualRecordingsAreEqual) {
  const std::string a = write("a"), b = write("b");
  const json result = diff(a, b);
  EXPECT_EQ(result["exitCode"], 0) << result;
  EXPECT_EQ(result["kernels"], "same");
  EXPECT_EQ(result["frames"]["common"], kFrames);
  EXPECT_EQ(result["ticks"]["common"], kFrames);
  EXPECT_TRUE(result["input"].empty());
  const Ended text = clothstream({"diff", a, b});
  EXPECT_THAT(text.output, HasSubstr("input     equal\n"));
  EXPECT_THAT(text.output, EndsWith("\nequal\n"));
  // Other kernels that give the same bits make no difference.
  EXPECT_EQ(diff(a, write("c", "2"))["exitCode"], 0);
}

TEST_F(Diff, FindsAnotherHashOfAStateAndItsKernels) {
  const Change otherState = changeTick(17, [](v1::RecordedTick& tick) { tick.set_state_hash(1); });
  const std::string a = write("a");
  const json same = diff(a, write("b", "1", otherState));
  EXPECT_EQ(same["exitCode"], 1);
  EXPECT_EQ(same["firstDifferentTick"], 17);
  EXPECT_EQ(same["ticks"]["differentStates"], 1);
  EXPECT_EQ(same["frames"]["different"], 0);
  const json other = diff(a, write("c", "2", otherState));
  EXPECT_EQ(other["exitCode"], 9);
  EXPECT_EQ(other["verdict"], "other kernels");
  EXPECT_EQ(other["kernels"], "other");
  const json unknown = diff(a, write("d", "", otherState));
  EXPECT_EQ(unknown["exitCode"], 1);
  EXPECT_EQ(unknown["kernels"], "unknown");
}

TEST_F(Diff, SaysWhatDiffersInTheInput) {
  const std::string a = write("a");
  const json ticks = diff(a, write("b", "1", changeTick(20, [](v1::RecordedTick& tick) {
                                     tick.mutable_wind()->set_x(3);
                                     tick.add_colliders()->set_participant_id(7);
                                   })));
  EXPECT_EQ(ticks["exitCode"], 0);  // the states are the same
  EXPECT_EQ(ticks["input"]["ticks"]["tick"], 20);
  EXPECT_THAT(std::string(ticks["input"]["ticks"]["text"]), HasSubstr("wind"));
  EXPECT_THAT(std::string(ticks["input"]["ticks"]["text"]), HasSubstr("colliders[0]"));
  EXPECT_THAT(clothstream({"diff", a, pathOf("b")}).output, HasSubstr("input     ticks differ: tick 20: "));

  const json scene = diff(a, write("c", "1", [](Topic topic, std::string& bytes) {
                            v1::StreamDescription description;
                            if (topic != Topic::description || !description.ParseFromString(bytes))
                              return true;
                            description.mutable_definition()->mutable_environment()->set_air_density(2);
                            bytes = description.SerializeAsString();
                            return true;
                          }));
  EXPECT_THAT(std::string(scene["input"]["scene"]["text"]), HasSubstr("definition"));

  std::string sliders;
  writeSampleWithSliders(
      [&](std::string_view more) {
        sliders += more;
        return Written();
      },
      kFrames);
  save("sliders", sliders);
  const json parameters = diff(a, pathOf("sliders"));
  EXPECT_EQ(parameters["input"]["parameters"]["text"], "A has 0 changes of parameters, B has more");
  EXPECT_EQ(parameters["input"]["parameters"]["tick"], kFramesAChange + 1);
}

TEST_F(Diff, FindsEveryByteThatWasChanged) {
  const std::string a = write("a"), content = contentOf("a");
  // A step that visits headers, chunks, indexes and the end of the file.
  for (std::size_t at = 3; at < content.size(); at += content.size() / 23) {
    std::string changed = content;
    changed[at] = static_cast<char>(changed[at] ^ 0x10);
    save("changed", changed);
    const Ended ended = clothstream({"diff", a, pathOf("changed")});
    EXPECT_TRUE(ended.code == 10 || ended.code == 7 || ended.code == 1)
        << "byte " << at << ": " << ended.code << ended.output << ended.errors;
  }
}

TEST_F(Diff, CutRecordingMissesData) {
  const std::string a = write("a"), content = contentOf("a");
  const RecordingReader reader = readerOf(content);
  save("cut", content.substr(0, reader.mcap().chunks().back().offset));
  const json result = diff(a, pathOf("cut"));
  EXPECT_EQ(result["exitCode"], 10);
  EXPECT_GT(result["frames"]["only"][0], 0);
  EXPECT_THAT(std::string(result["damaged"][1][0]), HasSubstr("end is missing"));
}

TEST_F(Diff, LostFramesAreMissing) {
  int frames = 0;
  const std::string b = write("b", "1", [&](Topic topic, std::string&) {
    // The last frame of a group, so that no other frame needs it.
    return topic != Topic::frames || ++frames != 24;
  });
  const json result = diff(write("a"), b);
  EXPECT_EQ(result["exitCode"], 10);
  EXPECT_EQ(result["frames"]["only"], json::array({1, 0}));
}

TEST_F(GoldenRecordings, FindsReplacedMissingAndNewRecordings) {
  const auto withoutTicks = [](Topic topic, std::string&) { return topic != Topic::ticks; };
  write("a.mcap", "1", withoutTicks);
  write("b.mcap", "1", withoutTicks);
  const std::string folder = directory_.path().string();
  const Ended unknown = clothstream({"golden", folder});
  EXPECT_EQ(unknown.code, 7);
  EXPECT_THAT(unknown.errors, HasSubstr("--update` makes it"));
  EXPECT_EQ(clothstream({"golden", folder, "--update"}).code, 0);
  const Ended same = clothstream({"golden", folder});
  EXPECT_EQ(same.code, 0) << same.output << same.errors;
  EXPECT_THAT(same.output, HasSubstr("equal         a.mcap: 60 frames"));

  write("c.mcap", "1", withoutTicks);
  std::filesystem::remove(pathOf("b.mcap"));
  const Ended missing = clothstream({"golden", folder});
  EXPECT_EQ(missing.code, 10);
  EXPECT_THAT(missing.output, HasSubstr("missing       b.mcap: the file does not exist"));
  EXPECT_THAT(missing.output, HasSubstr("missing       c.mcap: is not in golden.json"));

  int frames = 0;
  write("a.mcap", "1", [&](Topic topic, std::string&) {
    return topic != Topic::ticks && (topic != Topic::frames || ++frames < 30);
  });
  const Ended replaced = clothstream({"golden", folder, "--json"});
  EXPECT_EQ(replaced.code, 1);
  EXPECT_EQ(json::parse(replaced.output)["recordings"][0]["verdict"], "different");
  EXPECT_THAT(replaced.output, HasSubstr("it has 29 frames and 0 ticks with other hashes"));
}

TEST_F(Resimulation, KeepsVerdictsApart) {
  const json same = resimulate(writeFlag("same", "1"));
  EXPECT_EQ(same["exitCode"], 0) << same;
  EXPECT_EQ(same["verdict"], "equal");
  EXPECT_TRUE(same["firstDifferent"].is_null());
  const json different = resimulate(writeFlag("different", "", otherWind()));
  EXPECT_EQ(different["exitCode"], 1) << different;
  EXPECT_EQ(different["kernels"], "unknown");
  EXPECT_EQ(different["firstDifferent"]["tick"], kChangedTick);
  const json kernels = resimulate(writeFlag("kernels", "2", otherWind()));
  EXPECT_EQ(kernels["exitCode"], 9) << kernels;
  const json missing = resimulate(writeFlag("missing", "", [](Topic topic, std::string& bytes) {
    v1::RecordedTick tick;
    return topic != Topic::ticks || !tick.ParseFromString(bytes) || tick.tick() != kChangedTick;
  }));
  EXPECT_EQ(missing["exitCode"], 10) << missing;
  EXPECT_EQ(missing["missing"][0]["after"], kChangedTick - 1);
}

TEST_F(Resimulation, FramesShowHowFarADifferentStateIs) {
  const std::string path = writeFlag("different", "", otherWind());
  const json result = resimulate(path);
  EXPECT_GT(result["frames"]["compared"], 5);
  const double largest = result["frames"]["largest"]["largest"];
  EXPECT_GT(largest, result["frames"]["maxError"]);
  EXPECT_LT(largest, 2);
  const Ended text = run({CLOTHSTREAM_SERVER, "resimulate", path});
  EXPECT_EQ(text.code, 1);
  EXPECT_THAT(text.output, HasSubstr("frames show other positions: nodes are at most "));
}

TEST_F(Resimulation, GoldenSaysWhichRecordingsAreNoLongerSimulatedAsTheyWere) {
  writeFlag("still.mcap", "1");
  writeFlag("changed.mcap", "", otherWind());
  const std::string folder = directory_.path().string();
  EXPECT_EQ(clothstream({"golden", folder, "--update"}).code, 0);
  const Ended ended = clothstream({"golden", folder, "--server", CLOTHSTREAM_SERVER});
  EXPECT_EQ(ended.code, 1) << ended.errors;
  EXPECT_THAT(ended.output, HasSubstr("equal         still.mcap: "));
  EXPECT_THAT(ended.output, HasSubstr("different     changed.mcap: "));
  EXPECT_THAT(ended.output, HasSubstr("first tick 15; by at most "));
  EXPECT_THAT(ended.output, EndsWith("2 recordings: different\n"));
}

TEST_F(GoldenRecordings, RefusesABrokenManifest) {
  write("a.mcap");
  for (
      const char* text :
      {"", "[]", "{}", R"({"format": 2})", R"({"format": 1, "recordings": {"a": 1}})",
       R"({"format": 1, "recordings": {"../a": {"frames": 1, "ticks": 0, "frameHash": "0", "tickHash": "0"}}})"}) {
    save("golden.json", text);
    const Ended ended = clothstream({"golden", directory_.path().string()});
    EXPECT_EQ(ended.code, 7) << text;
    EXPECT_THAT(ended.errors, HasSubstr("golden.json is broken")) << text;
  }
}

TEST_F(GoldenRecordings, NamesTheServerThatCannotRun) {
  write("a.mcap");
  EXPECT_EQ(clothstream({"golden", directory_.path().string(), "--update"}).code, 0);
  const Ended ended = clothstream({"golden", directory_.path().string(), "--server", "/nowhere/server"});
  EXPECT_EQ(ended.code, 8);
  EXPECT_THAT(ended.errors, HasSubstr("cannot run /nowhere/server"));
}

TEST_F(Comparison, ImportedRecordingDescribesNormalsAndQualities) {
  const std::string states = pathOf("states.npz"), imported = pathOf("imported.mcap");
  ASSERT_EQ(clothstream({"export", write("sample.mcap"), states}).code, 0);
  const Ended ended = clothstream({"import", states, "-o", imported});
  ASSERT_EQ(ended.code, 0) << ended.errors;
  auto reader = RecordingReader::open(imported);
  ASSERT_TRUE(reader) << reader.error();
  const auto description = readDescription(*reader);
  ASSERT_TRUE(description) << description.error();
  EXPECT_EQ(description->normals(), v1::NORMALS_NONE);
  EXPECT_EQ(description->qualities(), 1u);
}

}  // namespace
}  // namespace clothstream::recording
