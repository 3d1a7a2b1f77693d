// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/detail/listener_session.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "planar_mapping/core/random.h"
#include "transport_frames.h"

namespace planar_mapping::transport {
namespace {

using detail::ListenerSession;
using detail::MessageAssembler;
using detail::MessageSealer;
using State = ListenerSession::State;

/// A front-end that says what it is told to, well-formed or not, to a session without a network.
class ScriptedPeer {
 public:
  ScriptedPeer(std::string name, std::uint64_t instance)
      : name_(std::move(name)), instance_(instance) {}

  Bytes message(MessageType type, const Bytes& body) {
    const HeaderBytes header = sealer.seal(type, session, body);
    Bytes bytes(header.size() + body.size());
    std::copy(body.begin(), body.end(), std::copy(header.begin(), header.end(), bytes.begin()));
    return bytes;
  }
  Bytes hello() { return message(MessageType::Hello, encode(Hello{instance_, "test"})); }

  /// Takes what the session sent to this peer.
  void take(const Bytes& bytes) {
    if (bytes.empty()) {
      closed = true;
      return;
    }
    assembler_.feed(
        bytes.data(), bytes.size(),
        [](const MessageHeader& header) { return largestBody(header.type, 0); },
        [this](const MessageHeader& header, const Bytes& body) {
          if (header.type == MessageType::Welcome) {
            welcome = decodeWelcome(body);
            session = header.session;
          } else if (header.type == MessageType::Ack) {
            acknowledged = decodeAck(body).next_frame;
            ++acks;
          } else {
            bye = decodeBye(body);
          }
        });
  }

  const std::string& name() const { return name_; }

  MessageSealer sealer;
  std::uint64_t session = 0;
  std::optional<Welcome> welcome;
  std::optional<Bye> bye;
  std::uint64_t acknowledged = 0;
  int acks = 0;
  bool closed = false;

 private:
  std::string name_;
  std::uint64_t instance_;
  MessageAssembler assembler_;
};

class ListenerSessionTest : public ::testing::Test {
 protected:
  static ListenerSettings settings() {
    ListenerSettings result;
    result.configuration = "version: 1\n";
    result.timeout = 10.0;
    result.window = 3;
    result.largest_frame = 100000;
    return result;
  }
  static Ready ready(std::uint64_t frames = 8) {
    return {io::SequenceKind::Clouds, io::PoseSource::File, frames, 99, "street"};
  }
  static Bytes frame(std::uint64_t position) {
    return encodeFrame(transportFrame(6, 4, position + 1), position);
  }

  void connect(ScriptedPeer& peer) { session_.connected(peer.name(), now_); }
  void give(ScriptedPeer& peer, const Bytes& bytes) {
    session_.received(peer.name(), bytes.data(), bytes.size(), now_);
    deliver(peer);
  }
  void deliver(ScriptedPeer& peer) {
    for (const auto& item : session_.takeOutgoing()) {
      if (item.peer == peer.name()) peer.take(item.bytes);
    }
  }
  void pass(double seconds, ScriptedPeer* peer = nullptr) {
    now_ += std::chrono::milliseconds(static_cast<long>(1000.0 * seconds));
    session_.tick(now_);
    if (peer != nullptr) deliver(*peer);
  }
  /// Connected, welcomed, ready.
  void begin(ScriptedPeer& peer) {
    connect(peer);
    give(peer, peer.hello());
    ASSERT_TRUE(peer.welcome.has_value());
    give(peer, peer.message(MessageType::Ready, encode(ready())));
    ASSERT_FALSE(peer.bye.has_value()) << peer.bye->text;
  }
  void sendFrame(ScriptedPeer& peer, std::uint64_t position) {
    give(peer, peer.message(MessageType::Frame, frame(position)));
  }
  void expectCutOff(ScriptedPeer& peer, const std::string& part) {
    ASSERT_TRUE(peer.bye.has_value());
    EXPECT_EQ(ByeReason::Protocol, peer.bye->reason);
    EXPECT_NE(std::string::npos, peer.bye->text.find(part)) << peer.bye->text;
    pass(1.0, &peer);
    EXPECT_TRUE(peer.closed);
  }
  bool hasEvent(const std::string& part) {
    for (const std::string& event : session_.takeEvents()) {
      if (event.find(part) != std::string::npos) return true;
    }
    return false;
  }

