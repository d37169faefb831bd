// SPDX-License-Identifier: MIT
// Numbers of a cloth between the messages Cloth and ClothChange and the model, by the table of parameters.
#pragma once

#include <span>

#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"
#include "proto/parameters/cloth_parameters.h"
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

// Sets every number that the cloth has.
void writeNumbers(const model::Cloth& cloth, v1::Cloth& message);

// Copies every number to the change. Springs are copied also if the cloth leaves them out.
void copyNumbers(const v1::Cloth& cloth, v1::ClothChange& change);

}  // namespace clothstream::messages
