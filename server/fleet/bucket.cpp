// SPDX-License-Identifier: MIT
#include "server/fleet/bucket.h"

#include <memory>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <nats/nats.h>

namespace clothstream::fleet {
namespace {

constexpr std::int64_t kWait = 2000;  // milliseconds
constexpr std::int64_t kNanoseconds = 1'000'000'000;
constexpr int kCopies = 3;  // of a bucket, on servers of a cluster

using OwnEntry = std::unique_ptr<kvEntry, decltype(&kvEntry_Destroy)>;

[[noreturn]] void fail(natsStatus status, const std::string& bucket) {
  throw std::runtime_error(fmt::format("NATS' key-value store {}: {}", bucket, natsStatus_GetText(status)));
}

Bucket::Entry toEntry(kvEntry* entry) {
  Bucket::Entry read{.key = kvEntry_Key(entry),
                     .value = {},
                     .revision = kvEntry_Revision(entry),
                     .deleted = kvEntry_Operation(entry) != kvOp_Put};
  if (!read.deleted)
    read.value.assign(static_cast<const char*>(kvEntry_Value(entry)),
                      static_cast<std::size_t>(kvEntry_ValueLen(entry)));
  return read;
}

jsCtx* contextOf(void* handle) {
  return static_cast<jsCtx*>(handle);
}
kvStore* storeOf(void* handle) {
  return static_cast<kvStore*>(handle);
}
kvWatcher* watcherOf(void* handle) {
  return static_cast<kvWatcher*>(handle);
}

}  // namespace

Bucket::Bucket(Nats& nats, const BucketOptions& options) : name_(options.name) {
  jsOptions settings;
  jsOptions_Init(&settings);
  settings.Wait = kWait;
  jsCtx* context = nullptr;
  if (const natsStatus status =
          natsConnection_JetStream(&context, static_cast<natsConnection*>(nats.connection_), &settings);
      status != NATS_OK)
    fail(status, name_);
  context_ = context;
  kvStore* store = nullptr;
  natsStatus status = js_KeyValue(&store, context, name_.c_str());
  if (status == NATS_NOT_FOUND) {
    kvConfig config;
    kvConfig_Init(&config);
    config.Bucket = name_.c_str();
    config.History = 1;
    config.TTL = options.lifetime.count() * kNanoseconds;
    config.Replicas = kCopies;
    status = js_CreateKeyValue(&store, context, &config);
    // A NATS server that is alone keeps one copy. The library tells this apart only in its text.
    const char* const why = nats_GetLastError(nullptr);
    if (status != NATS_OK && why != nullptr &&
        std::string_view(why).find("non-clustered") != std::string_view::npos) {
      config.Replicas = 1;
      status = js_CreateKeyValue(&store, context, &config);
    }
  }
  if (status != NATS_OK) {
    jsCtx_Destroy(context);
    fail(status, name_);
  }
  store_ = store;
}

Bucket::~Bucket() {
  kvWatcher_Destroy(watcherOf(watcher_));
  kvStore_Destroy(storeOf(store_));
  jsCtx_Destroy(contextOf(context_));
}

std::optional<Bucket::Entry> Bucket::get(const std::string& key) {
  kvEntry* entry = nullptr;
  const natsStatus status = kvStore_Get(&entry, storeOf(store_), key.c_str());
  if (status == NATS_NOT_FOUND) return std::nullopt;
  if (status != NATS_OK) fail(status, name_);
  const OwnEntry own(entry, &kvEntry_Destroy);
  return toEntry(entry);
}

std::uint64_t Bucket::put(const std::string& key, const std::string& value) {
  std::uint64_t revision = 0;
  const natsStatus status =
      kvStore_Put(&revision, storeOf(store_), key.c_str(), value.data(), static_cast<int>(value.size()));
  if (status != NATS_OK) fail(status, name_);
  return revision;
}

std::optional<std::uint64_t> Bucket::written(int status, std::uint64_t revision, const std::string& key,
                                             const std::string& value) {
  if (status == NATS_OK) return revision;
  // The library does not tell a refusal from other errors, and only the answer to a write may be lost.
  const std::optional<Entry> present = get(key);
  if (present && !present->deleted && present->value == value) return present->revision;
  if (present || status == NATS_ERR) return std::nullopt;
  fail(static_cast<natsStatus>(status), name_);
}

std::optional<std::uint64_t> Bucket::create(const std::string& key, const std::string& value) {
  std::uint64_t revision = 0;
  const natsStatus status =
      kvStore_Create(&revision, storeOf(store_), key.c_str(), value.data(), static_cast<int>(value.size()));
  return written(status, revision, key, value);
}

std::optional<std::uint64_t> Bucket::update(const std::string& key, const std::string& value,
                                            std::uint64_t revision) {
  std::uint64_t now = 0;
  const natsStatus status = kvStore_Update(&now, storeOf(store_), key.c_str(), value.data(),
                                           static_cast<int>(value.size()), revision);
  return written(status, now, key, value);
}

void Bucket::remove(const std::string& key) {
  if (const natsStatus status = kvStore_Delete(storeOf(store_), key.c_str()); status != NATS_OK)
    fail(status, name_);
}

void Bucket::purge(const std::string& key) {
  if (const natsStatus status = kvStore_Purge(storeOf(store_), key.c_str(), nullptr); status != NATS_OK)
    fail(status, name_);
}

std::optional<Bucket::Entry> Bucket::next(std::chrono::milliseconds time) {
  if (watcher_ == nullptr) {
    kvWatcher* watcher = nullptr;
    if (const natsStatus status = kvStore_WatchAll(&watcher, storeOf(store_), nullptr); status != NATS_OK)
      fail(status, name_);
    watcher_ = watcher;
  }
  kvEntry* entry = nullptr;
  const natsStatus status = kvWatcher_Next(&entry, watcherOf(watcher_), time.count());
  if (status == NATS_TIMEOUT) return std::nullopt;
  if (status != NATS_OK) fail(status, name_);
  if (entry == nullptr) return Entry{};
  const OwnEntry own(entry, &kvEntry_Destroy);
  return toEntry(entry);
}

}  // namespace clothstream::fleet
