// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "planar_mapping/base/error.h"
#include "planar_mapping/transport/front_end.h"

namespace planar_mapping::transport {

/// The peer broke the protocol: damaged, cut, too long, contradictory or out of turn.
class ProtocolError : public InputError {
 public:
  using InputError::InputError;
};

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kMaxText = 1024;  ///< bytes of one text; longer ones are cut
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers travel little-endian");

// ByteWriter and ByteReader have the same functions, so that one template lists the fields of a
// message for both directions.
class ByteWriter {
 public:
  Bytes bytes;

  template <typename Number>
  void number(const Number& value, const char* /*field*/) {
    static_assert(std::is_arithmetic_v<Number>);
    put(&value, sizeof(value));
  }
  void size(std::size_t value, const char* field) { number(std::uint64_t{value}, field); }
  template <typename Enumeration>
  void enumeration(Enumeration value, Enumeration /*last*/, const char* field) {
    number(static_cast<std::uint8_t>(value), field);
  }
  void text(const std::string& value, const char* field, std::size_t max_size = kMaxText,
            bool /*raw*/ = false) {
    const std::size_t size = std::min(value.size(), max_size);
    number(static_cast<std::uint32_t>(size), field);
    put(value.data(), size);
  }
  template <typename Items>
  void resize(const Items& items, const char* field, std::size_t /*item_bytes*/,
              std::size_t max_count) {
    if (items.size() > max_count) throw InputError(std::string("too many ") + field);
    number(static_cast<std::uint32_t>(items.size()), field);
  }
  template <typename Value>
  bool optional(const std::optional<Value>& value, const char* field) {
    number(value.has_value(), field);
    return value.has_value();
  }
  void put(const void* data, std::size_t size) {
    const auto* first = static_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), first, first + size);
  }
};

/// Trusts nothing. \throws ProtocolError naming the field
class ByteReader {
 public:
  ByteReader(const void* data, std::size_t size)
      : data_(static_cast<const std::uint8_t*>(data)), end_(data_ + size) {}

  template <typename Number>
  void number(Number& value, const char* field) {
    static_assert(std::is_arithmetic_v<Number>);
    const std::uint8_t* bytes = take(sizeof(value), field);
    if (std::is_same_v<Number, bool> && *bytes > 1) fail(field, "is neither 0 nor 1");
    std::memcpy(&value, bytes, sizeof(value));
  }
  void size(std::size_t& value, const char* field) {
    std::uint64_t read = 0;
    number(read, field);
    value = static_cast<std::size_t>(read);
  }
  template <typename Enumeration>
  void enumeration(Enumeration& value, Enumeration last, const char* field) {
    std::uint8_t read = 0;
    number(read, field);
    if (read > static_cast<std::uint8_t>(last)) fail(field, "has an unknown value");
    value = static_cast<Enumeration>(read);
  }
  /// One line of printable ASCII, unless \p raw: what could disturb a terminal becomes '?'.
  void text(std::string& value, const char* field, std::size_t max_size = kMaxText,
            bool raw = false) {
    const std::size_t size = count(field, 1, max_size);
    value.assign(reinterpret_cast<const char*>(take(size, field)), size);
    const auto is_other = [](char c) { return c < ' ' || c > '~'; };
    if (!raw) std::replace_if(value.begin(), value.end(), is_other, '?');
  }
  /// Takes no memory that was not sent.
  template <typename Items>
  void resize(Items& items, const char* field, std::size_t item_bytes, std::size_t max_count) {
    items.resize(count(field, item_bytes, max_count));
  }
  template <typename Value>
  bool optional(std::optional<Value>& value, const char* field) {
    bool has_value = false;
    number(has_value, field);
    if (has_value) value.emplace();
    return has_value;
  }
  const std::uint8_t* take(std::size_t size, const char* field) {
    if (size > left()) fail(field, "is cut");
    return std::exchange(data_, data_ + size);
  }
  std::size_t left() const { return static_cast<std::size_t>(end_ - data_); }
  void expectEnd() const {
    if (left() > 0) throw ProtocolError(std::to_string(left()) + " bytes follow the last field");
  }
  [[noreturn]] static void fail(const char* field, const std::string& problem) {
    throw ProtocolError(std::string("field '") + field + "' " + problem);
  }

