// SPDX-License-Identifier: MIT
#include "server/fleet/origin.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <future>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/fleet.pb.h"
#include "server/fleet/conversation.h"
#include "server/fleet/message_bytes.h"
#include "server/fleet/random_id.h"
#include "server/fleet/subjects.h"
#include "server/hosting/scene_server.h"
#include "server/saved_state/contents.h"
#include "server/scene/live_scene.h"
#include "server/schedule/clock.h"
#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::fleet {
namespace {

using namespace std::chrono_literals;

constexpr auto kOfferPeriod = 1s;
// Another server answers within this time, loads a scene within this one, and continues it within this one.
constexpr auto kAnswerTime = 5s;
constexpr auto kLoadTime = 120s;
constexpr auto kStartTime = 10s;
// Edges learn about a prepared scene within this time.
constexpr auto kEdgeTime = 150ms;
// Clients of this server have this time to connect to the other one before the scene stops here.
constexpr auto kConnectTime = 300ms;
// Interval of looks whether the other server is still there.
constexpr auto kLook = 200ms;
// Interval of attempts to learn which of two servers has a scene.
constexpr auto kDecidePeriod = 500ms;
constexpr auto kFlushTime = 2s;

v1::ServerEntry entryOf(std::uint64_t id, const OriginOptions& options, const std::string& name) {
  v1::ServerEntry entry;
  entry.set_origin(id);
  entry.set_server_name(name);
  entry.set_version(options.version);
  entry.set_public_name(options.publicName);
  return entry;
}

v1::MoveResponse refused(std::string why) {
  v1::MoveResponse response;
  response.set_error(std::move(why));
  return response;
}

// Tells the other server that the move ends.
void refuseTo(Conversation& talk, const std::string& why) {
  v1::MoveMessage message;
  message.set_refused(why);
  talk.send(message);
  talk.flush(kFlushTime);
}

}  // namespace

// Does one task at a time, on a thread of its own.
class Origin::Worker {
 public:
  static constexpr std::size_t kMaxWaiting = 64;

  Worker() : thread_([this] { run(); }) {}
  // Drops the tasks that wait.
  ~Worker() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  // Returns false if too many wait.
  bool post(std::function<void()> task) {
    {
      const std::lock_guard lock(mutex_);
      if (stopping_ || tasks_.size() >= kMaxWaiting) return false;
      tasks_.push_back(std::move(task));
    }
    changed_.notify_all();
    return true;
  }

 private:
  void run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return stopping_ || !tasks_.empty(); });
      if (stopping_) return;
      const std::function<void()> task = std::move(tasks_.front());
      tasks_.pop_front();
      lock.unlock();
      try {
        task();
      } catch (const std::exception& failure) {
        spdlog::error("moving a scene failed: {}", failure.what());
      }
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false;
  std::thread thread_;
};

Origin::Origin(hosting::SceneServer& server, const NatsOptions& nats, OriginOptions options)
    : server_(server),
      id_(randomId()),
      options_(std::move(options)),
      nats_(nats, server.metrics.nats),
      tunnels_(server, nats_),
      departures_(std::make_unique<Worker>()),
      arrivals_(std::make_unique<Worker>()),
      directory_(
          std::make_unique<Directory>(nats_, server, entryOf(id_, options_, server.options.serverName),
                                      [this](v1::SavedParts parts, const std::function<bool()>& claim) {
                                        return adopt(std::move(parts), claim);
                                      })),
      requests_(nats_.subscribe(serverSubject(id_), [this](const auto&, const std::string& reply,
                                                           auto data) { hear(data, reply); })),
      thread_([this] { run(); }) {
  server_.scenes.setOtherServers(
      [this](const std::string& scene) { return directory_->publicNameOf(scene); });
}

void Origin::simulateLoss() {
  directory_->simulateLoss();
  endOffers();
  const std::lock_guard lock(mutex_);
  streams_.clear();
}

void Origin::endOffers() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

Origin::~Origin() {
  tunnels_.deliverEnds();
  server_.scenes.setOtherServers(nullptr);
  requests_.reset();
  endOffers();
  departures_.reset();
  arrivals_.reset();
  directory_->end();
  streams_.clear();
  prepared_.clear();
  offer();
}

