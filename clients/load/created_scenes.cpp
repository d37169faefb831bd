// SPDX-License-Identifier: MIT
// Each request has a separate connection, because a server limits the requests of one connection.
#include "clients/load/created_scenes.h"

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <random>
#include <thread>
#include <utility>

namespace clothstream::load {
namespace {

using std::chrono::steady_clock;

// Longer than a server takes for a scene before it gives it up (--profile).
constexpr std::chrono::seconds kCreationTime{90};
// Time for the scene that is being created when the test ends.
constexpr std::chrono::seconds kLastCreationTime{10};
// Time without an answer after which no more deletions are awaited.
constexpr std::chrono::seconds kDeletionTime{30};
constexpr std::size_t kDeletionsAtOnce = 16;
constexpr std::chrono::milliseconds kPollInterval{2};

std::string randomPrefix() {
  char text[16];
  std::snprintf(text, sizeof text, "load-%08x-", static_cast<unsigned>(std::random_device{}()));
  return text;
}

}  // namespace

CreatedScenes::CreatedScenes(Links& links, std::string token, v1::Scene definition)
    : links_(links), token_(std::move(token)), prefix_(randomPrefix()), definition_(std::move(definition)) {}

CreatedScenes::~CreatedScenes() {
  remove();
}

std::string CreatedScenes::name(std::uint32_t scene) const {
  return prefix_ + std::to_string(scene);
}

bool CreatedScenes::exists(std::uint32_t scene) {
  if (request_) takeAnswer();
  if (scene < count()) return true;
  if (!request_ && !failure_) request_ = creationOf(count());
  return false;
}

void CreatedScenes::takeAnswer() {
  const std::optional<SceneRequest::Answer> answer = request_->answer();
  if (!answer) {
    if (steady_clock::now() - request_->sent() < kCreationTime) return;
    failure_ = {Failure::Kind::lost,
                "the server did not answer within " + std::to_string(kCreationTime.count()) + " s"};
  } else if (answer->failure) {
    failure_ = answer->failure;
  } else {
    seconds_.push_back(std::chrono::duration<double>(answer->arrived - request_->sent()).count());
  }
  request_.reset();
}

std::unique_ptr<SceneRequest> CreatedScenes::creationOf(std::uint32_t scene) const {
  v1::ClientMessage message;
  message.set_request_id(1);
  v1::Scene& created = *message.mutable_create_scene()->mutable_scene();
  created = definition_;
  created.set_name(name(scene));
  return std::make_unique<SceneRequest>(links_, token_, message);
}

std::unique_ptr<SceneRequest> CreatedScenes::deletionOf(std::uint32_t scene) const {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_delete_scene()->set_name(name(scene));
  return std::make_unique<SceneRequest>(links_, token_, message);
}

CreatedScenes::Remaining CreatedScenes::remove() {
  for (const auto end = steady_clock::now() + kLastCreationTime; request_ && steady_clock::now() < end;
       takeAnswer())
    std::this_thread::sleep_for(kPollInterval);
  request_.reset();

  Remaining remaining;
  const auto remains = [&](std::size_t scenes, const Failure& why) {
    if (scenes > 0 && remaining.scenes == 0) remaining.why = why;
    remaining.scenes += static_cast<std::uint32_t>(scenes);
  };
  std::vector<std::unique_ptr<SceneRequest>> requests;
  std::uint32_t next = 0;
  auto heard = steady_clock::now();
  while (next < count() || !requests.empty()) {
    while (requests.size() < kDeletionsAtOnce && next < count()) requests.push_back(deletionOf(next++));
    std::this_thread::sleep_for(kPollInterval);
    std::erase_if(requests, [&](const std::unique_ptr<SceneRequest>& request) {
      const std::optional<SceneRequest::Answer> answer = request->answer();
      if (!answer) return false;
      heard = steady_clock::now();
      if (answer->failure) remains(1, *answer->failure);
      return true;
    });
    if (steady_clock::now() - heard < kDeletionTime) continue;
    remains(requests.size() + count() - next,
            {Failure::Kind::lost,
             "the server did not answer within " + std::to_string(kDeletionTime.count()) + " s"});
    break;
  }
  seconds_.clear();
  return remaining;
}

}  // namespace clothstream::load
