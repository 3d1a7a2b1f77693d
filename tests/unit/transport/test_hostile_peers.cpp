// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <optional>
#include <stdexcept>
#include <thread>

#include "planar_mapping/core/base/detail/random.h"
#include "tcp_peer.h"
#include "transport_session.h"

namespace planar_mapping::transport {
namespace {

class HostilePeers : public ::testing::Test {
 protected:
  HostilePeers() : listener_({"127.0.0.1", 0}, optionsWithEvents()) {}

  ListenerOptions optionsWithEvents() {
    ListenerOptions options = listenerOptions();
    options.say = [this](const std::string& text) { events_.push_back(text); };
    return options;
  }
  TcpPeer connect() const { return TcpPeer::to(listener_.endpoint().port); }
  /// Whatever happened before: a real front-end gets its frames through.
  void expectStillWorks() {
    auto sender = sendInBackground(listener_.endpoint(), {6});
    EXPECT_EQ(6U, takeAll(listener_));
    EXPECT_EQ(6U, sender.get().frames_sent);
  }
  bool saw(const std::string& part) const {
    for (const std::string& event : events_) {
      if (event.find(part) != std::string::npos) return true;
    }
    return false;
  }
  /// Says hello and reads the header of the first message that comes back.
  static MessageHeader answerToHello(TcpPeer& peer, detail::MessageSealer& sealer) {
    const Bytes hello = encode(Hello{1, "hostile"});
    peer.sendBytes(sealer.seal(MessageType::Hello, 0, hello));
    peer.sendBytes(hello);
    const std::string answer = peer.readAll(0.2);
    if (answer.size() < kHeaderBytes) throw std::runtime_error("no answer to a hello");
    HeaderBytes header{};
    std::copy_n(answer.begin(), kHeaderBytes, header.begin());
    return decodeHeader(header);
  }
  static void expectClosed(TcpPeer& peer) {
    bool closed = false;
    peer.readAll(5.0, &closed);
    EXPECT_TRUE(closed);
  }

  std::vector<std::string> events_;
  FrameListener listener_;
};

TEST_F(HostilePeers, OtherProtocolsAreTurnedAway) {
  for (const char* greeting : {"GET / HTTP/1.1\r\nHost: robot\r\n\r\n", "SSH-2.0-OpenSSH_9.2\r\n",
                               "\xFF\x00\x00\x00\x00"}) {
    TcpPeer peer = connect();
    EXPECT_TRUE(peer.send(std::string(greeting, 5)));
    expectClosed(peer);
  }
  expectStillWorks();
  EXPECT_TRUE(saw("turned a peer away: these are no messages of a planar_map front-end"));
}

TEST_F(HostilePeers, RandomBytesDoNoHarm) {
  Random random(9);
  for (int i = 0; i < 30; ++i) {
    TcpPeer peer = connect();
    std::string bytes = i % 2 == 0 ? "PMFE" : "";
    while (bytes.size() < 2000) bytes += static_cast<char>(random.below(256));
    peer.send(bytes);
  }
  expectStillWorks();
}

TEST_F(HostilePeers, AnnouncedGiantsAreCutOffWithoutBeingWaitedFor) {
  TcpPeer peer = connect();
  detail::MessageSealer sealer;
  HeaderBytes header = sealer.seal(MessageType::Hello, 0, Bytes(20000, 0));
  EXPECT_TRUE(peer.sendBytes(header));
  expectClosed(peer);
  expectStillWorks();
  EXPECT_TRUE(saw("a message of 20000 bytes is longer than the 8192 allowed"));
}

TEST_F(HostilePeers, AStrangerMayNotSendFrames) {
  TcpPeer peer = connect();
  detail::MessageSealer sealer;
  const Bytes body = encodeFrame(transportFrame(40, 30), 0);
  peer.sendBytes(sealer.seal(MessageType::Frame, 0, body));
  peer.sendBytes(body);
  expectClosed(peer);
  expectStillWorks();
}

TEST_F(HostilePeers, SlowAndSilentConnectionsDoNotBlockAnybody) {
  std::vector<TcpPeer> loris;
  for (std::size_t i = 0; i + 4 < detail::ListenerSession::kLargestConnections; ++i) {
    loris.push_back(connect());
    loris.back().send(i % 2 == 0 ? "P" : "");
  }
  expectStillWorks();
}

TEST_F(HostilePeers, ACrowdOfConnectionsIsDispersed) {
  {
    std::vector<TcpPeer> crowd;
    for (int i = 0; i < 100; ++i) crowd.push_back(connect());
    for (TcpPeer& peer : crowd) peer.send("P");
  }
  expectStillWorks();
}

TEST_F(HostilePeers, AFloodDoesNotStopTheRealFrontEnd) {
  std::atomic<bool> done{false};
  std::thread flood([&]() {
    const std::string noise(65536, 'x');
    for (int connections = 0; connections < 500 && !done; ++connections) {
      TcpPeer peer = connect();
      for (int i = 0; i < 20 && peer.send(noise) && !done; ++i) continue;
    }
  });
  auto sender = sendInBackground(listener_.endpoint(), {6});
  std::uint64_t taken = 0;
  const std::string error = errorOf([&]() { taken = takeAll(listener_); });
  done = true;
  flood.join();
  EXPECT_EQ(6U, taken) << error;
  EXPECT_EQ(6U, sender.get().frames_sent);
}

TEST_F(HostilePeers, ADamagedFrameEndsTheConnectionAndKeepsTheMap) {
  auto crashing = sendInBackground(listener_.endpoint(), {6, 2});
  EXPECT_EQ("crash", errorOf([&]() { crashing.get(); }));
  {
    // Takes the place of the front-end, and goes on with nonsense.
    std::optional<detail::MessageSealer> sealer;
    std::optional<TcpPeer> peer;
    MessageHeader answer;
    // As long as it has not been noticed that the front-end is gone, nobody may take its place.
    answer.type = MessageType::Bye;
    for (int i = 0; i < 100 && answer.type == MessageType::Bye; ++i) {
      sealer.emplace();
      peer.emplace(connect());
      answer = answerToHello(*peer, *sealer);
    }
    ASSERT_NE(answer.type, MessageType::Bye);
    const std::uint64_t session = answer.session;
    const Bytes ready =
        encode(Ready{io::SequenceKind::Clouds, io::PoseSource::File, 6, 4711, "fake"});
    peer->sendBytes(sealer->seal(MessageType::Ready, session, ready));
    peer->sendBytes(ready);
    Bytes body = encodeFrame(transportFrame(40, 30, 3), 2);
    const HeaderBytes good = sealer->seal(MessageType::Frame, session, body);
    body[body.size() / 2] ^= 1U;
    peer->sendBytes(good);
    peer->sendBytes(body);
    expectClosed(*peer);
  }
  auto sender = sendInBackground(listener_.endpoint(), {6});
  EXPECT_EQ(6U, takeAll(listener_));
  EXPECT_EQ(4U, sender.get().frames_sent);
  EXPECT_TRUE(saw("cut off the front-end after frame 2 of 6: a message is damaged"));
}

}  // namespace
}  // namespace planar_mapping::transport