void Origin::run() {
  telemetry::nameThread("origin");
  std::unique_lock lock(mutex_);
  while (!stopping_.load()) {
    lock.unlock();
    try {
      lookForScenes();
      offer();
    } catch (const std::exception& failure) {  // such as a subscription that fails
      spdlog::error("offering scenes to edges failed: {}; trying again", failure.what());
    }
    lock.lock();
    changed_.wait_for(lock, kOfferPeriod, [this] { return stopping_.load(); });
  }
}

void Origin::lookForScenes() {
  // An older list must not replace a newer one: the directory gives up what is not in it.
  const std::lock_guard looking(looking_);
  const auto scenes = server_.scenes.all();
  std::vector<SharedStream> ended;
  std::vector<Directory::OwnScene> own;
  std::vector<std::shared_ptr<scene::LiveScene>> old;
  {
    const std::lock_guard lock(mutex_);
    for (auto known = streams_.begin(); known != streams_.end();) {
      if (std::ranges::find(scenes, known->second->scene()) != scenes.end() && !known->second->isOver()) {
        ++known;
        continue;
      }
      ended.push_back(std::move(known->second));
      known = streams_.erase(known);
    }
    for (const auto& scene : scenes) {
      const bool isTaken = directory_->isTaken(scene->name());
      if (isTaken && scene->terms.created && directory_->isRunElsewhere(scene->name())) old.push_back(scene);
      const bool isOffered =
          !scene->terms.sharesAsGuest && !scene->shape().lockstep && scene->quarantined().empty() && !isTaken;
      const auto known = streams_.find(scene->name());
      if (!isOffered && known != streams_.end()) {
        ended.push_back(std::move(known->second));
        streams_.erase(known);
      } else if (isOffered && known == streams_.end() && !prepared_.contains(scene->name())) {
        streams_.emplace(scene->name(), std::make_shared<OriginStream>(server_, nats_, tunnels_, scene));
      }
    }
    for (const auto& [name, stream] : streams_) own.push_back({stream->scene(), stream->id()});
  }
  directory_->setScenes(std::move(own));
  ended.clear();
  // Another server has continued it while this one was away.
  for (const auto& scene : old) {
    telemetry::log({scene->name()}, spdlog::level::warn,
                   "removed here, because another server continues it since this one was gone");
    remove(scene, directory_->publicNameOf(scene->name()).value_or(""));
  }
}

void Origin::remove(const std::shared_ptr<scene::LiveScene>& scene, const std::string& server) {
  // The scene goes on, so nobody has left it.
  scene->roster.endObservation(false);
  const std::string where = server.empty() ? "another server" : server;
  server_.created.remove(
      scene,
      delivery::error(v1::ERROR_CODE_CUT_OFF,
                      fmt::format("the scene has moved to {}: join again there", where), true, 0, server));
}

void Origin::offer() {
  v1::Offer offer;
  offer.set_origin(id_);
  offer.set_server_name(server_.options.serverName);
  {
    const std::lock_guard lock(mutex_);
    for (const auto* streams : {&streams_, &prepared_})
      for (const auto& [name, stream] : *streams) *offer.add_scenes() = stream->offer();
  }
  nats_.publish(kOffers, toBytes(offer));
}

Origin::SharedStream Origin::streamOf(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = streams_.find(name);
  return found == streams_.end() ? nullptr : found->second;
}

void Origin::hear(std::span<const std::byte> request, const std::string& reply) {
  v1::MoveRequest move;
  if (!parse(request, move)) return server_.metrics.nats.refused.add();
  const bool queued = move.move() != 0 ? arrivals_->post([this, id = move.move()] { receiveScene(id); })
                                       : departures_->post([this, move, reply] {
                                           const v1::MoveResponse response =
                                               moveNow(move.scene(), move.to(), Clock::now() + kLoadTime);
                                           if (!reply.empty()) nats_.publish(reply, toBytes(response));
                                         });
  if (!queued && move.move() == 0 && !reply.empty())
    nats_.publish(reply, toBytes(refused("too many scenes wait to be moved; try again later")));
}

v1::MoveResponse Origin::move(const std::string& scene, std::uint64_t to) {
  return moveBy(Clock::now() + kLoadTime, scene, to);
}

