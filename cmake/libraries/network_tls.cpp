// SPDX-License-Identifier: MIT
// The part of Boost.Asio for TLS, compiled once. Only programs that use it link OpenSSL.
#include <boost/asio/ssl/impl/src.hpp>
