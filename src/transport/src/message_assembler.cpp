// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/detail/message_assembler.h"

#include <algorithm>

namespace planar_mapping::transport::detail {
namespace {

constexpr std::size_t kMagicBytes = 4;

}  // namespace

void MessageAssembler::feed(const std::uint8_t* data, std::size_t size, const Limit& limit,
                            const Sink& sink) {
  const std::uint8_t* const end = data + size;
  while (data != end) {
    if (header_size_ < kHeaderBytes) {
      const std::size_t count =
          std::min(static_cast<std::size_t>(end - data), kHeaderBytes - header_size_);
      std::copy_n(data, count, header_bytes_.begin() + static_cast<std::ptrdiff_t>(header_size_));
      data += count;
      header_size_ += count;
      if (header_size_ >= kMagicBytes && header_size_ < kHeaderBytes) {
        checkMagic(header_bytes_);  // somebody else's protocol may never send a whole header
      }
      if (header_size_ < kHeaderBytes) return;
      startBody(limit);
    }
    const std::size_t count =
        std::min(static_cast<std::size_t>(end - data), header_.body_bytes - body_.size());
    body_.insert(body_.end(), data, data + count);
    data += count;
    if (body_.size() < header_.body_bytes) return;
    checkBody(header_, body_);
    header_size_ = 0;
    ++messages_;
    sink(header_, body_);
    body_.clear();
  }
}

void MessageAssembler::startBody(const Limit& limit) {
  header_ = decodeHeader(header_bytes_);
  if (header_.sequence != messages_) {
    throw ProtocolError("message " + std::to_string(header_.sequence) + " came where message " +
                        std::to_string(messages_) + " was due");
  }
  const std::size_t largest = limit(header_);
  if (header_.body_bytes > largest) {
    throw ProtocolError("a message of " + std::to_string(header_.body_bytes) +
                        " bytes is longer than the " + std::to_string(largest) + " allowed");
  }
}

HeaderBytes MessageSealer::seal(MessageType type, std::uint64_t session, const Bytes& body) {
  return encodeHeader(type, session, messages_++, body);
}

}  // namespace planar_mapping::transport::detail
