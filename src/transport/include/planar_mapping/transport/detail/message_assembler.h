// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "planar_mapping/transport/message.h"

namespace planar_mapping {
namespace transport {
namespace detail {

/// Cuts the bytes of one connection into messages. Memory grows with what has arrived, never with
/// what is announced.
class PLANAR_MAPPING_EXPORT MessageAssembler {
 public:
  /// Bytes a body of this header may have; asked before the first of them is taken.
  /// Throws ProtocolError if such a message may not come now.
  using Limit = std::function<std::size_t(const MessageHeader&)>;
  using Sink = std::function<void(const MessageHeader&, const Bytes&)>;

  /// \throws ProtocolError, also what \p limit and \p sink throw; the connection is then useless
  void feed(const std::uint8_t* data, std::size_t size, const Limit& limit, const Sink& sink);

 private:
  void startBody(const Limit& limit);

  HeaderBytes header_bytes_{};
  std::size_t header_size_ = 0;  ///< bytes of it that are here
  MessageHeader header_;
  Bytes body_;
  std::uint64_t messages_ = 0;
};

/// Puts headers before bodies, and counts.
class PLANAR_MAPPING_EXPORT MessageSealer {
 public:
  HeaderBytes seal(MessageType type, std::uint64_t session, const Bytes& body);

 private:
  std::uint64_t messages_ = 0;
};

}  // namespace detail
}  // namespace transport
}  // namespace planar_mapping
