// SPDX-License-Identifier: MIT
#include "proto/sctp/association.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "proto/sctp/big_endian.h"

namespace clothstream::sctp {
namespace {

constexpr unsigned kTagReflected = 1;  // T bit of ABORT and SHUTDOWN COMPLETE
constexpr std::size_t kMaxValueBytes = kMaxSentBytes - 16;

// Content of the cause "missing mandatory parameter" (RFC 9260, section 3.3.10.2).
std::array<std::byte, 6> missingForwardTsn() {
  std::array<std::byte, 6> content{};
  write32(content, 0, 1);
  write16(content, 4, kForwardTsnParameter);
  return content;
}

}  // namespace

Association::Association(const Options& options, Callbacks callbacks)
    : options_(options), callbacks_(std::move(callbacks)), sent_(options.firstTsn, options.patience) {
  assert(options.tag != 0);
}

void Association::connect(Time now) {
  assert(state_ == State::closed);
  state_ = State::cookieWait;
  appendRepeated();
  flush();
  armRepeat(now);
}

void Association::receive(Time now, std::span<const std::byte> bytes) {
  const auto packet = parsePacket(bytes);
  if (!packet) return;
  std::span<const std::byte> rest = packet->chunks;
  auto chunk = takeChunk(rest);
  if (!chunk || !belongsHere(*packet, *chunk)) return;
  bool needsSack = false;
  if (chunk->type == ChunkType::init) {
    handleInit(*chunk);  // alone in its packet
  } else {
    for (; chunk && state_ != State::ended; chunk = takeChunk(rest)) {
      needsSack |= chunk->type == ChunkType::data || chunk->type == ChunkType::forwardTsn;
      if (!handle(now, *chunk)) break;
    }
  }
  if (needsSack && isConnected()) {
    ++unacknowledgedPackets_;
    if (sackNow_ || unacknowledgedPackets_ >= 2) {
      appendSack();
    } else {
      sackAt_ = std::min(sackAt_, now + kSackDelay);
    }
  }
  flush();
  armRepeat(now);
}

void Association::advance(Time now) {
  if (hasEnded()) return;
  if (now >= sackAt_) appendSack();
  if (const auto tsn = sent_.giveUp(now)) write32(append(ChunkType::forwardTsn, 0, 4), 0, *tsn);
  if (now >= repeatAt_) {
    if (repeats_ == kMaxRepeats) return abort("the peer does not acknowledge");
    appendRepeated();
    ++repeats_;
    repeatAt_ = now + std::min<Duration>(kFirstRepeat * (1 << repeats_), kLongestRepeat);
  }
  flush();
}

Time Association::deadline() const {
  return hasEnded() ? kNever : std::min({sackAt_, repeatAt_, sent_.deadline()});
}

SendResult Association::send(Time now, const Message& message, bool sackNow) {
  if (!isConnected()) return SendResult::notConnected;
  if (message.payload.empty() || message.payload.size() > kMaxPayloadBytes) return SendResult::badSize;
  if (!sent_.hasRoom(now)) return SendResult::full;
  const Data data{.tsn = sent_.take(now),
                  .stream = message.stream,
                  .protocol = message.protocol,
                  .sackNow = sackNow,
                  .payload = message.payload};
  // An acknowledgement that waits travels along if there is room for both chunks.
  if (sackAt_ != kNever && !received_->hasGaps() && out_.fits(sackBytes({}) + 4 + dataBytes(data)))
    appendSack();
  appendData(data);
  flush();
  return SendResult::sent;
}

SendResult Association::sendReliable(Time now, const Message& message) {
  if (!isConnected()) return SendResult::notConnected;
  if (message.payload.empty() || message.payload.size() > kMaxPayloadBytes) return SendResult::badSize;
  if (sent_.kept().size() >= kMaxReliable || !sent_.hasRoom(now)) return SendResult::full;
  const Data data{.tsn = sent_.take(now),
                  .stream = message.stream,
                  .protocol = message.protocol,
                  .unordered = false,
                  .payload = message.payload};
  sent_.keep(data);
  appendData(data);
  flush();
  armRepeat(now);
  return SendResult::sent;
}

void Association::resetStream(Time now, std::uint16_t stream) {
  if (!isConnected() || !peer_->reconfig) return;
  const bool isFirst = !resets_->isWaiting();
  if (resets_->request(stream, sent_.newest()) && isFirst) appendResetRequest();
  flush();
  armRepeat(now);
}

void Association::abort(std::string_view reason) {
  if (!hasEnded()) abortFor(Cause::userInitiated, std::as_bytes(std::span(reason)), reason);
}

bool Association::belongsHere(const Packet& packet, const Chunk& first) const {
  if (first.type == ChunkType::init) return packet.tag == 0;
  if ((first.type == ChunkType::abort || first.type == ChunkType::shutdownComplete) &&
      (first.flags & kTagReflected) != 0)
    return peer_ && packet.tag == peer_->tag;
  return packet.tag == options_.tag;
}

bool Association::handle(Time now, const Chunk& chunk) {
  switch (chunk.type) {
    case ChunkType::data:
      if (isConnected()) handleData(chunk);
      return true;
    case ChunkType::initAck:
      handleInitAck(chunk);
      return true;
    case ChunkType::sack:
      if (isConnected()) handleSack(now, chunk);
      return true;
    case ChunkType::heartbeat:
      if (isConnected() && chunk.value.size() <= kMaxValueBytes)
        std::ranges::copy(chunk.value, append(ChunkType::heartbeatAck, 0, chunk.value.size()).begin());
      return true;
    case ChunkType::abort:
      end(State::ended, "the peer aborted the association");
      return true;
    case ChunkType::shutdown:
      handleShutdown();
      return true;
    case ChunkType::shutdownComplete:
      if (state_ == State::shutdownAckSent) state_ = State::ended;
      return true;
    case ChunkType::cookieEcho:
      handleCookieEcho(chunk);
      return true;
    case ChunkType::cookieAck:
      if (state_ == State::cookieEchoed) establish();
      return true;
    case ChunkType::forwardTsn:
      if (isConnected()) handleForwardTsn(chunk);
      return true;
    case ChunkType::reconfig:
      if (isConnected()) handleReconfig(chunk);
      return true;
    case ChunkType::init:
    case ChunkType::heartbeatAck:
    case ChunkType::shutdownAck:
    case ChunkType::error:
      return true;
  }
  return reportUnknown(chunk);
}

void Association::handleData(const Chunk& chunk) {
  const auto data = parseData(chunk);
  if (!data) return;
  if (data->payload.empty())
    return abortFor(Cause::noUserData, chunk.value.first(4), "the peer sent a message without data");
  const ReceivedTsns::Arrival arrival = received_->add(data->tsn);
  sackNow_ |= data->sackNow || arrival != ReceivedTsns::Arrival::isNew || received_->hasGaps();
  if (arrival == ReceivedTsns::Arrival::isNew && !data->fragment && data->stream < kStreams)
    callbacks_.deliver({data->stream, data->protocol, data->payload});
}

void Association::handleInit(const Chunk& chunk) {
  const auto init = parseInit(chunk);
  if (!init || isConnected() || hasEnded()) return;
  if (state_ == State::cookieEchoed && init->tag != peer_->tag) return;
  if (!accept(*init)) return;
  const Cookie cookie = ownCookie();
  Init answer = ownInit();
  answer.cookie = cookie;
  answer.unrecognized = init->unrecognized;
  writeInit(append(ChunkType::initAck, 0, initBytes(answer)), answer);
}

void Association::handleInitAck(const Chunk& chunk) {
  if (state_ != State::cookieWait) return;
  const auto init = parseInit(chunk);
  if (!init || init->cookie.empty() || init->cookie.size() > kMaxCookieBytes || !accept(*init)) return;
  state_ = State::cookieEchoed;
  peerCookie_.assign(init->cookie.begin(), init->cookie.end());
  restartRepeat();
  appendRepeated();
}

void Association::handleCookieEcho(const Chunk& chunk) {
  if (!peer_ || hasEnded() || !std::ranges::equal(chunk.value, ownCookie())) return;
  if (!isConnected()) establish();
  append(ChunkType::cookieAck, 0, 0);
}

void Association::handleSack(Time now, const Chunk& chunk) {
  const auto sack = parseSack(chunk);
  if (!sack) return;
  const std::size_t kept = sent_.kept().size();
  if (sent_.acknowledge(now, *sack) && sent_.kept().size() < kept) restartRepeat();
}

void Association::handleForwardTsn(const Chunk& chunk) {
  if (chunk.value.size() < 4) return;
  sackNow_ |= !received_->skipTo(read32(chunk.value, 0));
}

void Association::handleReconfig(const Chunk& chunk) {
  std::vector<std::byte> responses;
  if (resets_->receive(chunk.value, responses, callbacks_.reset)) restartRepeat();
  if (responses.empty() || !isConnected()) return;
  std::ranges::copy(responses, append(ChunkType::reconfig, 0, responses.size()).begin());
}

// Nothing that was sent is waited for, so the acknowledgement follows at once. The peer repeats SHUTDOWN if
// it is lost.
void Association::handleShutdown() {
  if (!isConnected() && state_ != State::shutdownAckSent) return;
  append(ChunkType::shutdownAck, 0, 0);
  end(State::shutdownAckSent, "the peer shut the association down");
}

// The two highest bits of an unknown type say what to do with it (RFC 9260, section 3.2).
bool Association::reportUnknown(const Chunk& chunk) {
  const auto type = static_cast<std::uint8_t>(chunk.type);
  const std::size_t bytes = 4 + chunk.whole.size();
  if ((type & 0x40) != 0 && isConnected() && bytes <= kMaxValueBytes)
    writeCause(append(ChunkType::error, 0, bytes), Cause::unrecognizedChunk, chunk.whole);
  return (type & 0x80) != 0;
}

// Without FORWARD-TSN a peer would wait for lost messages for ever.
bool Association::accept(const Init& init) {
  peer_ = {init.tag, init.tsn, init.window, init.reconfig, init.zeroChecksum};
  if (!init.forwardTsn)
    abortFor(Cause::missingParameter, missingForwardTsn(), "the peer does not know FORWARD-TSN (RFC 3758)");
  return init.forwardTsn;
}

void Association::establish() {
  state_ = State::established;
  peerCookie_ = {};
  restartRepeat();
  sent_.setWindow(peer_->window);
  received_.emplace(peer_->firstTsn);
  resets_.emplace(options_.firstTsn, peer_->firstTsn);
}

void Association::abortFor(Cause cause, std::span<const std::byte> content, std::string_view reason) {
  if (peer_) {
    const std::size_t bytes = 4 + content.size();
    writeCause(append(ChunkType::abort, 0, bytes), cause, content);
  }
  end(State::ended, reason);
  flush();
}

void Association::end(State state, std::string_view reason) {
  state_ = state;
  endReason_ = reason;
}

Init Association::ownInit() const {
  return {.tag = options_.tag,
          .window = kWindowBytes,
          .outgoingStreams = kStreams,
          .incomingStreams = kStreams,
          .tsn = options_.firstTsn,
          .forwardTsn = true,
          .reconfig = true,
          .zeroChecksum = true};
}

Association::Cookie Association::ownCookie() const {
  Cookie cookie;
  write32(cookie, 0, options_.tag);
  write32(cookie, 4, peer_->tag);
  return cookie;
}

std::span<std::byte> Association::append(ChunkType type, std::uint8_t flags, std::size_t valueBytes) {
  if (!out_.fits(valueBytes)) flush();
  if (out_.empty()) out_.start(peer_->tag);
  return out_.add(type, flags, valueBytes);
}

void Association::appendData(const Data& data) {
  writeData(append(ChunkType::data, dataFlags(data), dataBytes(data)), data);
}

void Association::appendSack() {
  ReceivedTsns::GapBlocks blocks;
  const std::span<const GapBlock> gaps = received_->gapBlocks(blocks);
  writeSack(append(ChunkType::sack, 0, sackBytes(gaps)), received_->cumulative(), kWindowBytes, gaps);
  unacknowledgedPackets_ = 0;
  sackNow_ = false;
  sackAt_ = kNever;
}

void Association::appendRepeated() {
  if (state_ == State::cookieWait) {
    const Init init = ownInit();
    flush();
    out_.start(0);
    writeInit(append(ChunkType::init, 0, initBytes(init)), init);
  } else if (state_ == State::cookieEchoed) {
    std::ranges::copy(peerCookie_, append(ChunkType::cookieEcho, 0, peerCookie_.size()).begin());
  } else if (isConnected()) {
    for (const SentTsns::Kept& kept : sent_.kept()) {
      Data data = kept.data;
      data.payload = kept.payload;
      appendData(data);
    }
    if (resets_->isWaiting()) appendResetRequest();
  }
}

void Association::appendResetRequest() {
  resets_->writeRequest(append(ChunkType::reconfig, 0, StreamResets::kRequestBytes));
}

// A checksum is left out only when the handshake is complete (RFC 9653, section 5.2).
void Association::flush() {
  if (!out_.empty()) callbacks_.transmit(out_.finish(isConnected() && peer_->zeroChecksum));
}

bool Association::hasRepeated() const {
  switch (state_) {
    case State::cookieWait:
    case State::cookieEchoed:
      return true;
    case State::established:
      return !sent_.kept().empty() || resets_->isWaiting();
    default:
      return false;
  }
}

// The repeated chunks have arrived. Later ones begin with the shortest pause.
void Association::restartRepeat() {
  repeats_ = 0;
  repeatAt_ = kNever;
}

void Association::armRepeat(Time now) {
  if (!hasRepeated()) {
    restartRepeat();
  } else if (repeatAt_ == kNever) {
    repeatAt_ = now + kFirstRepeat;
  }
}

}  // namespace clothstream::sctp
