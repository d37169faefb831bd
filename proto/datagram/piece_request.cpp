// SPDX-License-Identifier: MIT
#include "proto/datagram/piece_request.h"

#include "proto/datagram/bytes.h"

namespace clothstream::datagram {

std::size_t writeRequest(const PieceRequest& request, std::span<std::byte> out) {
  Writer writer(out);
  writer.number(static_cast<std::uint8_t>(Kind::request));
  writer.number(request.frame);
  PieceSet left = request.present;
  for (; left.any(); left >>= 8) writer.number(static_cast<std::uint8_t>((left & PieceSet(0xff)).to_ulong()));
  return writer.written();
}

std::optional<PieceRequest> parseRequest(std::span<const std::byte> datagram) {
  if (kindOf(datagram) != Kind::request) return std::nullopt;
  Reader reader(datagram.subspan(1));
  PieceRequest request{.frame = reader.number<std::uint32_t>(), .present = {}};
  const std::span<const std::byte> mask = reader.rest();
  if (!reader.ok() || 8 * mask.size() > request.present.size()) return std::nullopt;
  if (!mask.empty() && mask.back() == std::byte{}) return std::nullopt;
  for (std::size_t i = mask.size(); i-- > 0;)
    request.present = (request.present << 8) | PieceSet(static_cast<std::uint8_t>(mask[i]));
  return request;
}

}  // namespace clothstream::datagram
