// SPDX-License-Identifier: MIT
// Certificates that are signed with their own key. A fingerprint is what proves them.
#pragma once

#include <chrono>
#include <string>

#include "proto/tls/openssl.h"

namespace clothstream::tls {

// A new key of the curve P-256. Throws std::runtime_error.
Key makeKey();

// A certificate of this key. It is valid for `validity` from a day ago, because clocks of peers may be
// behind. `names`: alternative names in OpenSSL's form, such as "DNS:localhost,IP:192.0.2.1". A certificate
// with names is for servers; one without is for either end of a connection. Throws std::runtime_error.
X509Certificate makeCertificate(EVP_PKEY& key, std::chrono::hours validity, const std::string& names);

}  // namespace clothstream::tls
