// SPDX-License-Identifier: MIT
// Sends a parameter change and waits for the answer.
#include "clients/cli/set.h"

#include <algorithm>
#include <array>
#include <bit>
#include <condition_variable>
#include <cstdint>
#include <mutex>

#include <fmt/format.h>

#include "clients/cli/error.h"
#include "clients/grpc/grpc_client.h"

namespace clothstream::cli {
namespace {

constexpr std::chrono::seconds kPatience{10};

bool changesCloths(const SetOptions& options) {
  // Compares the bits, because unchanged values are NaN.
  using Words = std::array<std::uint32_t, sizeof(cs_cloth_settings) / sizeof(std::uint32_t)>;
  cs_cloth_settings none;
  cs_keep_cloth_settings(&none);
  return std::bit_cast<Words>(none) != std::bit_cast<Words>(options.settings);
}

// Null if the option is not given.
const float* given(const SetOptions& options, parameters::EnvironmentField field) {
  const std::vector<float>& numbers = options.environment[field];
  return numbers.empty() ? nullptr : numbers.data();
}

// Answers of the server to the changes of this client. The stream's thread adds them.
class Answers {
 public:
  void heard(cs_client* client, std::uint32_t events) {
    const std::lock_guard lock(mutex_);
    if ((events & CS_EVENT_ERROR) != 0) refusal_ = cs_error_text(client);
    if ((events & CS_EVENT_PARAMETERS) != 0 && cs_parameters_participant(client) == cs_participant_id(client))
      ++held_;
    if ((events & CS_EVENT_SCENES) != 0) ++held_;
    changed_.notify_all();
  }

  // Waits until `count` changes are accepted. Returns an empty string, or the reason of a failure.
  std::string waitFor(int count) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [&] { return held_ >= count || !refusal_.empty(); }))
      return fmt::format("the server did not answer within {} s; check its address and load, then try again",
                         kPatience.count());
    return refusal_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int held_ = 0;
  std::string refusal_;
};

std::string noSuchCloth(const cs_client* client, const std::string& name) {
  std::string known;
  cs_cloth cloth;
  for (std::uint32_t i = 0; cs_get_cloth(client, i, &cloth) != 0; ++i)
    known += (known.empty() ? "" : ", ") + std::string(cloth.name);
  return fmt::format("--cloth: '{}' does not exist in the scene {}; use one of {}", name,
                     cs_scene_name(client), known);
}

}  // namespace

bool changesAnything(const SetOptions& options) {
  const bool changesEnvironment =
      std::ranges::any_of(options.environment, [](const auto& numbers) { return !numbers.empty(); });
  return changesCloths(options) || changesEnvironment || !options.material.empty() || options.arealMass ||
         !options.collider.empty() || !options.attachment.empty();
}

ExitCode set(const SetOptions& options) {
  Answers answers;
  NativeClientOptions clientOptions;
  clientOptions.scene = options.scene;
  clientOptions.clientName = "clothstream set";
  clientOptions.maxVertices = options.maxVertices;
  clientOptions.reconnectFor = std::chrono::milliseconds(0);
  auto joined = joinByGrpc(options.address, clientOptions,
                           [&](cs_client* client, std::uint32_t events) { answers.heard(client, events); });
  if (!joined) return printError(joined.error());
  int changes = 0;
  std::string refusal;
  const auto changeBy = [&](const auto& send) {
    if (!refusal.empty()) return;
    (*joined)->visit([&](cs_client* client) { send(client); });
    if (refusal.empty()) refusal = answers.waitFor(changes);
  };
  // The material must be in effect before other settings apply to it.
  changeBy([&](cs_client* client) {
    if (options.material.empty()) return;
    cs_set_material(client, options.cloth.c_str(), options.material.c_str());
    ++changes;
  });
  changeBy([&](cs_client* client) {
    if (changesCloths(options)) {
      if (cs_set_cloth(client, options.cloth.c_str(), &options.settings) == 0)
        return void(refusal = noSuchCloth(client, options.cloth));
      ++changes;
    }
    if (options.arealMass) {
      cs_set_areal_mass(client, options.cloth.c_str(), *options.arealMass);
      ++changes;
    }
    const float* const gravity = given(options, parameters::kGravity);
    const float* const wind = given(options, parameters::kWind);
    const float* const airDensity = given(options, parameters::kAirDensity);
    if (gravity != nullptr || wind != nullptr || airDensity != nullptr) {
      cs_set_environment(client, gravity, wind, airDensity);
      ++changes;
    }
    if (!options.collider.empty()) {
      cs_collider_change change;
      cs_keep_collider(&change);
      std::ranges::copy(options.position, change.position);
      change.radius = options.radius.value_or(change.radius);
      cs_set_collider(client, options.collider.c_str(), &change);
      ++changes;
    }
    if (const std::vector<float>& gust = options.environment[parameters::kGust]; !gust.empty()) {
      cs_set_gust(client, gust[0], gust.size() > 1 ? gust[1] : initial(parameters::kGust, 1));
      ++changes;
    }
  });
  // The server does not confirm a moved attachment, but answers in order. A client sends requests before
  // poses. So the pose is sent by the first answer, and a refusal comes before the second one.
  for (int round = 0; round < 2 && !options.attachment.empty(); ++round)
    changeBy([&](cs_client* client) {
      if (round == 0)
        cs_move_attachment(client, options.attachment.c_str(), options.position.data(),
                           options.orientation.empty() ? nullptr : options.orientation.data(),
                           options.jumps ? 1 : 0, NativeClient::nowUs());
      cs_list_scenes(client);
      ++changes;
    });
  if (const auto failure = (*joined)->ended(); failure && !refusal.empty())
    return printError(exitCodeOf(failure->kind), failure->text);
  if (!refusal.empty()) return printError(kRefused, refusal);
  return kOk;
}

}  // namespace clothstream::cli
