// SPDX-License-Identifier: MIT
#include "server/hosting/access.h"

#include <memory>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "proto/text/printable.h"

namespace clothstream::hosting {
namespace {

tl::unexpected<messages::FieldError> denied(v1::ErrorCode code, std::string text) {
  return tl::unexpected(messages::FieldError{code, std::move(text)});
}

}  // namespace

Access::Access(const ServerOptions& options, const SceneRegistry& scenes)
    : options_(options), scenes_(scenes) {}

bool Access::isOfOtherTenant(const Identity& by, const scene::LiveScene& scene) {
  return by.verified && scene.terms.created && scene.terms.tenant != by.subject.tenant;
}

messages::Result<void> Access::mayUse(const Identity& by, const std::string& name) const {
  const std::string& meant = name.empty() ? options_.defaultScene : name;
  if (!by.reaches(meant))
    return denied(v1::ERROR_CODE_PERMISSION_DENIED,
                  fmt::format("'{:.64}': your token is only for the scene '{:.64}'", printable(meant),
                              printable(by.scene)));
  const std::shared_ptr<scene::LiveScene> scene = scenes_.find(name);
  if (!scene) return denied(v1::ERROR_CODE_NOT_FOUND, scenes_.noSuchScene(name, by).text());
  if (by.verified && scene->roster.isBanned(by.subject))
    return denied(v1::ERROR_CODE_PERMISSION_DENIED,
                  fmt::format("an owner banned you from the scene '{}'", scene->name()));
  return {};
}

messages::Result<void> Access::mayCreate(const Identity& by) const {
  if (!by.scene.empty())
    return denied(v1::ERROR_CODE_PERMISSION_DENIED,
                  fmt::format("createScene: your token is only for the scene '{:.64}'", printable(by.scene)));
  return scene::permit(by.role, scene::Action::createScene, options_.participantsMay);
}

messages::Result<void> Access::mayFromOutside(const Identity& by, const std::string& name,
                                              scene::Action action) const {
  if (auto may = mayUse(by, name); !may) return may;
  const std::shared_ptr<scene::LiveScene> scene = scenes_.find(name);
  if (scene && isOfOtherTenant(by, *scene))
    return denied(v1::ERROR_CODE_PERMISSION_DENIED,
                  fmt::format("the scene '{}' belongs to another tenant than your token", scene->name()));
  if (by.isVerifiedOwner()) return {};
  // Without identities, every program that reaches a scene without an owner may act as one.
  const bool actsAsOwner =
      by.role == scene::Role::owner && (options_.outsideControl || !scene || !scene->roster.owned());
  if (actsAsOwner) return {};
  const scene::Role role = by.role == scene::Role::owner ? scene::Role::none : by.role;
  messages::Result<void> permitted = scene::permit(role, action, options_.participantsMay);
  if (!permitted && role == scene::Role::none && scene)
    permitted.error().text += fmt::format(", because you are not in the scene '{}'", scene->name());
  return permitted;
}

}  // namespace clothstream::hosting
