// SPDX-License-Identifier: MIT
// The client core handles the protocol. Frames are measured before the core receives them.
#include "clients/load/participant.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "clients/native/vertex_limit.h"

namespace clothstream::load {
namespace {

// Time for one orbit of the sphere around the middle of the cloth.
constexpr double kOrbitSeconds = 3;

std::uint64_t nowUs() {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch()).count());
}

std::span<const std::byte> bytesOf(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

cs_client* createCore(const ParticipantOptions& options) {
  const cs_client_options core{
      .role = static_cast<std::uint32_t>(options.moves ? CS_ROLE_PARTICIPANT : CS_ROLE_VIEWER),
      .scene = options.scene.c_str(),
      .client_name = "clothstream load",
      .display_name = options.name.c_str()};
  return cs_create(&core);
}

}  // namespace

void Figures::add(const Figures& other) {
  frames += other.frames;
  bytes += other.bytes;
  dropped += other.dropped;
  late += other.late;
  decodeErrors += other.decodeErrors;
  hashMismatches += other.hashMismatches;
  ages.insert(ages.end(), other.ages.begin(), other.ages.end());
  tickAges.insert(tickAges.end(), other.tickAges.begin(), other.tickAges.end());
  poses.add(other.poses);
  frameTimes.insert(frameTimes.end(), other.frameTimes.begin(), other.frameTimes.end());
}

Participant::Participant(Links& links, const ParticipantOptions& options)
    : options_(options), core_(createCore(options), &cs_destroy) {
  cs_set_token(core_.get(), options.token.c_str());
  cs_set_clock(core_.get(), &nowUs);
  limitVertices(core_.get(), options.maxVertices);
  if (timesPoses()) {
    cs_play_out_options playOut;
    cs_default_play_out(&playOut);
    cs_set_play_out(core_.get(), &playOut);
  }
  if (options.datagrams != nullptr) {
    datagrams_ = std::make_unique<DatagramSession>(*options.datagrams, [this] { datagramsArrived(); });
    datagrams_->connecting();
  }
  link_ = links.open(*this);
  {
    const std::lock_guard lock(mutex_);
    flush();
  }
  link_->read();
}

Participant::~Participant() {
  std::unique_ptr<DatagramSession> ending;
  {
    const std::lock_guard lock(mutex_);
    ending = std::move(datagrams_);
  }
  ending.reset();  // its thread may wait for the lock
  link_->drop();
}

bool Participant::joined() const {
  const std::lock_guard lock(mutex_);
  return cs_get_state(core_.get()) == CS_STATE_JOINED &&
         (!options_.requiresDatagrams || (datagrams_ && datagrams_->hasOpened()));
}

std::optional<cs_datagram_statistics> Participant::datagrams() const {
  const std::lock_guard lock(mutex_);
  return datagrams_ && datagrams_->hasOpened() ? std::optional(datagrams_->statistics()) : std::nullopt;
}

std::optional<Failure> Participant::ended() const {
  const std::lock_guard lock(mutex_);
  return ended_;
}

void Participant::leave() {
  {
    const std::lock_guard lock(mutex_);
    if (datagrams_) datagrams_->close();
  }
  link_->leave();
}

Figures Participant::take() {
  const std::lock_guard lock(mutex_);
  if (options_.decodes) {
    cs_statistics statistics;
    cs_get_statistics(core_.get(), nowUs(), &statistics);
    figures_.decodeErrors =
        statistics.decode_errors - std::exchange(decodeErrorsTaken_, statistics.decode_errors);
    figures_.hashMismatches =
        statistics.hash_mismatches - std::exchange(hashMismatchesTaken_, statistics.hash_mismatches);
  }
  return std::exchange(figures_, {});
}

std::optional<double> Participant::firstFrameSeconds() const {
  const std::lock_guard lock(mutex_);
  return firstFrameSeconds_;
}

std::optional<double> Participant::firstDatagramFrameSeconds() const {
  const std::lock_guard lock(mutex_);
  return firstDatagramFrameSeconds_;
}

void Participant::step(Clock::time_point now) {
  bool reads = false, fails = false;
  {
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    cs_update(core_.get(), nowUs());
    if (options_.moves && cs_get_state(core_.get()) == CS_STATE_JOINED) move(nowUs());
    if (readLater_ && now >= readsAgainAt_) {
      readLater_ = false;
      reads = true;
    }
    fails = proceed();
  }
  if (fails) link_->leave();
  if (reads) link_->read();
}

