// SPDX-License-Identifier: MIT
// Bucket of NATS' key-value store (JetStream), which servers share.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "server/fleet/nats.h"

namespace clothstream::fleet {

struct BucketOptions {
  std::string name;
  // An entry that is not written for this long is deleted. 0: never.
  std::chrono::seconds lifetime{0};
};

// Belongs to one thread. Each function waits for NATS, for a few seconds at most, and throws
// std::runtime_error if it does not answer.
class Bucket {
 public:
  struct Entry {
    std::string key, value;
    std::uint64_t revision = 0;
    bool deleted = false;
  };

  // Creates the bucket if it does not exist.
  Bucket(Nats& nats, const BucketOptions& options);
  ~Bucket();
  Bucket(const Bucket&) = delete;
  Bucket& operator=(const Bucket&) = delete;

  std::optional<Entry> get(const std::string& key);
  // Returns the revision.
  std::uint64_t put(const std::string& key, const std::string& value);
  // Writes a key that does not exist, or whose newest revision is this one; else returns nothing.
  std::optional<std::uint64_t> create(const std::string& key, const std::string& value);
  std::optional<std::uint64_t> update(const std::string& key, const std::string& value,
                                      std::uint64_t revision);
  void remove(const std::string& key);
  // Deletes the value, too, not only the present one.
  void purge(const std::string& key);

  // Next change; first all present entries, then one without a key. Nothing if there is none in this time.
  std::optional<Entry> next(std::chrono::milliseconds time);

 private:
  std::optional<std::uint64_t> written(int status, std::uint64_t revision, const std::string& key,
                                       const std::string& value);

  const std::string name_;
  void* context_ = nullptr;
  void* store_ = nullptr;
  void* watcher_ = nullptr;
};

}  // namespace clothstream::fleet
