// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

std::string floodChanges(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  for (int i = 0; i < kFlooders; ++i) joined.push_back(std::make_unique<Joined>(*stub, ""));
  const std::uint64_t sent = flood(target, [&](int i) {
    if (!joined[i]->send(windOf(0.01f))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  const auto open = std::ranges::count_if(joined, [](const auto& each) { return each->open(); });
  return fmt::format("{} changes sent; {} of {} streams stay open", sent, open, joined.size());
}

std::string floodPauses(const Target& target) {
  const auto stub = stubOf(target);
  Answers answers;
  bool paused = false;
  repeat(target, [&] {
    grpc::ClientContext context;
    v1::ControlSceneRequest request;
    request.set_name("flag");
    request.set_paused(paused = !paused);
    v1::ControlSceneResponse response;
    answers.add(stub->ControlScene(&context, request, &response));
  });
  return answers.text();
}

// As many colliders as a participant may have.
v1::ClientMessage sixtyColliders() {
  v1::ClientMessage poses;
  for (std::uint32_t id = 1; id <= 60; ++id) {
    v1::ParticipantCollider& pose = *poses.mutable_collider_poses()->add_colliders();
    pose.set_id(id);
    pose.mutable_pose()->mutable_position()->set_y(0.01f * static_cast<float>(id));
    pose.mutable_pose()->mutable_orientation()->set_w(1);
    pose.mutable_sphere()->set_radius(0.05f);
  }
  return poses;
}

std::string floodPoses(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  for (int i = 0; i < kFlooders; ++i) joined.push_back(std::make_unique<Joined>(*stub, "flag"));
  const v1::ClientMessage poses = sixtyColliders();
  const std::uint64_t sent = flood(target, [&](int i) {
    if (!joined[i]->send(poses)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  return fmt::format("{} messages of 60 colliders sent", sent);
}

std::string floodGetScene(const Target& target) {
  std::vector<std::unique_ptr<Stub>> stubs;
  std::vector<Answers> answers(kFlooders);
  for (int i = 0; i < kFlooders; ++i) stubs.push_back(stubOf(target));
  flood(target, [&](int i) {
    grpc::ClientContext context;
    v1::GetSceneRequest request;
    request.set_name("tablecloth");
    v1::GetSceneResponse response;
    answers[i].add(stubs[i]->GetScene(&context, request, &response));
  });
  return "each of 8: " + answers[0].text();
}

std::string floodRecordings(const Target& target) {
  const auto stub = stubOf(target);
  Answers answers;
  int number = 0;
  repeat(target, [&] {
    grpc::ClientContext start, stop;
    v1::StartRecordingRequest request;
    request.set_name(fmt::format("r{}", ++number));
    v1::StartRecordingResponse response;
    answers.add(stub->StartRecording(&start, request, &response));
    v1::StopRecordingRequest end;
    v1::StopRecordingResponse ended;
    stub->StopRecording(&stop, end, &ended);
  });
  return answers.text();
}

// Changes of parameters while other participants of the scene do not read.
std::string changeForUnreading(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> readers, silent;
  for (int i = 0; i < kFlooders; ++i) readers.push_back(std::make_unique<Joined>(*stub, ""));
  for (int i = 0; i < kFlooders; ++i) silent.push_back(std::make_unique<Joined>(*stub, "", false));
  const std::uint64_t sent = flood(target, [&](int i) {
    readers[i]->send(windOf(0.01f));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  });
  const auto open = std::ranges::count_if(readers, [](const auto& each) { return each->open(); });
  return fmt::format("{} changes sent; {} of {} streams that read stay open", sent, open, readers.size());
}

// Colliders of many participants in another scene than the victim's.
std::string fillWithColliders(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  for (int i = 0; i < 40; ++i) joined.push_back(std::make_unique<Joined>(*stub, "flag"));
  const v1::ClientMessage poses = sixtyColliders();
  repeat(target, [&] {
    for (const auto& each : joined) each->send(poses);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  });
  std::string error;
  for (const auto& each : joined)
    if (error.empty()) error = each->lastError();
  return error.empty() ? "accepted" : "refused: " + brief(error);
}

// Lines of the log: each join and each end of a stream is one.
std::string floodLog(const Target& target) {
  std::vector<std::unique_ptr<Stub>> stubs;
  for (int i = 0; i < kFlooders; ++i) stubs.push_back(stubOf(target));
  const std::uint64_t joins = flood(target, [&](int i) { const Joined joined(*stubs[i], "flag"); });
  return fmt::format("{} joins", joins);
}

// Answers that are large, to streams that do not read them.
std::string askWithoutReading(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  for (int i = 0; i < kFlooders; ++i) joined.push_back(std::make_unique<Joined>(*stub, "flag", false));
  v1::ClientMessage question;
  question.set_request_id(1);
  question.mutable_get_scene()->set_name("tablecloth");
  const std::uint64_t sent = flood(target, [&](int i) {
    joined[i]->send(question);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  });
  const auto open = std::ranges::count_if(joined, [](const auto& each) { return each->open(); });
  return fmt::format("{} questions sent; {} of {} streams stay open", sent, open, joined.size());
}

// Pauses, resets, records and deletes the victim's scene without joining it.
std::string controlFromOutside(const Target& target) {
  const auto stub = stubOf(target);
  Answers answers;
  repeat(target, [&] {
    grpc::ClientContext pause, reset, remove;
    v1::ControlSceneRequest request;
    request.set_name(kVictimScene);
    request.set_paused(true);
    v1::ControlSceneResponse controlled;
    answers.add(stub->ControlScene(&pause, request, &controlled));
    request.clear_paused();
    request.set_reset(true);
    answers.add(stub->ControlScene(&reset, request, &controlled));
    v1::DeleteSceneRequest deletion;
    deletion.set_name(kVictimScene);
    v1::DeleteSceneResponse deleted;
    answers.add(stub->DeleteScene(&remove, deletion, &deleted));
  });
  return answers.text();
}

// Names that would forge lines of the log or control a terminal. The server's log is checked after every
// attack.
std::string controlCharacters(const Target& target) {
  const auto stub = stubOf(target);
  constexpr std::array kNames{"\x1b[2J\x1b]0;owned\a", "a\n00:00:00.000 error forged",
                              "b\r\xc2\x9b"
                              "31m",
                              "\xe2\x80\xae"
                              "gnp.exe"};
  std::uint64_t sent = 0;
  repeat(target, [&] {
    for (const char* name : kNames) {
      v1::ClientMessage message = helloTo(name);
      message.mutable_hello()->set_client_name(name);
      message.mutable_hello()->set_display_name(name);
      for (const char* scene : {name, "flag"}) {
        message.mutable_hello()->set_scene(scene);
        grpc::ClientContext context;
        const auto stream = stub->Join(&context);
        stream->Write(message);
        v1::ServerMessage answer;
        stream->Read(&answer);
        context.TryCancel();
        ++sent;
      }
      create(*stub, sheet(name, 4, 1));
    }
  });
  return fmt::format("{} names sent", sent);
}

// Names that look like that of an honest participant. Returns how many different ones others get.
std::string imitate(const Target& target) {
  const auto stub = stubOf(target);
  struct Named {
    Named(Stub& stub, const std::string& name) : stream(stub.Join(&context)) {
      v1::ClientMessage message = helloTo("flag");
      message.mutable_hello()->set_display_name(name);
      stream->Write(message);
      while (!welcome.has_welcome() && stream->Read(&welcome)) {
      }
    }
    ~Named() { context.TryCancel(); }
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReaderWriter<v1::ClientMessage, v1::ServerMessage>> stream;
    v1::ServerMessage welcome;
  };
  std::vector<std::unique_ptr<Named>> joined;
  for (const char* name : {"Ann Lee", "A\u200bnn Lee", "Ann Lee\u2060", "\ufeffAnn Lee", "Ann\u00a0Lee",
                           "\u3164 Ann Lee", "Ann Lee\u00ad", "Ann Lee\U000e0041"})
    joined.push_back(std::make_unique<Named>(*stub, name));
  std::set<std::string> seen;
  for (const v1::Participant& participant : joined.back()->welcome.welcome().participants())
    seen.insert(participant.display_name());
  return fmt::format("{} participants with {} names", joined.back()->welcome.welcome().participants_size(),
                     seen.size());
}

constexpr Attack kAttacksMessage[] = {
    {"parameter_changes", "send parameter changes from eight streams without end", &floodChanges,
     "[0-9]+ changes sent; [0-8] of 8 streams stay open"},
    {"pauses", "pause and resume another scene without end", &floodPauses, "[0-9]+ accepted.*"},
    {"poses", "send 60 colliders from eight streams without end", &floodPoses,
     "[0-9]+ messages of 60 colliders sent"},
    {"get_scene", "ask for a scene from eight connections without end", &floodGetScene,
     "each of 8: [0-9]+ accepted(, [0-9]+ refused with code 8)?"},
    {"recordings", "start and stop recordings of the victim's scene without end", &floodRecordings,
     "[0-9]+ accepted(, [0-9]+ refused with code [0-9]+)*", "--recordings DIRECTORY"},
    {"unread_changes", "change parameters of the victim's scene next to participants that do not read",
     &changeForUnreading, "[0-9]+ changes sent; [0-8] of 8 streams that read stay open"},
    {"unread_answers", "ask for a scene from eight streams and read nothing", &askWithoutReading,
     "[0-9]+ questions sent; 0 of 8 streams stay open"},
    {"colliders", "join a scene with 40 participants of 60 colliders", &fillWithColliders,
     "(accepted|refused: .*)"},
    {"outside_control", "pause, reset and delete the victim's scene from outside", &controlFromOutside,
     "[0-9]+ refused with code [0-9]+(, [0-9]+ refused with code [0-9]+)*", "--owners-alone"},
    {"control_characters", "join and create scenes with control characters in names", &controlCharacters,
     "[1-9][0-9]* names sent", "--log-level debug --profile public"},
    {"look_alikes", "join with names that differ from another one only in invisible characters", &imitate,
     "8 participants with 1 names"},
    {"log_flood", "join and leave without end, with a log", &floodLog, "[1-9][0-9]* joins",
     "--log-level info --profile public"},
};

}  // namespace

std::span<const Attack> messageAttacks() {
  return kAttacksMessage;
}

}  // namespace clothstream::attack
