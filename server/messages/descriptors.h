// SPDX-License-Identifier: MIT
// protobuf's descriptions of all messages.
#pragma once

namespace clothstream::messages {

// Builds the descriptors of all messages. protobuf would build them when they are first used. If memory ran
// out at that time, they would stay damaged, and the next use would end the process.
void buildDescriptors();

}  // namespace clothstream::messages