void Participant::datagramsArrived() {
  bool fails = false;
  {
    const std::lock_guard lock(mutex_);
    if (ended_ || !datagrams_) return;
    fails = proceed();
  }
  if (fails) link_->leave();
}

bool Participant::proceed() {
  if (datagrams_) {
    datagrams_->exchange();
    if (!firstDatagramFrameSeconds_ && datagrams_->statistics().frames > 0)
      firstDatagramFrameSeconds_ = secondsOpen();
    while (const auto message = datagrams_->nextMessage()) take(*message);
    if (options_.requiresDatagrams && datagrams_->isRefused() && !ended_) {
      ended_ = {Failure::Kind::refused, "datagrams are required, but " + datagrams_->why()};
      return true;
    }
  }
  const bool fails = !ended_ && cs_get_state(core_.get()) == CS_STATE_FAILED;
  if (fails) ended_ = refusal();
  flush();
  return fails;
}

void Participant::take(std::span<const std::byte> message) {
  const std::uint64_t now = nowUs();
  const bool isFrame =
      message_.ParseFromArray(message.data(), static_cast<int>(message.size())) && message_.has_frame();
  if (isFrame) frameReceived(message_.frame(), now);
  std::uint32_t events = 0;
  if (!isFrame || options_.decodes)
    events =
        cs_receive(core_.get(), reinterpret_cast<const std::uint8_t*>(message.data()), message.size(), now);
  if (isFrame && timesPoses() && (events & CS_EVENT_FRAME) != 0) frameDecoded(message_.frame());
}

void Participant::received(std::span<const std::byte> message) {
  bool fails = false;
  {
    const std::lock_guard lock(mutex_);
    if (!datagrams_ || !datagrams_->holds(message)) take(message);
    fails = proceed();
    if (options_.bytesPerSecond > 0) {
      const std::chrono::duration<double> time(static_cast<double>(message.size()) / options_.bytesPerSecond);
      readsAgainAt_ =
          std::max(readsAgainAt_, Clock::now()) + std::chrono::duration_cast<Clock::duration>(time);
      readLater_ = true;
      return;
    }
  }
  if (fails) link_->leave();
  link_->read();
}

Failure Participant::refusal() const {
  return {Failure::Kind::refused, cs_error_text(core_.get())};
}

void Participant::closed(const std::string& why) {
  const std::lock_guard lock(mutex_);
  const cs_state state = cs_get_state(core_.get());
  if (state == CS_STATE_FAILED)
    ended_ = refusal();
  else
    ended_ = {state == CS_STATE_JOINED ? Failure::Kind::lost : Failure::Kind::unreachable, why};
}

void Participant::frameReceived(const v1::Frame& frame, std::uint64_t nowUs) {
  const auto packet = codec::parsePacket(bytesOf(frame.packet()));
  if (!packet) {
    if (!options_.decodes) ++figures_.decodeErrors;
    return;
  }
  count(packet->header, std::max(frame.frame_divisor(), 1u));
  figures_.bytes += frame.packet().size();
  cs_statistics statistics;
  cs_get_statistics(core_.get(), nowUs, &statistics);
  if (statistics.clock_offset_us != 0) {
    const double serverUs = static_cast<double>(nowUs) + statistics.clock_offset_us;
    const auto age = [&](std::uint64_t sinceUs) {
      return static_cast<float>((serverUs - static_cast<double>(sinceUs)) / 1000);
    };
    figures_.ages.push_back(age(frame.packet_time_us()));
    figures_.tickAges.push_back(age(frame.tick_time_us()));
    if (options_.keepsFrames)
      figures_.frameTimes.push_back({.participant = 0,
                                     .tick = packet->header.tick,
                                     .arrived = Clock::now(),
                                     .age = figures_.tickAges.back(),
                                     .displayableAge = {}});
  }
  if (options_.decodes || !acknowledgement_.due(nowUs)) return;
  v1::ClientMessage acknowledgement;
  acknowledgement.mutable_frame_ack()->set_tick(packet->header.tick);
  send(acknowledgement.SerializeAsString());
}

