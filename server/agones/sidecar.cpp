// SPDX-License-Identifier: MIT
#include "server/agones/sidecar.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace clothstream::agones {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using nlohmann::json;

constexpr std::size_t kMaxAnswerBytes = 1 << 20;

// 64-bit integers are strings in the JSON form of protobuf.
std::string text(std::int64_t number) {
  return std::to_string(number);
}

}  // namespace

Sidecar::Answer Sidecar::call(const char* method, const std::string& path, const std::string& body,
                              std::string& answer) {
  asio::io_context context;
  beast::tcp_stream stream(context);
  stream.expires_after(kTimeout);
  http::request<http::string_body> request(http::string_to_verb(method), path, 11);
  request.set(http::field::host, fmt::format("localhost:{}", port_));
  request.set(http::field::content_type, "application/json");
  request.set(http::field::connection, "close");
  request.body() = body;
  request.prepare_payload();
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.body_limit(kMaxAnswerBytes);
  beast::error_code failure;
  const auto onError = [&](beast::error_code error) {
    if (error) failure = error;
    return !error;
  };
  stream.async_connect(tcp::endpoint(asio::ip::address_v4::loopback(), port_),
                       [&](beast::error_code connected) {
                         if (!onError(connected)) return;
                         http::async_write(stream, request, [&](beast::error_code written, std::size_t) {
                           if (!onError(written)) return;
                           http::async_read(stream, buffer, parser,
                                            [&](beast::error_code read, std::size_t) { onError(read); });
                         });
                       });
  context.run();
  if (failure) {
    problem_ = failure.message();
    return Answer::unreachable;
  }
  answer = parser.get().body();
  if (parser.get().result() == http::status::ok) return Answer::ok;
  problem_ = fmt::format("{} {}: {} {}", method, path, parser.get().result_int(), answer);
  return parser.get().result() == http::status::not_found ? Answer::unknown : Answer::refused;
}

Sidecar::Answer Sidecar::post(const std::string& path) {
  std::string answer;
  return call("POST", path, "{}", answer);
}

Sidecar::Answer Sidecar::state(std::string& state) {
  std::string answer;
  state.clear();
  const Answer result = call("GET", "/gameserver", "", answer);
  if (result != Answer::ok) return result;
  const json read = json::parse(answer, nullptr, false);
  const json::json_pointer place("/status/state");
  if (read.contains(place) && read[place].is_string()) state = read[place].get<std::string>();
  return result;
}

Sidecar::Answer Sidecar::setCounter(const std::string& name, std::int64_t count, std::int64_t capacity) {
  std::string answer;
  return call("PATCH", "/v1beta1/counters/" + name,
              json{{"count", text(count)}, {"capacity", text(capacity)}}.dump(), answer);
}

Sidecar::Answer Sidecar::addToList(const std::string& name, const std::string& value) {
  std::string answer;
  return call("POST", "/v1beta1/lists/" + name + ":addValue", json{{"value", value}}.dump(), answer);
}

Sidecar::Answer Sidecar::removeFromList(const std::string& name, const std::string& value) {
  std::string answer;
  return call("POST", "/v1beta1/lists/" + name + ":removeValue", json{{"value", value}}.dump(), answer);
}

Sidecar::Answer Sidecar::list(const std::string& name, std::vector<std::string>& values) {
  std::string answer;
  values.clear();
  const Answer result = call("GET", "/v1beta1/lists/" + name, "", answer);
  if (result != Answer::ok) return result;
  const json read = json::parse(answer, nullptr, false);
  if (const auto found = read.find("values"); read.is_object() && found != read.end() && found->is_array())
    for (const json& value : *found)
      if (value.is_string()) values.push_back(value.get<std::string>());
  return result;
}

}  // namespace clothstream::agones
