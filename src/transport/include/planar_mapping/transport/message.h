// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/base/export.h"
#include "planar_mapping/io/sequence.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping {
namespace transport {

/// The peer broke the protocol of docs/dev/front_end_protocol.md: damaged, cut, too long,
/// contradictory or out of turn. The message says what, in one sentence.
class PLANAR_MAPPING_EXPORT ProtocolError : public InputError {
 public:
  using InputError::InputError;
  ~ProtocolError() override;
};

/// The peer speaks another version of the protocol.
class PLANAR_MAPPING_EXPORT VersionError : public ProtocolError {
 public:
  explicit VersionError(std::uint16_t version);
  ~VersionError() override;
};

/// What comes is no message at all: another protocol, or noise.
class PLANAR_MAPPING_EXPORT ForeignProtocolError : public ProtocolError {
 public:
  using ProtocolError::ProtocolError;
  ~ForeignProtocolError() override;
};

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint16_t kProtocolVersion = 1;
constexpr std::size_t kHeaderBytes = 36;

enum class MessageType : std::uint16_t {
  Hello = 1,     ///< front-end: here I am
  Welcome = 2,   ///< mapping side: parameters of the front-end, first frame wanted
  Ready = 3,     ///< front-end: what its input is
  Frame = 4,     ///< front-end: one frame
  Ack = 5,       ///< mapping side: frames taken so far; also sign of life
  Progress = 6,  ///< front-end: frames done again without being sent; sign of life
  End = 7,       ///< front-end: no frame follows
  Bye = 8,       ///< either: the session is over, and why
};

/// Fixed size, in front of every body.
struct MessageHeader {
  MessageType type = MessageType::Bye;
  std::uint64_t session = 0;   ///< of the Welcome; 0 before it
  std::uint64_t sequence = 0;  ///< messages sent before on this connection, in this direction
  std::uint32_t body_bytes = 0;
  std::uint32_t body_checksum = 0;  ///< CRC-32 (IEEE 802.3) of the body
};

/// Who starts a session. `instance` tells a front-end that lost its connection from another one.
struct Hello {
  std::uint64_t instance = 0;
  std::string software;  ///< name and version, for messages
};

struct Welcome {
  std::string configuration;        ///< YAML: stages of the front-end, which frames, seed, profile
  std::uint64_t next_frame = 0;     ///< position of the first frame wanted
  std::uint32_t window = 1;         ///< frames that may be sent ahead of Ack::next_frame, >= 1
  std::uint64_t largest_frame = 0;  ///< bytes a message may have
  double timeout = 0.0;             ///< seconds the mapping side waits for a frame
};

struct Ready {
  io::SequenceKind kind = io::SequenceKind::Clouds;
  io::PoseSource pose_source = io::PoseSource::None;
  std::uint64_t frames = 0;       ///< there are in all, >= 1
  std::uint64_t fingerprint = 0;  ///< of the input: the same one after a restart
  std::string name;               ///< of the input, for messages
};

struct Ack {
  std::uint64_t next_frame = 0;  ///< all before it were taken
};

struct Progress {
  std::uint64_t frames = 0;  ///< done again so far
};

struct End {
  std::uint64_t frames = 0;  ///< sent in all
};

enum class ByeReason : std::uint16_t {
  Done = 0,         ///< nothing is left to do
  Interrupted = 1,  ///< by its user
  Failed = 2,       ///< the sender cannot go on
  Busy = 3,         ///< another front-end is being served
  Version = 4,      ///< of the protocol
  Protocol = 5,     ///< the receiver broke it
  OtherInput = 6,   ///< not the input the session started with
};

struct Bye {
  ByeReason reason = ByeReason::Done;
  std::string text;
};

/// How points travel. Both are exact to the last bit.
enum class CloudEncoding : std::uint8_t {
  Raw = 0,      ///< a bit per point and three floats for each that is finite
  Compact = 1,  ///< differences to the ray of the pixel; needs a camera, else Raw is used
};

/// The largest bodies that are accepted; control messages are small.
constexpr std::size_t kLargestControlBody = 8192;
constexpr std::size_t kLargestWelcomeBody = (std::size_t{1} << 20U) + kLargestControlBody;
constexpr std::size_t kDefaultLargestFrame = std::size_t{64} << 20U;
constexpr std::size_t kLargestText = 4096;  ///< bytes of one text, but for the configuration

/// Points a frame may have where messages may have so many bytes: three floats each.
constexpr std::size_t largestPoints(std::size_t largest_frame) {
  return largest_frame / (3 * sizeof(float));
}
/// \return body_bytes a message of this type may have at most
PLANAR_MAPPING_EXPORT std::size_t largestBody(MessageType type, std::size_t largest_frame);

using HeaderBytes = std::array<std::uint8_t, kHeaderBytes>;
/// Header of a body, its size and checksum filled in. \throws InputError beyond 4 GiB
PLANAR_MAPPING_EXPORT HeaderBytes encodeHeader(MessageType type, std::uint64_t session,
                                               std::uint64_t sequence, const Bytes& body);
/// The first four bytes are enough. \throws ForeignProtocolError
PLANAR_MAPPING_EXPORT void checkMagic(const HeaderBytes& bytes);
/// \throws ForeignProtocolError, VersionError; ProtocolError: wrong checksum, unknown type
PLANAR_MAPPING_EXPORT MessageHeader decodeHeader(const HeaderBytes& bytes);
/// \throws ProtocolError if the body is not the one the header announces
PLANAR_MAPPING_EXPORT void checkBody(const MessageHeader& header, const Bytes& body);

PLANAR_MAPPING_EXPORT Bytes encode(const Hello& message);
PLANAR_MAPPING_EXPORT Bytes encode(const Welcome& message);
PLANAR_MAPPING_EXPORT Bytes encode(const Ready& message);
PLANAR_MAPPING_EXPORT Bytes encode(const Ack& message);
PLANAR_MAPPING_EXPORT Bytes encode(const Progress& message);
PLANAR_MAPPING_EXPORT Bytes encode(const End& message);
PLANAR_MAPPING_EXPORT Bytes encode(const Bye& message);

/// Every field is checked, and nothing may follow the last one. \throws ProtocolError
PLANAR_MAPPING_EXPORT Hello decodeHello(const Bytes& body);
PLANAR_MAPPING_EXPORT Welcome decodeWelcome(const Bytes& body);
PLANAR_MAPPING_EXPORT Ready decodeReady(const Bytes& body);
PLANAR_MAPPING_EXPORT Ack decodeAck(const Bytes& body);
PLANAR_MAPPING_EXPORT Progress decodeProgress(const Bytes& body);
PLANAR_MAPPING_EXPORT End decodeEnd(const Bytes& body);
PLANAR_MAPPING_EXPORT Bye decodeBye(const Bytes& body);

/// A frame as it travels.
struct FrameMessage {
  std::uint64_t position = 0;  ///< among the frames that are sent, from 0
  Frame frame;                 ///< front_end_done is set on receipt
};

/// What the front-end made of a frame: cloud, key features, pose given from outside, camera,
/// statistics, notes. Images stay behind. Points with a coordinate that is not finite arrive as
/// three quiet NaN. Texts are cut at kLargestText bytes.
/// \throws InputError if the frame could not be decoded again: a size or value out of range
PLANAR_MAPPING_EXPORT Bytes encodeFrame(const Frame& frame, std::uint64_t position,
                                        CloudEncoding encoding = CloudEncoding::Compact);
/// \param largest_points  a cloud may have, holes counted: memory is taken for all of them
/// \throws ProtocolError
PLANAR_MAPPING_EXPORT FrameMessage decodeFrame(const Bytes& body, std::size_t largest_points);

}  // namespace transport
}  // namespace planar_mapping
