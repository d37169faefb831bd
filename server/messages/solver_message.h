// SPDX-License-Identifier: MIT
// Converts solvers between messages and the model.
#pragma once

#include "clothstream/v1/scene.pb.h"
#include "server/messages/validation.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Solver of a cloth. unfitSolver() checks whether it suits the cloth.
model::Solver toSolver(Checks& checks, const Path& path, const v1::Solver& message);
v1::Solver toMessage(const model::Solver& solver);

}  // namespace clothstream::messages