  ListenerSession::Time now_ = ListenerSession::Time() + std::chrono::hours(1);
  ListenerSession session_{settings(), now_};
  ScriptedPeer robot_{"robot", 1};
  ScriptedPeer other_{"other", 2};
};

TEST_F(ListenerSessionTest, AWholeSessionGivesTheFramesInOrder) {
  begin(robot_);
  EXPECT_EQ("version: 1\n", robot_.welcome->configuration);
  EXPECT_EQ(0U, robot_.welcome->next_frame);
  EXPECT_EQ(3U, robot_.welcome->window);
  ASSERT_TRUE(session_.input().has_value());
  EXPECT_EQ("street", session_.input()->name);
  for (std::uint64_t i = 0; i < 8; ++i) {
    sendFrame(robot_, i);
    const std::optional<Frame> frame = session_.takeFrame(now_);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(3 * (i + 1), frame->number);
    deliver(robot_);
    EXPECT_EQ(i + 1, robot_.acknowledged);
  }
  EXPECT_EQ(State::Open, session_.state());
  give(robot_, robot_.message(MessageType::End, encode(End{8})));
  EXPECT_EQ(State::Ended, session_.state());
  EXPECT_FALSE(session_.takeFrame(now_).has_value());
  session_.close({ByeReason::Done, ""}, now_);
  deliver(robot_);
  ASSERT_TRUE(robot_.bye.has_value());
  EXPECT_EQ(ByeReason::Done, robot_.bye->reason);
}

TEST_F(ListenerSessionTest, MessagesMayArriveInAnyPieces) {
  connect(robot_);
  Bytes bytes = robot_.hello();
  for (const std::uint8_t byte : bytes) give(robot_, {byte});
  ASSERT_TRUE(robot_.welcome.has_value());
  bytes = robot_.message(MessageType::Ready, encode(ready()));
  for (std::uint64_t i = 0; i < 3; ++i) {
    const Bytes more = robot_.message(MessageType::Frame, frame(i));
    bytes.insert(bytes.end(), more.begin(), more.end());
  }
  for (std::size_t i = 0; i < bytes.size(); i += 7) {
    const std::size_t end = std::min(bytes.size(), i + 7);
    give(robot_, Bytes(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                       bytes.begin() + static_cast<std::ptrdiff_t>(end)));
  }
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(session_.takeFrame(now_).has_value());
}

TEST_F(ListenerSessionTest, TheWindowBoundsWhatWaits) {
  begin(robot_);
  for (std::uint64_t i = 0; i < 3; ++i) sendFrame(robot_, i);
  EXPECT_FALSE(robot_.bye.has_value());
  sendFrame(robot_, 3);
  expectCutOff(robot_, "more frames ahead than it was allowed to");
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(session_.takeFrame(now_).has_value());  // these stay
}

TEST_F(ListenerSessionTest, ReplayedAndSkippedFramesAreCutOff) {
  begin(robot_);
  sendFrame(robot_, 0);
  sendFrame(robot_, 0);
  expectCutOff(robot_, "frame 0 came where frame 1 of 8 was due");
  begin(other_);
  EXPECT_EQ(1U, other_.welcome->next_frame);
  sendFrame(other_, 2);
  expectCutOff(other_, "frame 2 came where frame 1 of 8 was due");
}

TEST_F(ListenerSessionTest, AReplayedOrLeftOutMessageIsNoticedByItsNumber) {
  begin(robot_);
  const Bytes first = robot_.message(MessageType::Frame, frame(0));
  give(robot_, first);
  give(robot_, first);
  expectCutOff(robot_, "message 2 came where message 3 was due");
  begin(other_);
  (void)other_.message(MessageType::Progress, encode(Progress{1}));
  sendFrame(other_, 1);
  expectCutOff(other_, "message 3 came where message 2 was due");
}

TEST_F(ListenerSessionTest, MessagesOfAnotherSessionAreCutOff) {
  begin(robot_);
  robot_.session ^= 1U;
  sendFrame(robot_, 0);
  expectCutOff(robot_, "another session");
}

TEST_F(ListenerSessionTest, MessagesOutOfTurnAreCutOff) {
  const std::vector<std::pair<MessageType, Bytes>> cases = {
      {MessageType::Frame, frame(0)},
      {MessageType::Ready, encode(ready())},
      {MessageType::End, encode(End{0})},
      {MessageType::Progress, encode(Progress{1})},
      {MessageType::Welcome, encode(Welcome{"", 0, 1, 1, 1.0})},
      {MessageType::Ack, encode(Ack{1})}};
  int number = 0;
  for (const auto& item : cases) {  // before Hello
    ScriptedPeer peer("peer" + std::to_string(number++), 7);
    connect(peer);
    give(peer, peer.message(item.first, item.second));
    expectCutOff(peer, "out of turn");
  }
  connect(robot_);  // before Ready
  give(robot_, robot_.hello());
  sendFrame(robot_, 0);
  expectCutOff(robot_, "out of turn");
  begin(other_);  // twice
  give(other_, other_.message(MessageType::Ready, encode(ready())));
  expectCutOff(other_, "out of turn");
}

TEST_F(ListenerSessionTest, ASecondFrontEndIsRefusedAndTheFirstGoesOn) {
  begin(robot_);
  sendFrame(robot_, 0);
  connect(other_);
  give(other_, other_.hello());
  ASSERT_TRUE(other_.bye.has_value());
  EXPECT_EQ(ByeReason::Busy, other_.bye->reason);
  EXPECT_EQ("the mapping side is serving another front-end already", other_.bye->text);
  EXPECT_TRUE(hasEvent("turned a peer away"));
  sendFrame(robot_, 1);
  EXPECT_FALSE(robot_.bye.has_value());
  EXPECT_TRUE(session_.takeFrame(now_).has_value());
  EXPECT_TRUE(session_.takeFrame(now_).has_value());
}

TEST_F(ListenerSessionTest, AFrontEndThatComesBackGoesOnWhereItWas) {
  begin(robot_);
  sendFrame(robot_, 0);
  sendFrame(robot_, 1);
  session_.disconnected(robot_.name(), now_);
  EXPECT_TRUE(hasEvent("lost the connection to the front-end after frame 2 of 8"));
  pass(9.0);
  ScriptedPeer again("robot2", 5);
  begin(again);
  EXPECT_EQ(2U, again.welcome->next_frame);
  EXPECT_TRUE(hasEvent("a front-end is back after frame 2 of 8"));
  give(again, again.message(MessageType::Progress, encode(Progress{1})));
  give(again, again.message(MessageType::Progress, encode(Progress{2})));
  sendFrame(again, 2);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(session_.takeFrame(now_).has_value()) << i;
  EXPECT_EQ(State::Open, session_.state());
}

TEST_F(ListenerSessionTest, TheSameFrontEndMayReplaceItsOwnDeadConnection) {
  begin(robot_);
  ScriptedPeer again("robot2", 1);  // the same instance; the old connection is half open
  connect(again);
  give(again, again.hello());
  EXPECT_TRUE(again.welcome.has_value());
}

TEST_F(ListenerSessionTest, ASilentFrontEndIsReplacedByAnother) {
  begin(robot_);
  pass(6.0);
  connect(other_);
  give(other_, other_.hello());
  EXPECT_TRUE(other_.welcome.has_value());
  EXPECT_NE(robot_.session, other_.session);
}

TEST_F(ListenerSessionTest, WhoSaysHelloAndNoMoreKeepsNobodyOut) {
  connect(robot_);
  give(robot_, robot_.hello());
  pass(1.9);
  ScriptedPeer early("early", 3);
  connect(early);
  give(early, early.hello());
  EXPECT_FALSE(early.welcome.has_value());
  pass(0.2);
  begin(other_);
  EXPECT_TRUE(other_.welcome.has_value());
}

TEST_F(ListenerSessionTest, AnotherInputIsRefused) {
  begin(robot_);
  session_.disconnected(robot_.name(), now_);
  connect(other_);
  give(other_, other_.hello());
  Ready wrong = ready();
  wrong.fingerprint = 1;
  give(other_, other_.message(MessageType::Ready, encode(wrong)));
  ASSERT_TRUE(other_.bye.has_value());
  EXPECT_EQ(ByeReason::OtherInput, other_.bye->reason);
  EXPECT_EQ("this map was begun from another input (street, 8 frames)", other_.bye->text);
}

TEST_F(ListenerSessionTest, NobodyComesWithinTheTimeout) {
  pass(9.9);
  EXPECT_EQ(State::Open, session_.state());
  pass(0.2);
  EXPECT_EQ(State::Failed, session_.state());
  EXPECT_EQ(0U, session_.failure().find("no front-end connected for 10 s;")) << session_.failure();
}

TEST_F(ListenerSessionTest, AFrontEndThatSendsNothingFails) {
  begin(robot_);
  sendFrame(robot_, 0);
  ASSERT_TRUE(session_.takeFrame(now_).has_value());
  pass(10.1, &robot_);
  EXPECT_EQ(State::Failed, session_.state());
  EXPECT_EQ("the front-end sent nothing for 10 s after frame 1 of 8", session_.failure());
  ASSERT_TRUE(robot_.bye.has_value());
  EXPECT_EQ(ByeReason::Failed, robot_.bye->reason);
}

TEST_F(ListenerSessionTest, AFrontEndThatVanishesFailsAfterTheTimeout) {
  begin(robot_);
  sendFrame(robot_, 0);
  session_.disconnected(robot_.name(), now_);
  ASSERT_TRUE(session_.takeFrame(now_).has_value());
  pass(10.1);
  EXPECT_EQ("the front-end went away after frame 1 of 8 and did not come back for 10 s",
            session_.failure());
}

TEST_F(ListenerSessionTest, ASlowMapperIsNotTheFrontEndsFault) {
  begin(robot_);
  sendFrame(robot_, 0);
  for (int i = 0; i < 60; ++i) pass(1.0, &robot_);  // the frame waits for the mapper
  EXPECT_EQ(State::Open, session_.state());
  EXPECT_GE(robot_.acks, 59);  // signs of life all the while
  EXPECT_EQ(0U, robot_.acknowledged);
  EXPECT_TRUE(session_.takeFrame(now_).has_value());
}

TEST_F(ListenerSessionTest, OnlyRealProgressKeepsASessionAlive) {
  begin(robot_);
  for (std::uint64_t i = 0; i < 3; ++i) sendFrame(robot_, i);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(session_.takeFrame(now_).has_value());
  session_.disconnected(robot_.name(), now_);
  begin(other_);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    pass(9.0);
    give(other_, other_.message(MessageType::Progress, encode(Progress{i})));
  }
  EXPECT_EQ(State::Open, session_.state());
  give(other_, other_.message(MessageType::Progress, encode(Progress{3})));
  expectCutOff(other_, "progress that is none");
}

TEST_F(ListenerSessionTest, ComingAndGoingDoesNotKeepASessionAlive) {
  begin(robot_);
  sendFrame(robot_, 0);
  ASSERT_TRUE(session_.takeFrame(now_).has_value());
  session_.disconnected(robot_.name(), now_);
  int visits = 0;
  for (; session_.state() == State::Open && visits < 100; ++visits) {
    ScriptedPeer peer("visitor" + std::to_string(visits), 1000U + static_cast<unsigned>(visits));
    begin(peer);
    give(peer, peer.message(MessageType::Progress, encode(Progress{1})));
    session_.disconnected(peer.name(), now_);
    pass(6.0);
  }
  EXPECT_EQ(State::Failed, session_.state());
  EXPECT_LT(visits, 10);
}

TEST_F(ListenerSessionTest, AFrontEndThatGivesUpSaysWhy) {
  begin(robot_);
  sendFrame(robot_, 0);
  give(robot_, robot_.message(MessageType::Bye, encode(Bye{ByeReason::Failed, "disk gone"})));
  EXPECT_EQ(State::Open, session_.state());  // a frame is still to be mapped
  EXPECT_TRUE(session_.takeFrame(now_).has_value());
  EXPECT_EQ(State::Failed, session_.state());
  EXPECT_EQ("the front-end gave up after frame 1 of 8: disk gone", session_.failure());
}

TEST_F(ListenerSessionTest, AnInterruptedFrontEndSaysSo) {
  begin(robot_);
  give(robot_, robot_.message(MessageType::Bye, encode(Bye{ByeReason::Interrupted, ""})));
  EXPECT_EQ("the front-end was interrupted after frame 0 of 8", session_.failure());
}

TEST_F(ListenerSessionTest, GarbageIsCutOffAfterFourBytes) {
  connect(robot_);
  give(robot_, {'G', 'E', 'T', ' '});
  EXPECT_FALSE(robot_.bye.has_value());
  EXPECT_TRUE(hasEvent("these are no messages of a planar_map front-end"));
  pass(0.0, &robot_);
  EXPECT_TRUE(robot_.closed);
}

TEST_F(ListenerSessionTest, AnotherVersionIsToldSo) {
  connect(robot_);
  Bytes hello = robot_.hello();
  hello[4] = 2;
  give(robot_, hello);
  ASSERT_TRUE(robot_.bye.has_value());
  EXPECT_EQ(ByeReason::Version, robot_.bye->reason);
  EXPECT_TRUE(hasEvent("version 2"));
}

TEST_F(ListenerSessionTest, TooLongMessagesAreCutOffAtTheirHeader) {
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

TEST_F(ListenerSessionTest, ConnectionsThatSayNothingAreClosed) {
  connect(robot_);
  pass(4.9, &robot_);
  EXPECT_FALSE(robot_.closed);
  give(robot_, {'P', 'M'});  // a drop now and then does not help
  pass(0.2, &robot_);
  EXPECT_TRUE(robot_.closed);
}

TEST_F(ListenerSessionTest, ThereIsALimitOfConnections) {
  std::vector<ScriptedPeer> crowd;
  for (int i = 0; i < 100; ++i) {
    crowd.emplace_back("crowd" + std::to_string(i), 10);
    connect(crowd.back());
  }
  session_.tick(now_);
  EXPECT_EQ(100U - ListenerSession::kLargestConnections, session_.takeOutgoing().size());
}

TEST_F(ListenerSessionTest, EventsAreLimited) {
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

TEST_F(ListenerSessionTest, DamagedSessionsNeverHarmTheFramesTaken) {
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

TEST_F(ListenerSessionTest, SettingsOutOfRangeAreErrors) {
  const auto refuses = [this](const ListenerSettings& bad) {
    EXPECT_THROW(ListenerSession(bad, now_), ParameterError);
  };
  ListenerSettings bad = settings();
  bad.timeout = 0.0;
  refuses(bad);
  bad.timeout = std::numeric_limits<double>::quiet_NaN();
  refuses(bad);
  bad = settings();
  bad.window = 0;
  refuses(bad);
  bad = settings();
  bad.largest_frame = 100;
  refuses(bad);
}

}  // namespace
}  // namespace planar_mapping::transport
