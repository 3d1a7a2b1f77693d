// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A session in which peers send what they like: for each message a byte for who says it and what it
// is, then its fields; between messages a frame may be taken and a connection be lost. Afterwards a
// front-end gets its frame through, unless a peer made itself the owner with a valid one. Sockets
// are of tests/unit/transport.
#include <map>
#include <set>

#include "fuzz.h"
#include "planar_mapping/transport/frame_session.h"
#include "transport_frames.h"

using namespace planar_mapping;
using namespace planar_mapping::transport;

namespace {

constexpr int kMaxMessages = 24;
constexpr std::uint64_t kPeers = 4;  // instances of the peer, from 0 on
constexpr std::uint64_t kRobot = 99;

InputDescription inputOf(std::uint64_t frames) {
  InputDescription description;
  description.frames = frames;
  description.name = "fuzz";
  return description;
}

Bytes frameOf(const InputDescription& description, std::uint64_t position) {
  static const Frame frame = transportFrame(4, 3);
  return encodeFrame(description, position, frame, CloudEncoding::Raw);
}

/// A well-formed body, which then may be damaged.
Bytes bodyOf(fuzz::Input& input, MessageType type) {
  const InputDescription description = inputOf(input.below(5));
  const std::uint64_t number = input.below(5);
  if (type == MessageType::Frame) return frameOf(description, number);
  if (type == MessageType::End) return encode(description, Count{number});
  if (type == MessageType::Bye) return encode(Bye{static_cast<ByeReason>(number), "x\033[1m"});
  return {};
}

Received messageOf(const std::string& peer, const Bytes& envelope, const Bytes& body) {
  Received message;
  message.peer = peer;
  message.envelope = zmq::message_t(envelope);
  message.body = zmq::message_t(body);
  return message;
}

Received anyMessage(fuzz::Input& input) {
  const std::uint64_t instance = input.below(kPeers);
  const std::string peer = std::to_string(instance);
  const unsigned how = input.below(8);
  if (how == 0) {  // no message of ours
    const bool has_more = input.flag();
    const std::string first = input.text(input.below(64));
    const std::string more = has_more ? input.text(input.below(64)) : "";
    return messageOf(peer, Bytes(first.begin(), first.end()), Bytes(more.begin(), more.end()));
  }
  const auto type = static_cast<MessageType>(input.below(8));
  Bytes body = how == 1 ? Bytes() : bodyOf(input, type);
  if (how <= 2) {
    const std::string more = input.text(input.below(255));
    body.insert(body.end(), more.begin(), more.end());
  } else if (how == 3 && !body.empty()) {
    body[input.number<std::uint16_t>() % body.size()] = input.number<std::uint8_t>();
  } else if (how == 4 && !body.empty()) {
    body.resize(input.number<std::uint16_t>() % body.size());
  }
  return messageOf(peer, envelopeOf(type, instance), body);
}

/// The other ends of a session: what each was told last, and who is gone.
struct Listeners {
  std::map<std::string, MessageType> told;
  std::set<std::string> gone;
  Sent send(const std::string& peer, MessageType type) {
    if (gone.count(peer) > 0) return Sent::Unreachable;
    told[peer] = type;
    return Sent::Yes;
  }
};

/// How many frames were taken: one, or none.
int take(FrameSession& session) {
  const std::optional<Frame> frame = session.takeFrame();
  if (!frame) return 0;
  fuzz::require(frame->cloud->size() == std::size_t{frame->cloud->width} * frame->cloud->height,
                "a cloud of the size it says");
  return 1;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  int events = 0;
  ListenerOptions options;
  options.configuration = "version: 1\n";
  options.max_frame = 65536;
  options.say = [&events](const std::string& text) {
    ++events;
    fuzz::require(text.find('\033') == std::string::npos, "no control characters are shown");
  };
  Listeners listeners;
  FrameSession session(options, {[&](const std::string& peer, MessageType type,
                                     const Bytes& /*body*/) { return listeners.send(peer, type); },
                                 [](zmq::message_t& /*envelope*/) {}});

  int taken = 0;
  // As FrameListener: while a frame waits to be taken, no message is read.
  for (int i = 0; i < kMaxMessages && input.left() > 0 && !session.hasEnded(); ++i) {
    Received message = anyMessage(input);
    if (input.below(8) == 0) {
      listeners.gone.insert(message.peer);
    } else {
      listeners.gone.erase(message.peer);
    }
    session.take(message);
    if (session.hasFrame()) taken += take(session);
  }
  // Whichever of them owns the session ends it.
  for (std::uint64_t i = 0; i < kPeers; ++i) {
    Received bye = messageOf(std::to_string(i), envelopeOf(MessageType::Bye, i),
                             encode(Bye{ByeReason::Interrupted, ""}));
    if (!session.hasEnded()) session.take(bye);
  }
  const std::string robot = std::to_string(kRobot);
  const auto say = [&](MessageType type, const Bytes& body) {
    Received message = messageOf(robot, envelopeOf(type, kRobot), body);
    session.take(message);
  };
  if (!session.hasEnded()) {
    say(MessageType::Hello, {});
    fuzz::require(listeners.told.count(robot) > 0, "a peer hears from the listener");
    say(MessageType::Frame, frameOf(inputOf(1), 0));
    taken += take(session);
    if (!session.hasEnded()) say(MessageType::End, encode(inputOf(1), Count{1}));
  }
  fuzz::require(taken > 0, "a frame gets through");
  session.sayGoodbye(true);
  fuzz::require(events <= FrameSession::kMaxEvents, "bounded reports");
  return 0;
}
