// SPDX-License-Identifier: MIT
// Scenes of a load test against a server of a few lines, which answers at once.
#include "clients/load/created_scenes.h"

#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "clients/load/hung_scene.h"

namespace clothstream::load {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Has room for a number of scenes, and can refuse deletions or vanish.
class FakeServer final : public Links {
 public:
  explicit FakeServer(std::size_t room) : room_(room) {}

  std::unique_ptr<Link> open(LinkListener& listener) override {
    return std::make_unique<FakeLink>(*this, listener);
  }

  bool refusesDeletions = false, isGone = false;
  std::set<std::string> scenes;
  std::vector<std::string> tokens;

 private:
  class FakeLink final : public Link {
   public:
    FakeLink(FakeServer& server, LinkListener& listener) : server_(server), listener_(listener) {}

    void send(std::string message) override {
      v1::ClientMessage request;
      ASSERT_TRUE(request.ParseFromString(message));
      if (request.has_authenticate())
        server_.tokens.push_back(request.authenticate().token());
      else
        answer_ = server_.answerTo(request);
    }
    void read() override {
      if (server_.isGone) return listener_.closed("the server is gone");
      if (answer_.empty()) return;
      const std::string answer = std::exchange(answer_, {});
      listener_.received(std::as_bytes(std::span(answer.data(), answer.size())));
    }
    void leave() override {}
    void drop() override {}

   private:
    FakeServer& server_;
    LinkListener& listener_;
    std::string answer_;
  };

  std::string answerTo(const v1::ClientMessage& request) {
    v1::ServerMessage answer;
    const bool refuses = request.has_create_scene() ? scenes.size() >= room_ : refusesDeletions;
    if (refuses) {
      answer.mutable_error()->set_text("there is no room");
    } else if (request.has_create_scene()) {
      EXPECT_EQ(request.create_scene().scene().cloths_size(), 1);
      EXPECT_TRUE(scenes.insert(request.create_scene().scene().name()).second);
      answer.mutable_create_scene();
    } else {
      EXPECT_EQ(scenes.erase(request.delete_scene().name()), 1u);
      answer.mutable_delete_scene();
    }
    return answer.SerializeAsString();
  }

  const std::size_t room_;
};

v1::Scene definition() {
  return hungScene(64, 72);
}

// Takes as many steps as the creation of this scene needs.
bool create(CreatedScenes& scenes, std::uint32_t scene) {
  while (!scenes.exists(scene))
    if (scenes.failure()) return false;
  return true;
}

TEST(CreatedScenes, AreCreatedInOrder) {
  FakeServer server(10);
  CreatedScenes scenes(server, "", definition());
  EXPECT_FALSE(scenes.exists(2));
  EXPECT_TRUE(scenes.waits());
  EXPECT_THAT(server.scenes, ElementsAre(scenes.name(0)));
  ASSERT_TRUE(create(scenes, 2));
  EXPECT_EQ(scenes.count(), 3u);
  EXPECT_THAT(server.scenes, ElementsAre(scenes.name(0), scenes.name(1), scenes.name(2)));
  EXPECT_GE(scenes.creationSeconds(2), 0);
  EXPECT_THAT(server.tokens, IsEmpty());
}

TEST(CreatedScenes, SayWhyTheNextWasRefused) {
  FakeServer server(2);
  CreatedScenes scenes(server, "", definition());
  EXPECT_FALSE(create(scenes, 4));
  EXPECT_EQ(scenes.count(), 2u);
  EXPECT_EQ(scenes.failure()->kind, Failure::Kind::refused);
  EXPECT_EQ(scenes.failure()->text, "there is no room");
  EXPECT_FALSE(scenes.exists(2));
  EXPECT_FALSE(scenes.waits());
  EXPECT_EQ(scenes.remove().scenes, 0u);
  EXPECT_THAT(server.scenes, IsEmpty());
}

TEST(CreatedScenes, AreDeletedAtTheEnd) {
  FakeServer server(100);
  {
    CreatedScenes scenes(server, "", definition());
    ASSERT_TRUE(create(scenes, 39));
    EXPECT_THAT(server.scenes, SizeIs(40));
    EXPECT_FALSE(scenes.exists(40));  // this one has been requested
  }
  EXPECT_THAT(server.scenes, IsEmpty());
}

TEST(CreatedScenes, CountThoseThatRemain) {
  FakeServer server(10);
  CreatedScenes scenes(server, "", definition());
  ASSERT_TRUE(create(scenes, 4));
  server.refusesDeletions = true;
  const CreatedScenes::Remaining remaining = scenes.remove();
  EXPECT_EQ(remaining.scenes, 5u);
  EXPECT_EQ(remaining.why.text, "there is no room");
  EXPECT_EQ(scenes.remove().scenes, 0u);
}

TEST(CreatedScenes, SayThatTheServerIsGone) {
  FakeServer server(10);
  CreatedScenes scenes(server, "", definition());
  ASSERT_TRUE(create(scenes, 0));
  server.isGone = true;
  EXPECT_FALSE(create(scenes, 1));
  EXPECT_EQ(scenes.failure()->kind, Failure::Kind::unreachable);
  const CreatedScenes::Remaining remaining = scenes.remove();
  EXPECT_EQ(remaining.scenes, 1u);
  EXPECT_THAT(remaining.why.text, HasSubstr("gone"));
}

TEST(CreatedScenes, ProveWhoTheyAreFrom) {
  FakeServer server(10);
  CreatedScenes scenes(server, "token", definition());
  ASSERT_TRUE(create(scenes, 0));
  EXPECT_EQ(scenes.remove().scenes, 0u);
  EXPECT_THAT(server.tokens, ElementsAre("token", "token"));
}

TEST(CreatedScenes, HaveNamesOfOneTestAlone) {
  FakeServer server(10);
  const CreatedScenes one(server, "", definition()), other(server, "", definition());
  EXPECT_NE(one.name(0), other.name(0));
  EXPECT_NE(one.name(0), one.name(1));
}

}  // namespace
}  // namespace clothstream::load
