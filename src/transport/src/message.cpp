// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/message.h"

#include <zlib.h>

#include <cmath>
#include <limits>

#include "byte_stream.h"
#include "printable.h"

namespace planar_mapping::transport {
namespace {

using detail::ByteReader;
using detail::ByteWriter;

constexpr std::uint32_t kMagic = 0x45464D50;  // "PMFE"
constexpr std::size_t kChecksumOffset = kHeaderBytes - sizeof(std::uint32_t);
constexpr std::size_t kLargestConfiguration = std::size_t{1} << 20U;
constexpr std::uint32_t kLargestWindow = 1024;
constexpr double kLongestTimeout = 1e6;  // seconds

std::uint32_t checksumOf(const std::uint8_t* data, std::size_t size) {
  return static_cast<std::uint32_t>(crc32_z(0, data, size));
}

/// \throws ProtocolError unless value <= last
template <typename Enumeration, typename Integer>
Enumeration enumerationOf(Integer value, Enumeration last, const char* field) {
  if (value > static_cast<Integer>(last)) {
    throw ProtocolError(std::string("field '") + field + "' has the unknown value " +
                        std::to_string(value));
  }
  return static_cast<Enumeration>(value);
}

/// Messages that are one count.
Bytes encodeCount(std::uint64_t count) {
  Bytes bytes;
  ByteWriter(bytes).integer(count);
  return bytes;
}

std::uint64_t decodeCount(const Bytes& body, const char* field) {
  ByteReader reader(body);
  const auto count = reader.integer<std::uint64_t>(field);
  reader.expectEnd();
  return count;
}

}  // namespace

ProtocolError::~ProtocolError() = default;

ForeignProtocolError::~ForeignProtocolError() = default;

VersionError::VersionError(std::uint16_t version)
    : ProtocolError("the peer speaks version " + std::to_string(version) +
                    " of the front-end protocol, this program version " +
                    std::to_string(kProtocolVersion) +
                    "; install the same planar_mapping on both sides") {}
VersionError::~VersionError() = default;

std::size_t largestBody(MessageType type, std::size_t largest_frame) {
  switch (type) {
    case MessageType::Welcome:
      return kLargestWelcomeBody;
    case MessageType::Frame:
      return largest_frame;
    default:
      return kLargestControlBody;
  }
}

HeaderBytes encodeHeader(MessageType type, std::uint64_t session, std::uint64_t sequence,
                         const Bytes& body) {
  if (body.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw InputError("a message of " + std::to_string(body.size()) + " bytes is too long to send");
  }
  Bytes bytes;
  bytes.reserve(kHeaderBytes);
  ByteWriter writer(bytes);
  writer.integer(kMagic);
  writer.integer(kProtocolVersion);
  writer.integer(static_cast<std::uint16_t>(type));
  writer.integer(session);
  writer.integer(sequence);
  writer.integer(static_cast<std::uint32_t>(body.size()));
  writer.integer(checksumOf(body.data(), body.size()));
  writer.integer(checksumOf(bytes.data(), kChecksumOffset));
  HeaderBytes header{};
  std::copy(bytes.begin(), bytes.end(), header.begin());
  return header;
}

void checkMagic(const HeaderBytes& bytes) {
  ByteReader reader(bytes.data(), bytes.size());
  if (reader.integer<std::uint32_t>("magic") != kMagic) {
    throw ForeignProtocolError("these are no messages of a planar_map front-end");
  }
}

MessageHeader decodeHeader(const HeaderBytes& bytes) {
  checkMagic(bytes);
  ByteReader reader(bytes.data() + sizeof(kMagic), bytes.size() - sizeof(kMagic));
  // First of all the version: what follows may look different in another one.
  const auto version = reader.integer<std::uint16_t>("version");
  if (version != kProtocolVersion) throw VersionError(version);
  const auto type = reader.integer<std::uint16_t>("type");
  MessageHeader header;
  header.session = reader.integer<std::uint64_t>("session");
  header.sequence = reader.integer<std::uint64_t>("sequence");
  header.body_bytes = reader.integer<std::uint32_t>("body_bytes");
  header.body_checksum = reader.integer<std::uint32_t>("body_checksum");
  if (reader.integer<std::uint32_t>("header_checksum") !=
      checksumOf(bytes.data(), kChecksumOffset)) {
    throw ProtocolError("the header of a message is damaged (wrong checksum)");
  }
  if (type < static_cast<std::uint16_t>(MessageType::Hello)) {
    throw ProtocolError("field 'type' has the unknown value " + std::to_string(type));
  }
  header.type = enumerationOf(type, MessageType::Bye, "type");
  return header;
}

void checkBody(const MessageHeader& header, const Bytes& body) {
  if (body.size() != header.body_bytes ||
      checksumOf(body.data(), body.size()) != header.body_checksum) {
    throw ProtocolError("a message is damaged (wrong checksum)");
  }
}

Bytes encode(const Hello& message) {
  Bytes bytes;
  ByteWriter writer(bytes);
  writer.integer(message.instance);
  writer.text(message.software);
  return bytes;
}

Hello decodeHello(const Bytes& body) {
  ByteReader reader(body);
  Hello message;
  message.instance = reader.integer<std::uint64_t>("instance");
  message.software = detail::printable(reader.text("software"));
  reader.expectEnd();
  return message;
}

Bytes encode(const Welcome& message) {
  if (message.configuration.size() > kLargestConfiguration) {
    throw InputError("the configuration of the front-end is larger than 1 MiB");
  }
  Bytes bytes;
  ByteWriter writer(bytes);
  writer.text(message.configuration, kLargestConfiguration);
  writer.integer(message.next_frame);
  writer.integer(message.window);
  writer.integer(message.largest_frame);
  writer.real(message.timeout);
  return bytes;
}

Welcome decodeWelcome(const Bytes& body) {
  ByteReader reader(body);
  Welcome message;
  message.configuration = reader.text("configuration", kLargestConfiguration);
  message.next_frame = reader.integer<std::uint64_t>("next_frame");
  message.window = reader.integer<std::uint32_t>("window");
  message.largest_frame = reader.integer<std::uint64_t>("largest_frame");
  message.timeout = reader.real64("timeout");
  reader.expectEnd();
  if (message.window < 1 || message.window > kLargestWindow) {
    throw ProtocolError("field 'window' is not within 1 and " + std::to_string(kLargestWindow));
  }
  if (!(message.timeout > 0.0 && message.timeout <= kLongestTimeout)) {
    throw ProtocolError("field 'timeout' is not within 0 and 1e6 seconds");
  }
  return message;
}

Bytes encode(const Ready& message) {
  Bytes bytes;
  ByteWriter writer(bytes);
  writer.integer(static_cast<std::uint8_t>(message.kind));
  writer.integer(static_cast<std::uint8_t>(message.pose_source));
  writer.integer(message.frames);
  writer.integer(message.fingerprint);
  writer.text(message.name);
  return bytes;
}

Ready decodeReady(const Bytes& body) {
  ByteReader reader(body);
  Ready message;
  message.kind =
      enumerationOf(reader.integer<std::uint8_t>("kind"), io::SequenceKind::Stereo, "kind");
  message.pose_source = enumerationOf(reader.integer<std::uint8_t>("pose_source"),
                                      io::PoseSource::File, "pose_source");
  message.frames = reader.integer<std::uint64_t>("frames");
  message.fingerprint = reader.integer<std::uint64_t>("fingerprint");
  message.name = detail::printable(reader.text("name"));
  reader.expectEnd();
  if (message.frames < 1) throw ProtocolError("field 'frames' is 0: there is nothing to map");
  return message;
}

Bytes encode(const Ack& message) {
  return encodeCount(message.next_frame);
}

Ack decodeAck(const Bytes& body) {
  return {decodeCount(body, "next_frame")};
}

Bytes encode(const Progress& message) {
  return encodeCount(message.frames);
}

Progress decodeProgress(const Bytes& body) {
  return {decodeCount(body, "frames")};
}

Bytes encode(const End& message) {
  return encodeCount(message.frames);
}

End decodeEnd(const Bytes& body) {
  return {decodeCount(body, "frames")};
}

Bytes encode(const Bye& message) {
  Bytes bytes;
  ByteWriter writer(bytes);
  writer.integer(static_cast<std::uint16_t>(message.reason));
  writer.text(message.text);
  return bytes;
}

Bye decodeBye(const Bytes& body) {
  ByteReader reader(body);
  Bye message;
  message.reason =
      enumerationOf(reader.integer<std::uint16_t>("reason"), ByeReason::OtherInput, "reason");
  message.text = detail::printable(reader.text("text"));
  reader.expectEnd();
  return message;
}

}  // namespace planar_mapping::transport
