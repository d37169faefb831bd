// SPDX-License-Identifier: MIT
// Whether an HTTP request has a body.
#pragma once

#include <boost/beast/http/field.hpp>

namespace clothstream::endpoint {

// Also true for a Transfer-Encoding that is not `chunked`. Beast ignores it, so that the body would be read
// as the next request.
template <class Parser>
bool mayHaveBody(const Parser& parser) {
  return parser.get().count(boost::beast::http::field::transfer_encoding) > 0 ||
         parser.content_length().value_or(0) > 0;
}

}  // namespace clothstream::endpoint
