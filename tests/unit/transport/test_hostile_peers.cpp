// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <set>

#include "planar_mapping/base/random.h"
#include "planar_mapping/transport/message.h"
#include "tcp_peer.h"
#include "transport_session.h"

namespace planar_mapping::transport {
namespace {

const InputDescription kFake = describe(FakeSource({6}));

Bytes frameBody(std::uint64_t position, const InputDescription& input = kFake) {
  return encodeFrame(input, position, transportFrame(40, 30, position + 1), CloudEncoding::Raw);
}

/// Speaks ZeroMQ, and sends what it is told to.
class ScriptedPeer {
 public:
  ScriptedPeer(const Endpoint& endpoint, std::uint64_t instance) : instance_(instance) {
    socket_.set(zmq::sockopt::linger, 200);
    socket_.connect(zmqAddress(endpoint));
  }
  void send(MessageType type, const Bytes& body = {}) {
    transport::send(socket_, "", type, instance_, body);
  }
  void sendParts(const std::vector<Bytes>& parts) {
    for (const Bytes& part : parts) {
      socket_.send(zmq::buffer(part),
                   &part == &parts.back() ? zmq::send_flags::none : zmq::send_flags::sndmore);
    }
  }
  /// Waits for the next message of the type, and skips others.
  template <typename Message>
  Message expect(MessageType type) {
    const Clock::time_point start = Clock::now();
    while (secondsSince(start) < 5.0) {
      std::optional<Received> received = receive(socket_, false);
      if (received) received->open();
      if (!received || received->type != type) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      ByteReader reader = received->reader();
      return decode<Message>(reader);
    }
    throw std::runtime_error("what was waited for did not come");
  }
  /// Until n frames are taken.
  void expectAck(std::uint64_t frames) {
    while (expect<Count>(MessageType::Ack).frames < frames) continue;
  }

 private:
  std::uint64_t instance_;
  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::dealer};
};

class HostilePeers : public ::testing::Test {
 protected:
  ListenerOptions options(double timeout) {
    ListenerOptions result = listenerOptions(timeout);
    result.max_frame = 100000;
    result.say = [this](const std::string& text) { said_.push_back(text); };
    return result;
  }
  void listen(double timeout = 5.0) {
    listener_.emplace(Endpoint{"127.0.0.1", 0}, options(timeout));
  }
  void startToMap() {
    mapping_ = std::async(std::launch::async, [this]() { return takeAll(*listener_); });
  }
  /// Whatever happened: a front-end gets its frames through.
  void expectTheRunSucceeds() {
    if (!mapping_.valid()) startToMap();
    EXPECT_EQ(6U, sendFakeFrames(listener_->endpoint(), {6}).frames_sent);
    EXPECT_EQ(6U, mapping_.get());
  }
  ScriptedPeer peer(std::uint64_t instance) { return {listener_->endpoint(), instance}; }
  TcpPeer tcpPeer() const { return TcpPeer::to(listener_->endpoint().port); }
  bool said(const std::string& part) const {
    for (const std::string& text : said_) {
      if (text.find(part) != std::string::npos) return true;
    }
    return false;
  }
  static void expectBye(ScriptedPeer& peer, ByeReason reason, const std::string& part) {
    const Bye bye = peer.expect<Bye>(MessageType::Bye);
    EXPECT_EQ(reason, bye.reason);
    EXPECT_NE(std::string::npos, bye.text.find(part)) << bye.text;
  }

