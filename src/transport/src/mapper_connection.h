// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <optional>

#include "duration.h"
#include "planar_mapping/transport/detail/message_assembler.h"
#include "stream_socket.h"

namespace planar_mapping::transport::detail {

/// One connection of a front-end to the mapping side, from Hello to Bye. Never waits longer than
/// it is told to.
class MapperConnection {
 public:
  /// Starts to connect. \throws InputError if the name cannot be resolved
  MapperConnection(const Endpoint& endpoint, std::uint64_t instance);

  /// Takes what comes, and waits for something to come until time is up.
  /// \throws ProtocolError
  void pump(double seconds);
  /// \return false if the connection is lost
  bool send(MessageType type, const Bytes& body);

  bool isConnected() const { return peer_.has_value(); }
  bool isLost() const { return lost_; }
  const std::optional<Welcome>& welcome() const { return welcome_; }
  const std::optional<Bye>& bye() const { return bye_; }
  /// Frames the mapping side has taken.
  std::uint64_t acknowledged() const { return acknowledged_; }
  /// One more frame went out.
  void countFrame() { ++sent_; }
  Clock::time_point heardAt() const { return heard_at_; }

 private:
  std::size_t limitFor(const MessageHeader& header) const;
  void handle(const MessageHeader& header, const Bytes& body);
  void handleAck(const Ack& ack);

  std::uint64_t instance_;
  StreamSocket socket_;
  MessageAssembler assembler_;
  MessageSealer sealer_;
  std::optional<std::string> peer_;
  std::optional<Welcome> welcome_;
  std::optional<Bye> bye_;
  bool lost_ = false;
  std::uint64_t session_ = 0;
  std::uint64_t acknowledged_ = 0;
  std::uint64_t sent_ = 0;  ///< position of the next frame to be sent
  Clock::time_point heard_at_;
};

}  // namespace planar_mapping::transport::detail