v1::MoveResponse Origin::moveBy(Clock::time_point until, const std::string& scene, std::uint64_t to) {
  auto result = std::make_shared<std::promise<v1::MoveResponse>>();
  std::future<v1::MoveResponse> moved = result->get_future();
  if (!departures_->post([this, scene, to, until, result] { result->set_value(moveNow(scene, to, until)); }))
    return refused("too many scenes wait to be moved; try again later");
  if (moved.wait_until(until) != std::future_status::ready) return refused("there was no time");
  try {
    return moved.get();
  } catch (const std::future_error&) {
    return refused("the server stops");
  }
}

std::size_t Origin::moveAll(Clock::time_point until) {
  directory_->setStopping();
  waitsUntil_ = until;
  lookForScenes();  // some may have been deleted
  std::vector<std::string> names;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [name, stream] : streams_)
      if (stream->scene()->terms.created) names.push_back(name);
  }
  std::size_t stay = 0;
  for (const std::string& name : names) {
    const v1::MoveResponse moved =
        Clock::now() < until ? moveBy(until, name, 0) : refused("there was no time");
    if (moved.error().empty()) continue;
    ++stay;
    telemetry::log({name}, spdlog::level::warn, "not moved to another server: {}", moved.error());
  }
  return stay;
}

std::uint64_t Origin::target(const scene::LiveScene& scene) const {
  const double price = scene.price();
  std::uint64_t best = 0;
  double mostRoom = 0;
  for (const v1::ServerEntry& server : directory_->others()) {
    const double room = server.max_load() - server.load() - price;
    const bool fits = !server.stopping() && server.version() >= options_.version && room >= 0 &&
                      server.created_scenes() < server.max_created_scenes();
    if (!fits || (best != 0 && room <= mostRoom)) continue;
    best = server.origin();
    mostRoom = room;
  }
  return best;
}

std::optional<v1::MoveMessage> Origin::receive(Conversation& talk, std::uint64_t other,
                                               Clock::time_point until) {
  for (;;) {
    if (auto message = talk.receive(kLook)) return message;
    if (stopping_ || Clock::now() >= std::min(until, waitsUntil_.load()) || !directory_->isThere(other))
      return std::nullopt;
  }
}

v1::MoveResponse Origin::moveNow(const std::string& name, std::uint64_t to, Clock::time_point until) {
  try {
    return tryMove(name, to, until);
  } catch (const std::exception& failure) {
    telemetry::log({name}, spdlog::level::err, "moving it failed: {}", failure.what());
    return refused(fmt::format("moving it failed on this server: {}", failure.what()));
  }
}

v1::MoveResponse Origin::tryMove(const std::string& name, std::uint64_t to, Clock::time_point until) {
  const SharedStream stream = streamOf(name);
  if (!stream) return refused(fmt::format("this server has no scene '{:.64}' that edges see", name));
  const std::shared_ptr<scene::LiveScene>& scene = stream->scene();
  if (!scene->terms.created) return refused("the server started with this scene; only created ones move");
  if (to == 0) to = target(*scene);
  if (to == 0) return refused("no other server has room for it");
  if (to == id_) return refused("this server has it already");
  const auto others = directory_->others();
  const auto known = std::ranges::find(others, to, &v1::ServerEntry::origin);
  if (known == others.end()) return refused("there is no such server in the directory");
  if (known->version() < options_.version)
    return refused(
        fmt::format("{} is older than this server, and scenes move only to the same or a later "
                    "version",
                    known->server_name()));

  const std::uint64_t move = randomId();
  Conversation talk(nats_, moveUpSubject(move), moveDownSubject(move), stopping_);
  try {
    return moveTo(talk, move, *known, stream, until);
  } catch (const std::exception& failure) {
    refuseTo(talk, failure.what());  // it may wait for the state
    throw;
  }
}

