// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <zmq.hpp>

#include "byte_stream.h"
#include "planar_mapping/transport/front_end.h"

namespace planar_mapping::transport {

enum class MessageType : std::uint16_t {
  Hello = 1,    ///< front-end: who it is; no body
  Welcome = 2,  ///< mapping side: parameters of the front-end, frames received so far
  Frame = 3,    ///< front-end: its input, position, one frame
  End = 4,      ///< front-end: its input, number of all frames
  Ack = 5,      ///< mapping side: frames taken so far
  Bye = 6,      ///< either: the session is over, and why
};

enum class ByeReason : std::uint8_t {
  Done = 0,
  Interrupted = 1,  ///< by its user
  Failed = 2,       ///< the sender cannot continue
  Busy = 3,         ///< another front-end is being served
  Version = 4,      ///< of the protocol
  Protocol = 5,     ///< the receiver broke it
  OtherInput = 6,   ///< not the input the session started with
};

struct Welcome {
  std::string configuration;     ///< YAML
  std::uint64_t next_frame = 0;  ///< frames received so far
  std::uint32_t window = 1;      ///< frames that may be sent ahead of those acknowledged
  std::uint64_t max_frame = 0;   ///< bytes a body of Frame may have
};
struct Count {  ///< End, Ack
  std::uint64_t frames = 0;
};
struct Bye {
  ByeReason reason = ByeReason::Done;
  std::string text;
};

/// What a front-end reports of its input. The same input gives the same description.
struct InputDescription {
  io::SequenceKind kind = io::SequenceKind::Clouds;
  io::PoseSource pose_source = io::PoseSource::None;
  std::uint64_t frames = 0;       ///< in all, 1 to 1e9
  std::uint64_t fingerprint = 0;  ///< of the file names, without directories
  std::string name;               ///< for messages
};
InputDescription describe(const FrameSource& source);

constexpr std::size_t kMaxConfiguration = std::size_t{1} << 20U;  // bytes
constexpr std::size_t kMaxControlBody = kMaxConfiguration + 65536;
constexpr std::uint32_t kMaxWindow = 1024;

// The fields of each message.
template <typename Archive>
void transfer(Archive& archive, Welcome& message) {
  archive.text(message.configuration, "configuration", kMaxConfiguration, true);
  archive.number(message.next_frame, "next_frame");
  archive.number(message.window, "window");
  archive.number(message.max_frame, "max_frame");
}
template <typename Archive>
void transfer(Archive& archive, Count& message) {
  archive.number(message.frames, "frames");
}
template <typename Archive>
void transfer(Archive& archive, Bye& message) {
  archive.enumeration(message.reason, ByeReason::OtherInput, "reason");
  archive.text(message.text, "text");
}
template <typename Archive>
void transfer(Archive& archive, InputDescription& message) {
  archive.enumeration(message.kind, io::SequenceKind::Stereo, "kind");
  archive.enumeration(message.pose_source, io::PoseSource::File, "pose_source");
  archive.number(message.frames, "frames");
  archive.number(message.fingerprint, "fingerprint");
  archive.text(message.name, "name");
}

/// The bodies of some messages, one after the other.
template <typename... Messages>
Bytes encode(Messages... messages) {
  ByteWriter writer;
  (transfer(writer, messages), ...);
  return std::move(writer.bytes);
}
/// \throws ProtocolError
template <typename Message>
Message decode(ByteReader& reader) {
  Message message;
  transfer(reader, message);
  return message;
}

/// What the front-end made of a frame, after its position among those sent: cloud, key features,
/// given pose, camera, statistics, notes, the left image in gray. Points with a coordinate that is
/// not finite arrive as three NaN. \throws InputError for what the receiver would refuse
Bytes encodeFrame(const InputDescription& input, std::uint64_t position, const Frame& frame,
                  CloudEncoding encoding);
/// \param max_points  of a cloud, holes counted. \throws ProtocolError
Frame decodeFrame(ByteReader& reader, std::size_t max_points);

void writeCloud(ByteWriter& writer, const FrameCloud& cloud,
                const std::optional<PinholeCamera>& camera, CloudEncoding encoding);
FrameCloud::Ptr readCloud(ByteReader& reader, const std::optional<PinholeCamera>& camera,
                          std::size_t max_points);

/// A message as it arrived: envelope and body, from a ROUTER also its sender.
struct Received {
  std::string peer;
  zmq::message_t envelope;
  zmq::message_t body;
  MessageType type = MessageType::Bye;
  std::uint64_t instance = 0;  ///< of the front-end: random, the same for all its connections

  /// Reads the envelope. \throws ProtocolError; VersionError
  void open();
  ByteReader reader() const { return {body.data(), body.size()}; }
};
struct VersionError : ProtocolError {
  using ProtocolError::ProtocolError;
};

using Clock = std::chrono::steady_clock;
/// Seconds since then.
double secondsSince(Clock::time_point time);
/// "30 s", "0.5 s"
std::string secondsText(double seconds);
std::string zmqAddress(const Endpoint& resolved);
/// Options of both sides: limits, heartbeats, keys.
void configure(zmq::socket_t& socket, const Endpoint& resolved, const Keys& keys,
               std::size_t max_body, double timeout);
/// Does not wait. \param is_router  the first part is the sender
std::optional<Received> receive(zmq::socket_t& socket, bool is_router);
enum class Sent { Yes, QueueFull, Unreachable };
/// Does not wait. \param peer  of a ROUTER; else empty
Sent send(zmq::socket_t& socket, const std::string& peer, MessageType type, std::uint64_t instance,
          const Bytes& body);
/// Until one can be read or time is up.
void poll(zmq::socket_t& first, zmq::socket_t& second, double seconds);

}  // namespace planar_mapping::transport
