// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "listener_session_fixture.h"

namespace planar_mapping::transport {
namespace {

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