void Participant::frameDecoded(const v1::Frame& frame) {
  const std::uint64_t decodedUs = nowUs();
  const std::uint64_t beforeUs = std::exchange(decodedTickUs_, frame.tick_time_us());
  cs_play_out(core_.get(), decodedUs, decodedUs, nullptr);
  cs_stage_statistics stages{};
  cs_get_stage_statistics(core_.get(), &stages);
  cs_statistics statistics;
  cs_get_statistics(core_.get(), decodedUs, &statistics);
  const auto own = [&](std::uint64_t serverUs) {
    return static_cast<double>(serverUs) - statistics.clock_offset_us;
  };
  const auto decoded = static_cast<double>(decodedUs);
  // The frame becomes visible when play-out passes the frame before it.
  const FrameTimes times{.tick = own(frame.tick_time_us()),
                         .packet = own(frame.packet_time_us()),
                         .decoded = decoded,
                         .displayable = std::max(decoded, own(beforeUs) + 1000 * stages.delay_ms)};
  // The time of this frame is missing while the offset of the clocks is unknown.
  const bool isKept = !figures_.frameTimes.empty() && figures_.frameTimes.back().tick == statistics.tick;
  if (isKept && beforeUs != 0)
    figures_.frameTimes.back().displayableAge = static_cast<float>((times.displayable - times.tick) / 1000);
  PoseTimes notMeasured;
  PoseTimes& out = statistics.clock_offset_us != 0 && beforeUs != 0 ? figures_.poses : notMeasured;
  const std::uint64_t me = cs_participant_id(core_.get());
  for (const v1::ColliderState& collider : frame.colliders())
    if (collider.participant_id() == me) poseTiming_.shown(collider.sphere().radius(), times, out);
}

void Participant::count(const codec::PacketHeader& header, std::uint32_t frameDivisor) {
  const Clock::time_point now = Clock::now();
  const std::uint32_t rate = std::max(cs_simulation_rate(core_.get()), 1u);
  const std::uint64_t perFrame =
      std::uint64_t{std::max(rate / std::max(cs_stream_rate(core_.get()), 1u), 1u)} *
      std::max(frameDivisor_, frameDivisor);
  frameDivisor_ = frameDivisor;
  const std::chrono::duration<double> period(static_cast<double>(perFrame) / rate);
  if (!newestTick_)
    firstFrameSeconds_ = secondsOpen();
  else if (now - newestAt_ > 2 * period)
    ++figures_.late;
  newestAt_ = now;
  if (newestTick_ && header.tick > *newestTick_)
    figures_.dropped += std::max<std::uint64_t>((header.tick - *newestTick_) / perFrame, 1) - 1;
  if (!options_.decodes && header.referenceCount > 0 && header.references[0] != newestTick_)
    ++figures_.decodeErrors;
  newestTick_ = header.tick;
  ++figures_.frames;
}

void Participant::move(std::uint64_t nowUs) {
  const float* const at = cs_positions(core_.get());
  const std::uint32_t count = cs_vertex_count(core_.get());
  if (count == 0) return;
  const float* const middle = at + 3 * std::size_t{count / 2};
  const double turns = options_.phase + static_cast<double>(nowUs) / (1e6 * kOrbitSeconds);
  const double turn = 2 * std::numbers::pi * turns;
  cs_own_collider sphere{};
  sphere.position[0] = middle[0] + 0.5f * static_cast<float>(std::cos(turn));
  sphere.position[1] = middle[1];
  sphere.position[2] = middle[2] + 0.5f * static_cast<float>(std::sin(turn));
  sphere.radius = poseTiming_.nextRadius(nowUs);
  cs_set_colliders(core_.get(), &sphere, 1, nowUs);
}

void Participant::send(std::string message) {
  if (!datagrams_ || !datagrams_->sends(bytesOf(message))) link_->send(std::move(message));
}

void Participant::flush() {
  if (datagrams_) datagrams_->negotiate(*core_, [] { return std::string(); });  // not known
  std::size_t bytes = 0;
  while (const std::uint8_t* message = cs_next_outgoing(core_.get(), &bytes))
    send(std::string(reinterpret_cast<const char*>(message), bytes));
  if (!datagrams_) return;
  datagrams_->exchange();
  while (const auto message = datagrams_->nextStreamMessage())
    link_->send(std::string(reinterpret_cast<const char*>(message->data()), message->size()));
}

}  // namespace clothstream::load
