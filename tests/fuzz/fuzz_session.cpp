// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A session in which a peer sends what it likes: for each message a byte for who says it and what
// it is, then its fields. Afterwards a front-end gets its frame through, unless the peer made
// itself the owner with a valid one.
#include <atomic>
#include <future>

#include "fuzz.h"
#include "planar_mapping/transport/frame_listener.h"
#include "planar_mapping/transport/message.h"
#include "transport_frames.h"

using namespace planar_mapping;
using namespace planar_mapping::transport;

namespace {

constexpr int kMaxMessages = 24;
constexpr std::uint64_t kPeers = 4;  // instances of the peer, from 0 on
constexpr std::uint64_t kRobot = 99;
constexpr double kPatience = 10.0;  // seconds, then it hangs

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

void sendAny(fuzz::Input& input, zmq::socket_t& socket) {
  const std::uint64_t instance = input.below(kPeers);
  const unsigned how = input.below(8);
  if (how == 0) {  // no message of ours
    const bool has_more = input.flag();
    socket.send(zmq::buffer(input.text(input.below(64))),
                has_more ? zmq::send_flags::sndmore : zmq::send_flags::none);
    if (has_more) socket.send(zmq::buffer(input.text(input.below(64))), zmq::send_flags::none);
    return;
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
  send(socket, "", type, instance, body);
}

/// Whether the listener has handled all that was sent before, or is done.
bool isHandled(zmq::socket_t& socket, const std::future<std::uint64_t>& taken) {
  send(socket, "", MessageType::Hello, kRobot, {});
  for (const auto start = Clock::now(); secondsSince(start) < kPatience;) {
    if (taken.wait_for(std::chrono::seconds(0)) == std::future_status::ready) return true;
    poll(socket, socket, 0.005);
    while (std::optional<Received> received = receive(socket, false)) {
      received->open();
      if (received->type == MessageType::Welcome) return true;
    }
  }
  return false;
}

std::uint64_t takeAll(FrameListener& listener) {
  std::uint64_t taken = 0;
  fuzz::succeeds([&] {
    while (const std::optional<Frame> frame = listener.next()) {
      fuzz::require(frame->cloud->size() == std::size_t{frame->cloud->width} * frame->cloud->height,
                    "a cloud of the size it says");
      ++taken;
    }
  });
  return taken;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::string address = "ipc://" + fuzz::folder() + "/socket";
  std::atomic<int> events{0};
  ListenerOptions options;
  options.configuration = "version: 1\n";
  options.timeout = 2 * kPatience;
  options.max_frame = 65536;
  options.say = [&events](const std::string& text) {
    ++events;
    fuzz::require(text.find('\033') == std::string::npos, "no control characters are shown");
  };
  FrameListener listener(parseEndpoint(address), options);
  std::future<std::uint64_t> taken =
      std::async(std::launch::async, [&listener] { return takeAll(listener); });

  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::dealer);
  socket.set(zmq::sockopt::linger, 0);
  socket.connect(address);
  for (int i = 0; i < kMaxMessages && input.left() > 0; ++i) sendAny(input, socket);
  // Whichever of them owns the session ends it.
  for (std::uint64_t i = 0; i < kPeers; ++i)
    send(socket, "", MessageType::Bye, i, encode(Bye{ByeReason::Interrupted, ""}));
  fuzz::require(isHandled(socket, taken), "a peer hears from the listener");
  send(socket, "", MessageType::Frame, kRobot, frameOf(inputOf(1), 0));
  send(socket, "", MessageType::End, kRobot, encode(inputOf(1), Count{1}));
  fuzz::require(taken.wait_for(std::chrono::seconds(10)) == std::future_status::ready,
                "a session ends");
  fuzz::require(taken.get() > 0, "a frame gets through");
  fuzz::require(events <= 100, "bounded reports");
  return 0;
}
