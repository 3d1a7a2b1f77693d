// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "planar_mapping/transport/detail/listener_session.h"
#include "transport_frames.h"

namespace planar_mapping::transport {

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

  detail::MessageSealer sealer;
  std::uint64_t session = 0;
  std::optional<Welcome> welcome;
  std::optional<Bye> bye;
  std::uint64_t acknowledged = 0;
  int acks = 0;
  bool closed = false;

 private:
  std::string name_;
  std::uint64_t instance_;
  detail::MessageAssembler assembler_;
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

  using ListenerSession = detail::ListenerSession;
  using State = ListenerSession::State;

  ListenerSession::Time now_ = ListenerSession::Time() + std::chrono::hours(1);
  ListenerSession session_{settings(), now_};
  ScriptedPeer robot_{"robot", 1};
  ScriptedPeer other_{"other", 2};
};

}  // namespace planar_mapping::transport
