// SPDX-License-Identifier: MIT
#include "server/hosting/surface_maker.h"

#include <utility>
#include <variant>

#include <boost/asio/post.hpp>
#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/model/surface.h"
#include "server/simulation/collision/surface_table.h"
#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::hosting {
namespace {

messages::Result<void> makeNow(scene::LiveScene& scene, CompleteSurface& surface) {
  // A participant that replaces its meshes faster than they can be made keeps only the newest ones waiting.
  if (!scene.surfaces.isAwaited(surface.ticket)) return {};
  auto made = model::makeSurface(std::move(surface.parts.vertices), std::move(surface.parts.triangles));
  if (const auto* problem = std::get_if<model::SurfaceProblem>(&made)) {
    scene.surfaces.cancel(surface.ticket);
    return tl::unexpected(messages::surfaceError(surface.ticket.id, *problem));
  }
  auto& good = std::get<model::MadeSurface>(made);
  if (good.dropped > 0)
    telemetry::log({scene.name(), surface.ticket.participant}, spdlog::level::debug,
                   "surface {}: {} triangles without an area were left out", surface.ticket.id, good.dropped);
  return scene.surfaces.put(surface.ticket, simulation::makeSurfaceTable(std::move(good.surface)),
                            surface.twoSided, surface.friction);
}

}  // namespace

SurfaceMaker::SurfaceMaker() {
  boost::asio::post(thread_, [] { telemetry::nameThread("surface maker"); });
}

SurfaceMaker::~SurfaceMaker() {
  stopping_ = true;
  thread_.join();
}

messages::Result<void> SurfaceMaker::make(std::shared_ptr<scene::LiveScene> scene, CompleteSurface surface,
                                          Done done) {
  if (++waiting_ > kMaxWaiting) {
    --waiting_;
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_RESOURCE_EXHAUSTED,
        fmt::format("surface.id = {}: {} surfaces wait on this server; send it again later",
                    surface.ticket.id, kMaxWaiting),
        telemetry::Refusal::uploads});
  }
  boost::asio::post(thread_, [this, scene = std::move(scene), surface = std::move(surface),
                              done = std::move(done)]() mutable {
    --waiting_;
    if (!stopping_) done(makeNow(*scene, surface));
  });
  return {};
}

}  // namespace clothstream::hosting
