// SPDX-License-Identifier: MIT
// Native clients over gRPC.
#pragma once

#include <memory>

#include <tl/expected.hpp>

#include "clients/native/native_client.h"

namespace clothstream {

// `address` must come from completeAddress().
std::unique_ptr<Transport> makeGrpcTransport(const ServerAddress& address);

// NativeClient::join() over gRPC.
[[nodiscard]] tl::expected<std::unique_ptr<NativeClient>, Failure> joinByGrpc(
    const ServerAddress& address, const NativeClientOptions& options, NativeClient::OnEvents onEvents);

}  // namespace clothstream