 private:
  std::size_t count(const char* field, std::size_t item_bytes, std::size_t max_count) {
    std::uint32_t count = 0;
    number(count, field);
    if (count > max_count || count > left() / item_bytes) fail(field, "has too many items");
    return count;
  }

  const std::uint8_t* data_;
  const std::uint8_t* end_;
};

/// The front-end asks, the mapping side answers; a front-end has one question in flight.
enum class MessageType : std::uint16_t {
  Hello = 1,    ///< front-end: who it is; no body
  Welcome = 2,  ///< mapping side, to Hello: parameters of the front-end, frames received so far
  Frame = 3,    ///< front-end: its input, position, one frame
  End = 4,      ///< front-end: its input, number of all frames; Bye follows when the map is saved
  Ack = 5,      ///< mapping side, to Frame: frames taken so far
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
  std::uint64_t max_frame = 0;   ///< bytes a body of Frame may have, packed or not
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

// The fields of each message.
template <typename Archive>
void transfer(Archive& archive, Welcome& message) {
  archive.text(message.configuration, "configuration", kMaxConfiguration, true);
  archive.number(message.next_frame, "next_frame");
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
/// not finite arrive as three NaN.
/// \param max_bytes  of all fields but the position, before they are packed
/// \throws InputError beyond it, or for a cloud of another size than it says
Bytes encodeFrame(const InputDescription& input, std::uint64_t position, const Frame& frame,
                  CloudEncoding encoding, std::size_t max_bytes = SIZE_MAX);
/// \param max_bytes  of the fields, once they are unpacked. \throws ProtocolError
Frame decodeFrame(ByteReader& reader, std::size_t max_bytes);

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

constexpr double kPollInterval = 0.05;  ///< seconds between looks at deadlines and at the stop flag

using Clock = std::chrono::steady_clock;
/// Seconds since then.
double secondsSince(Clock::time_point time);
/// "30 s", "0.5 s"
std::string secondsText(double seconds);
std::string zmqAddress(const Endpoint& resolved);
/// Options of both sides: limits, signs of life, keys.
void configure(zmq::socket_t& socket, const Endpoint& resolved, const Keys& keys,
               std::size_t max_body);
/// Does not wait. \param is_router  the first part is the sender
std::optional<Received> receive(zmq::socket_t& socket, bool is_router);

struct SocketEvent {
  std::uint16_t type = 0;   ///< ZMQ_EVENT_...
  std::int32_t value = -1;  ///< of most types: the descriptor of the connection
};

/// What ZeroMQ reports of the connections of a socket; must not outlive it. ZeroMQ's thread would
/// wait for ever for a reader that is gone, so that it is told before.
class SocketMonitor {
 public:
  /// \param name    unlike those of other monitors of the context
  /// \param events  ZMQ_EVENT_...
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, const std::string& name,
                int events);
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  /// Does not wait.
  std::optional<SocketEvent> next();
  zmq::socket_t& reader() { return reader_; }

 private:
  zmq::socket_t& watched_;
  zmq::socket_t reader_;
};

/// The first part of a message, which Received::open() reads.
Bytes envelopeOf(MessageType type, std::uint64_t instance);

enum class Sent { Yes, QueueFull, Unreachable };
/// Does not wait. \param peer  of a ROUTER; else empty
Sent send(zmq::socket_t& socket, const std::string& peer, MessageType type, std::uint64_t instance,
          const Bytes& body);
/// Until one can be read or time is up.
void poll(zmq::socket_t& first, zmq::socket_t& second, double seconds);

}  // namespace planar_mapping::transport