v1::MoveResponse Origin::moveTo(Conversation& talk, std::uint64_t move, const v1::ServerEntry& other,
                                const SharedStream& stream, Clock::time_point until) {
  const std::shared_ptr<scene::LiveScene>& scene = stream->scene();
  const std::string& name = scene->name();
  const std::uint64_t to = other.origin();
  v1::MoveRequest request;
  request.set_scene(name);
  request.set_move(move);
  nats_.publish(serverSubject(to), toBytes(request));
  v1::MoveMessage message;
  *message.mutable_prepare()->mutable_scene() = saved_state::definitionOf(*scene);
  message.mutable_prepare()->set_stream(stream->id());
  message.mutable_prepare()->set_origin(id_);
  talk.send(message);
  const auto prepared = receive(talk, to, until);
  if (!prepared) {
    refuseTo(talk, "there was no time");
    return refused("the other server does not answer");
  }
  if (!prepared->has_prepared())
    return refused(fmt::format("the other server says: {}", prepared->refused()));
  if (!other.public_name().empty() &&
      scene->subscribers.announceHere(delivery::moving(other.public_name())) > 0)
    std::this_thread::sleep_for(kConnectTime);

  Clock::time_point stopped{};
  const struct EndMove {
    Directory& directory;
    const std::string& name;
    ~EndMove() { directory.endMove(name); }
  } end{*directory_, name};
  if (const std::string why = handOver(talk, *stream, to, stopped); !why.empty()) {
    refuseTo(talk, why);  // it may wait for the state
    return refused(why);
  }
  v1::MoveResponse response;
  response.set_to(to);
  response.set_gap(schedule::seconds(Clock::now() - stopped));
  // Clients of this server must join at the other one. Those at edges follow by themselves, so their tunnels
  // end first.
  tunnels_.end(stream->subject());
  remove(scene, other.public_name());
  dropStream(stream);
  telemetry::log({name}, spdlog::level::info, "moved to another server at tick {}", scene->tick.load());
  return response;
}

std::string Origin::handOver(Conversation& talk, const OriginStream& stream, std::uint64_t to,
                             Clock::time_point& stopped) {
  const std::shared_ptr<scene::LiveScene>& scene = stream.scene();
  const std::string& name = scene->name();
  const std::optional<std::uint64_t> revision = directory_->beginMove(name);
  if (!revision) return "it is not in the directory of the fleet (nats-server needs --jetstream)";
  const auto stay = [&](std::string why) {
    tunnels_.thaw(stream.subject());
    server_.device.unhold(scene);
    return why;
  };
  v1::MoveMessage message;
  try {
    // Inputs that were used before are in the state, and later ones go to the other server.
    const std::vector<v1::MovedTunnel> tunnels = tunnels_.freeze(stream.subject());
    const std::optional<scene::Checkpoint> state = server_.device.hold(scene).get();
    stopped = Clock::now();
    *message.mutable_state()->mutable_scene() = saved_state::stateOf(*scene, state);
    message.mutable_state()->set_revision(*revision);
    for (const v1::MovedTunnel& tunnel : tunnels) *message.mutable_state()->add_tunnels() = tunnel;
  } catch (const std::exception& failure) {
    return stay(fmt::format("its state cannot be read: {}", failure.what()));
  }
  std::string why;
  try {
    talk.send(message);
    const auto answer = receive(talk, to, Clock::now() + kStartTime);
    if (answer && answer->has_done()) return {};
    why = answer ? fmt::format("the other server says: {}", answer->refused())
                 : "the other server does not answer";
  } catch (const std::exception& failure) {
    why = fmt::format("its state cannot be sent: {}", failure.what());
  }
  // The directory decides which of the two has the scene.
  for (;;) {
    try {
      v1::SceneEntry entry;
      entry.set_origin(id_);
      entry.set_stream(stream.id());
      entry.set_created(true);
      *entry.mutable_checkpoint() = directory_->checkpointOf(name);
      if (directory_->transfer(name, entry, *revision)) return stay(why);
      const auto owner = directory_->ownerOf(name);
      return owner == to ? std::string() : stay(why);
    } catch (const std::exception& failure) {
      telemetry::log({name}, spdlog::level::warn,
                     "stands still until NATS says which server has it after a move: {}", failure.what());
    }
    if (stopping_) return stay(why);
    std::this_thread::sleep_for(kDecidePeriod);
  }
}

bool Origin::takes(const v1::SceneEntry& entry, const std::string& name, std::uint64_t revision) {
  for (;;) {
    try {
      // A write whose answer was lost is not repeated, because its revision has changed.
      return directory_->transfer(name, entry, revision) || directory_->ownerOf(name) == id_;
    } catch (const std::exception& failure) {
      telemetry::log({name}, spdlog::level::warn,
                     "waits until NATS says which server has it after a move: {}", failure.what());
    }
    if (stopping_) return false;
    std::this_thread::sleep_for(kDecidePeriod);
  }
}

