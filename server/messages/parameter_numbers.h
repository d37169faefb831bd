// SPDX-License-Identifier: MIT
// Numbers of cloths and of the environment between messages and the model, by the tables of parameters.
#pragma once

#include <span>

#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"
#include "proto/parameters/cloth_parameters.h"
#include "proto/parameters/environment_parameters.h"
#include "server/messages/validation.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Numbers that the message gives. Each must be in its range.
parameters::ClothNumbers readNumbers(Checks& checks, const Path& path, const v1::Cloth& message,
                                     const model::Cloth& cloth);
// Numbers that the message gives. Each must be in its range for every cloth. Groups that a change cannot add
// must exist in every cloth.
parameters::ClothNumbers readNumbers(Checks& checks, const Path& path, const v1::ClothChange& message,
                                     std::span<const model::Cloth* const> cloths);
// Fields that the message gives. Each number must be in its range.
parameters::EnvironmentChange readNumbers(Checks& checks, const Path& path, const v1::Environment& message);
parameters::EnvironmentChange readNumbers(Checks& checks, const Path& path,
                                          const v1::ParameterChange& message);
bool changesEnvironment(const v1::ParameterChange& message);

// Sets every number that the cloth or the environment has.
void writeNumbers(const model::Cloth& cloth, v1::Cloth& message);
void writeNumbers(model::Environment environment, v1::Environment& message);

// Copies every number to the change. Springs are copied also if the cloth leaves them out.
void copyNumbers(const v1::Cloth& cloth, v1::ClothChange& change);
// Copies every field, also if the environment leaves it out.
void copyNumbers(const v1::Environment& environment, v1::ParameterChange& change);

}  // namespace clothstream::messages