  std::vector<std::string> said_;
  std::optional<FrameListener> listener_;
  std::future<std::uint64_t> mapping_;
};

TEST_F(HostilePeers, AStrangersHelloAndByeDoNotEndTheRun) {
  listen();
  ScriptedPeer stranger = peer(1);
  stranger.send(MessageType::Hello);
  stranger.send(MessageType::Bye, encode(Bye{ByeReason::Interrupted, "ha"}));
  startToMap();
  stranger.expect<Welcome>(MessageType::Welcome);
  expectTheRunSucceeds();
  EXPECT_TRUE(said("a front-end was interrupted before its first frame: ha"));
}

TEST_F(HostilePeers, AStrangerWhoNamesAnInputAndGoesLocksNobodyOut) {
  listen();
  startToMap();
  {
    ScriptedPeer stranger = peer(1);
    stranger.send(MessageType::Hello);
    stranger.expect<Welcome>(MessageType::Welcome);
    InputDescription other = kFake;
    other.fingerprint = 1;
    stranger.send(MessageType::End, encode(other, Count{0}));
    expectBye(stranger, ByeReason::Protocol, "it ends after 0 frames, but 0 came");
    Bytes damaged = frameBody(0, other);
    damaged.pop_back();
    stranger.send(MessageType::Frame, damaged);
    expectBye(stranger, ByeReason::Protocol, "field 'image'");
  }
  expectTheRunSucceeds();
}

TEST_F(HostilePeers, PeersThatRepeatHelloLockNobodyOut) {
  listen();
  startToMap();
  std::atomic<bool> done{false};
  std::vector<std::thread> peers;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    peers.emplace_back([this, i, &done]() {
      while (!done) {
        ScriptedPeer stranger = peer(i);
        for (int k = 0; k < 20; ++k) stranger.send(MessageType::Hello);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
  }
  expectTheRunSucceeds();
  done = true;
  for (std::thread& thread : peers) thread.join();
}

TEST_F(HostilePeers, HelloDoesNotProlongARun) {
  listen(0.5);
  startToMap();
  ScriptedPeer stranger = peer(1);
  const Clock::time_point start = Clock::now();
  while (mapping_.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
    stranger.send(MessageType::Hello);
    ASSERT_LT(secondsSince(start), 10.0);
  }
  EXPECT_EQ(0U, errorOf([this]() { mapping_.get(); }).find("no front-end connected for 0.5 s"));
}

TEST_F(HostilePeers, AStrangerIsToldBusyAndCannotDisturbTheFrontEnd) {
  listen();
  startToMap();
  ScriptedPeer robot = peer(1);
  robot.send(MessageType::Hello);
  robot.send(MessageType::Frame, frameBody(0));
  robot.expectAck(1);
  ScriptedPeer stranger = peer(2);
  stranger.send(MessageType::Hello);
  expectBye(stranger, ByeReason::Busy, "is serving another front-end already");
  stranger.send(MessageType::Frame, frameBody(1));
  expectBye(stranger, ByeReason::Busy, "is serving another front-end already");
  stranger.send(MessageType::End, encode(kFake, Count{1}));
  stranger.send(MessageType::Bye, encode(Bye{ByeReason::Failed, ""}));
  for (std::uint64_t i = 1; i < 6; ++i) robot.send(MessageType::Frame, frameBody(i));
  robot.send(MessageType::End, encode(kFake, Count{6}));
  EXPECT_EQ(6U, mapping_.get());
  expectBye(robot, ByeReason::Done, "");
}

TEST_F(HostilePeers, AFrameThatCameBeforeIsAcknowledgedAndNotProcessedAgain) {
  listen();
  startToMap();
  std::optional<ScriptedPeer> robot;
  robot.emplace(listener_->endpoint(), 1);
  for (std::uint64_t i = 0; i < 3; ++i) robot->send(MessageType::Frame, frameBody(i));
  robot->expectAck(3);
  robot->send(MessageType::Frame, frameBody(1));
  while (robot->expect<Count>(MessageType::Ack).frames != 2) continue;
  robot.emplace(listener_->endpoint(), 2);  // started again: the connection of the first is gone
  robot->send(MessageType::Hello);
  EXPECT_EQ(3U, robot->expect<Welcome>(MessageType::Welcome).next_frame);
  for (std::uint64_t i = 0; i < 6; ++i) robot->send(MessageType::Frame, frameBody(i));
  robot->send(MessageType::End, encode(kFake, Count{6}));
  EXPECT_EQ(6U, mapping_.get());  // each once
  EXPECT_TRUE(said("lost the connection to the front-end after frame 3 of 6"));
  EXPECT_TRUE(said("a front-end is back after frame"));
}

TEST_F(HostilePeers, ADamagedFrameEndsTheConnectionAndKeepsTheMap) {
  listen();
  startToMap();
  ScriptedPeer robot = peer(1);
  robot.send(MessageType::Frame, frameBody(0));
  robot.send(MessageType::Frame, frameBody(2));  // after a gap: is to be sent again
  robot.send(MessageType::End, encode(kFake, Count{3}));
  Bytes damaged = frameBody(1);
  damaged.resize(damaged.size() - sizeof(std::uint32_t) - 3);  // no image follows the points
  robot.send(MessageType::Frame, damaged);
  expectBye(robot, ByeReason::Protocol, "field 'points'");
  expectTheRunSucceeds();
  EXPECT_TRUE(said("cut off the front-end after frame 1 of 6: field 'points'"));
}

TEST_F(HostilePeers, AnotherInputIsRefused) {
  listen();
  startToMap();
  {
    ScriptedPeer robot = peer(1);
    robot.send(MessageType::Frame, frameBody(0));
    robot.expectAck(1);
  }
  ScriptedPeer other = peer(2);
  InputDescription wrong = kFake;
  wrong.fingerprint = 1;
  other.send(MessageType::Frame, frameBody(0, wrong));
  expectBye(other, ByeReason::OtherInput, "begun from another input (fake, 6 frames)");
  expectTheRunSucceeds();
}

TEST_F(HostilePeers, NotesAndStatisticsOfAFrontEndAreLimitedInAll) {
  listen();
  auto bytes = std::async(std::launch::async, [this]() {
    std::size_t notes = 0;
    std::set<std::string> names;
    while (const std::optional<Frame> frame = listener_->next()) {
      for (const std::string& note : frame->notes) notes += note.size();
      for (const FrameStatistic& item : frame->statistics) names.insert(item.name);
    }
    return std::make_pair(notes, names.size());
  });
  InputDescription input = kFake;
  input.frames = 200;
  ScriptedPeer robot = peer(1);
  for (std::uint64_t i = 0; i < input.frames; ++i) {
    Frame frame = transportFrame(2, 2);
    frame.notes.assign(32, std::string(1000, 'x'));
    for (int k = 0; k < 20; ++k)
      frame.statistics.push_back({"s" + std::to_string(i) + "_" + std::to_string(k), 1.0});
    robot.send(MessageType::Frame, encodeFrame(input, i, frame, CloudEncoding::Raw));
    robot.expectAck(i + 1);
  }
  robot.send(MessageType::End, encode(input, Count{200}));
  const auto [notes, names] = bytes.get();
  EXPECT_LE(notes, std::size_t{1} << 20U);
  EXPECT_GT(notes, std::size_t{1} << 18U);
  EXPECT_EQ(64U, names);
}

TEST_F(HostilePeers, MessagesThatAreNoneAreRefusedAndReportedToALimit) {
  listen();
  startToMap();
  ScriptedPeer stranger = peer(1);
  stranger.sendParts({{'G', 'E', 'T'}});
  stranger.sendParts({{}, {}, {}, {}, {}});
  expectBye(stranger, ByeReason::Protocol, "no messages of a planar_map front-end");
  stranger.sendParts({{'P', 'M', 'F', 'E', 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {}});
  while (stranger.expect<Bye>(MessageType::Bye).reason != ByeReason::Version) continue;
  stranger.send(MessageType::Ack, encode(Count{1}));
  expectBye(stranger, ByeReason::Protocol, "out of turn");
  Random random(5);
  for (int i = 0; i < 500; ++i) {
    Bytes body = frameBody(0);
    body.resize(random.below(static_cast<std::uint32_t>(body.size())));
    for (int k = 0; k < 3 && !body.empty(); ++k) body[random.below(body.size())] ^= 0x55U;
    stranger.send(static_cast<MessageType>(2 + random.below(4)), body);
  }
  expectTheRunSucceeds();
  EXPECT_LE(said_.size(), 100U);
}

TEST_F(HostilePeers, AMessageBeyondTheLimitIsCutOffByItsAnnouncement) {
  listen();
  startToMap();
  ScriptedPeer stranger = peer(1);
  stranger.send(MessageType::Frame, Bytes(200000, 0));
  expectTheRunSucceeds();
  EXPECT_FALSE(said("turned a peer away"));  // it never arrived
}

TEST_F(HostilePeers, OtherProtocolsNoiseAndSilenceDoNoHarm) {
  listen();
  startToMap();
  Random random(9);
  std::vector<TcpPeer> silent;
  for (int i = 0; i < 60; ++i) {
    silent.push_back(tcpPeer());
    if (i % 3 == 0) continue;
    std::string bytes = i % 3 == 1 ? "GET / HTTP/1.1\r\nHost: robot\r\n\r\n" : "\xFF";
    while (bytes.size() < 2000) bytes += static_cast<char>(random.below(256));
    silent.back().send(bytes);
  }
  expectTheRunSucceeds();
}

TEST_F(HostilePeers, AFloodDoesNotStopTheFrontEnd) {
  listen();
  startToMap();
  std::atomic<bool> done{false};
  std::thread flood([&]() {
    const std::string noise(65536, 'x');
    for (int connections = 0; connections < 500 && !done; ++connections) {
      TcpPeer peer = tcpPeer();
      for (int i = 0; i < 20 && peer.send(noise) && !done; ++i) continue;
    }
  });
  expectTheRunSucceeds();
  done = true;
  flood.join();
}

}  // namespace
}  // namespace planar_mapping::transport