void Origin::receiveScene(std::uint64_t move) {
  Conversation talk(nats_, moveDownSubject(move), moveUpSubject(move), stopping_);
  const auto refuse = [&](const std::string& why) { refuseTo(talk, why); };
  auto asked = talk.receive(kAnswerTime);
  if (!asked || !asked->has_prepare()) return;
  constexpr const char* kStops = "it stops";
  if (directory_->isStopping()) return refuse(kStops);
  auto saved = saved_state::toSaved(std::move(*asked->mutable_prepare()->mutable_scene()));
  if (!saved) return refuse(saved.error());
  const std::string name = saved->start.name;
  auto arriving = server_.created.prepareArrival(std::move(*saved));
  if (!arriving) return refuse(arriving.error());
  const std::shared_ptr<scene::LiveScene> scene = arriving->scene();
  SharedStream stream;
  const auto giveUp = [&](const std::string& why) {
    if (stream) dropStream(stream);
    arriving->abandon();
    directory_->expectNoMore(name);
    refuse(why);
  };
  bool isOurs = false;
  try {
    stream = prepareStream(scene, asked->prepare().stream());
    offer();
    std::this_thread::sleep_for(kEdgeTime);
    v1::MoveMessage message;
    message.mutable_prepared()->set_stream(stream->id());
    talk.send(message);

    auto state = receive(talk, asked->prepare().origin(), Clock::now() + kLoadTime);
    if (!state || !state->has_state()) return giveUp("no state came");
    if (directory_->isStopping()) return giveUp(kStops);
    auto continued =
        saved_state::toSaved(std::move(*state->mutable_state()->mutable_scene()), scene->start());
    if (!continued) return giveUp(continued.error());
    tunnels_.expect(stream->subject(), {state->state().tunnels().begin(), state->state().tunnels().end()});
    v1::SceneEntry entry;
    entry.set_origin(id_);
    entry.set_stream(stream->id());
    entry.set_created(true);
    *entry.mutable_checkpoint() = directory_->checkpointOf(name);
    directory_->expect(name);
    if (!takes(entry, name, state->state().revision()))
      return giveUp("the directory has another server for it");
    isOurs = true;
    try {
      arriving->start(std::move(*continued));
    } catch (const std::exception& failure) {
      entry.set_origin(asked->prepare().origin());
      entry.set_stream(asked->prepare().stream());
      try {
        if (directory_->ownerOf(name) == id_) directory_->give(name, entry);
      } catch (const std::exception& again) {
        spdlog::error("{}: {}", name, again.what());
      }
      return giveUp(failure.what());
    }
    runStream(stream);
    message.Clear();
    message.mutable_done();
    talk.send(message);
    talk.flush(kFlushTime);
  } catch (const std::exception& failure) {
    if (isOurs) throw;
    giveUp(failure.what());
  }
}

Origin::SharedStream Origin::prepareStream(const std::shared_ptr<scene::LiveScene>& scene,
                                           std::uint64_t continues) {
  auto stream = std::make_shared<OriginStream>(server_, nats_, tunnels_, scene, continues);
  const std::lock_guard lock(mutex_);
  prepared_[scene->name()] = stream;
  return stream;
}

void Origin::runStream(const SharedStream& stream) {
  stream->run();
  {
    const std::lock_guard lock(mutex_);
    prepared_.erase(stream->scene()->name());
    streams_[stream->scene()->name()] = stream;
  }
  offer();
  server_.device.wake(*stream->scene());
  lookForScenes();
}

void Origin::dropStream(const SharedStream& stream) {
  {
    const std::lock_guard lock(mutex_);
    for (auto* streams : {&streams_, &prepared_})
      std::erase_if(*streams, [&](const auto& known) { return known.second == stream; });
  }
  tunnels_.end(stream->subject());
  offer();
}

std::string Origin::adopt(v1::SavedParts parts, const std::function<bool()>& claim) {
  auto saved = saved_state::toSaved(std::move(parts));
  if (!saved) return saved.error();
  auto arriving = server_.created.prepareArrival(*saved);
  if (!arriving) return arriving.error();
  try {
    if (stopping_) throw std::runtime_error("this server stops");
    if (!claim()) throw std::runtime_error("another server was faster");
    arriving->start(std::move(*saved));
  } catch (const std::exception& failure) {
    arriving->abandon();
    return failure.what();
  }
  lookForScenes();
  offer();
  return {};
}

}  // namespace clothstream::fleet
