// SPDX-License-Identifier: MIT
#include "clients/core/wire/datagram_offer.h"

#include <algorithm>
#include <string_view>

#include <protozero/pbf_writer.hpp>

namespace clothstream::client {
namespace {

constexpr std::size_t kLeastUfrag = 4, kMostOfferedUfrag = 64, kMostUfrag = 256;
constexpr std::size_t kLeastIcePassword = 22, kMostIcePassword = 256;
constexpr std::size_t kMostAddressText = 45;  // INET6_ADDRSTRLEN without the zero at its end
constexpr std::uint32_t kMostPort = 65'535;

bool isLetterOrDigit(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

// Whether the text consists of ice-char (RFC 8839 section 5.4).
bool isIceText(std::string_view text, std::size_t least, std::size_t most) {
  return text.size() >= least && text.size() <= most && std::all_of(text.begin(), text.end(), [](char c) {
           return isLetterOrDigit(c) || c == '+' || c == '/';
         });
}

bool isAddressText(std::string_view text) {
  return !text.empty() && text.size() <= kMostAddressText &&
         text.find_first_not_of("0123456789abcdefABCDEF:.") == std::string_view::npos;
}

bool setFingerprint(std::array<std::uint8_t, 32>& target, Reader& reader) {
  const Bytes view = reader.get_view();
  if (view.size() != target.size()) return false;
  std::copy(view.data(), view.data() + view.size(), target.begin());
  return true;
}

}  // namespace

bool isAllowed(const cs_datagram_offer& offer) {
  return offer.version == CS_DATAGRAM_OFFER_VERSION && offer.ufrag && offer.password &&
         isIceText(offer.ufrag, kLeastUfrag, kMostOfferedUfrag) &&
         isIceText(offer.password, kLeastIcePassword, kMostIcePassword) &&
         (offer.sctp == 0 || offer.sctp == 1);
}

void writeDatagramOffer(std::string& out, std::uint64_t requestId, const cs_datagram_offer& offer) {
  using F = field::DatagramOffer;
  out.clear();
  protozero::pbf_writer message(out);
  message.add_uint64(field::ClientMessage::kRequestId.number, requestId);
  protozero::pbf_writer body(message, field::ClientMessage::kDatagramOffer.number);
  body.add_string(F::kUfrag.number, offer.ufrag);
  body.add_string(F::kPassword.number, offer.password);
  body.add_bytes(F::kFingerprint.number, reinterpret_cast<const char*>(offer.fingerprint),
                 sizeof offer.fingerprint);
  if (offer.sctp != 0) body.add_bool(F::kSctp.number, true);
}

std::optional<DatagramAnswer> readDatagramAnswer(Bytes message) {
  using F = field::DatagramAnswer;
  bool hasFingerprint = false;
  auto answer = readMessage<DatagramAnswer>(message, [&](DatagramAnswer& out, std::uint32_t tag,
                                                         Reader& reader) {
    switch (tag) {
      case F::kUfrag.tag:
        return setBytes(out.ufrag, reader) && isIceText(out.ufrag, kLeastUfrag, kMostUfrag);
      case F::kPassword.tag:
        return setBytes(out.password, reader) && isIceText(out.password, kLeastIcePassword, kMostIcePassword);
      case F::kFingerprint.tag:
        return hasFingerprint = setFingerprint(out.fingerprint, reader);
      case F::kAddresses.tag:
        return out.addresses.size() < kMaxDatagramAddresses &&
               setBytes(out.addresses.emplace_back(), reader) && isAddressText(out.addresses.back());
      case F::kPort.tag:
        return set(out.port, reader.get_uint32()) && out.port <= kMostPort;
      default:
        return skip(reader);
    }
  });
  if (!answer) return std::nullopt;
  if (answer->addresses.empty()) return DatagramAnswer{};
  const bool isWhole =
      !answer->ufrag.empty() && !answer->password.empty() && hasFingerprint && answer->port != 0;
  return isWhole ? std::move(answer) : std::nullopt;
}

}  // namespace clothstream::client
