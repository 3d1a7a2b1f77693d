// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "listener_session_fixture.h"
#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping::transport {
namespace {

using HostileSession = ListenerSessionTest;

TEST_F(HostileSession, GarbageIsCutOffAfterFourBytes) {
  connect(robot_);
  give(robot_, {'G', 'E', 'T', ' '});
  EXPECT_FALSE(robot_.bye.has_value());
  EXPECT_TRUE(hasEvent("these are no messages of a planar_map front-end"));
  pass(0.0, &robot_);
  EXPECT_TRUE(robot_.closed);
}

TEST_F(HostileSession, AnotherVersionIsToldSo) {
  connect(robot_);
  Bytes hello = robot_.hello();
  hello[4] = 2;
  give(robot_, hello);
  ASSERT_TRUE(robot_.bye.has_value());
  EXPECT_EQ(ByeReason::Version, robot_.bye->reason);
  EXPECT_TRUE(hasEvent("version 2"));
}

TEST_F(HostileSession, TooLongMessagesAreCutOffAtTheirHeader) {
  connect(robot_);
  const Bytes body(kLargestControlBody + 1, 0);
  const HeaderBytes header = encodeHeader(MessageType::Hello, 0, 0, body);
  give(robot_, Bytes(header.begin(), header.end()));
  expectCutOff(robot_, "longer than the 8192 allowed");
  begin(other_);
  const HeaderBytes frame_header =
      encodeHeader(MessageType::Frame, other_.session, 2, Bytes(100001, 0));
  give(other_, Bytes(frame_header.begin(), frame_header.end()));
  expectCutOff(other_, "a message of 100001 bytes is longer than the 100000 allowed");
}

TEST_F(HostileSession, ConnectionsThatSayNothingAreClosed) {
  connect(robot_);
  pass(4.9, &robot_);
  EXPECT_FALSE(robot_.closed);
  give(robot_, {'P', 'M'});  // a drop now and then does not help
  pass(0.2, &robot_);
  EXPECT_TRUE(robot_.closed);
}

TEST_F(HostileSession, ThereIsALimitOfConnections) {
  std::vector<ScriptedPeer> crowd;
  for (int i = 0; i < 100; ++i) {
    crowd.emplace_back("crowd" + std::to_string(i), 10);
    connect(crowd.back());
  }
  session_.tick(now_);
  EXPECT_EQ(100U - ListenerSession::kLargestConnections, session_.takeOutgoing().size());
}

TEST_F(HostileSession, EventsAreLimited) {
  for (int i = 0; i < 500; ++i) {
    ScriptedPeer peer("p" + std::to_string(i), 3);
    connect(peer);
    give(peer, {'G', 'E', 'T', ' '});
    session_.disconnected(peer.name(), now_);
  }
  const std::vector<std::string> events = session_.takeEvents();
  EXPECT_EQ(ListenerSession::kLargestEvents, events.size());
  EXPECT_EQ("further events are not reported", events.back());
}

TEST_F(HostileSession, DamagedSessionsNeverHarmTheFramesTaken) {
  Random random(5);
  std::uint64_t taken = 0;
  for (int round = 0; round < 300; ++round) {
    ScriptedPeer peer("peer" + std::to_string(round), 100U + static_cast<std::uint64_t>(round));
    connect(peer);
    give(peer, peer.hello());
    ASSERT_TRUE(peer.welcome.has_value());
    Bytes bytes = peer.message(MessageType::Ready, encode(ready()));
    for (std::uint64_t i = 0; i < 2; ++i) {
      const Bytes more = peer.message(
          MessageType::Frame, frame(std::min<std::uint64_t>(7, peer.welcome->next_frame + i)));
      bytes.insert(bytes.end(), more.begin(), more.end());
    }
    const std::size_t at = random.below(static_cast<std::uint32_t>(bytes.size()));
    if (random.below(2) == 0) {
      bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1U << random.below(8)));
    } else {
      bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at));
    }
    give(peer, bytes);
    while (const std::optional<Frame> frame = session_.takeFrame(now_)) {
      EXPECT_EQ(3 * (taken + 1), frame->number);
      ++taken;
    }
    session_.disconnected(peer.name(), now_);
    ASSERT_EQ(State::Open, session_.state());
  }
  EXPECT_GT(taken, 3U);
  EXPECT_LE(taken, 8U);
}

}  // namespace
}  // namespace planar_mapping::transport
