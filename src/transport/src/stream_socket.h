// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <set>
#include <string>
#include <zmq.hpp>

#include "planar_mapping/transport/endpoint.h"
#include "planar_mapping/transport/message.h"

namespace planar_mapping::transport::detail {

struct StreamEvent {
  enum class Kind { Connected, Data, Disconnected };
  Kind kind = Kind::Data;
  std::string peer;
  zmq::message_t data;
};

/// Plain TCP through ZeroMQ (ZMQ_STREAM): it connects, reconnects, queues and tells who comes and
/// goes, but reads nothing into what is sent. Messages are ours, so that their size is checked
/// before memory is taken; a ROUTER would first collect all parts of a message, however many.
class StreamSocket {
 public:
  StreamSocket();

  /// \return where it listens, with the port that was taken
  /// \throws InputError: port in use, not allowed, address not of this machine
  Endpoint bind(const Endpoint& endpoint);
  /// Tries again and again until the peer is there (StreamEvent::Kind::Connected).
  void connect(const Endpoint& endpoint);

  /// What has come, if anything. Does not wait.
  std::optional<StreamEvent> receive();
  /// Waits until something can be received, \p wake_descriptor can be read, or time is up.
  void wait(double seconds, int wake_descriptor = -1);

  /// Queues bytes. \return false if the peer is gone or reads nothing
  bool send(const std::string& peer, const void* data, std::size_t size);
  bool close(const std::string& peer) { return send(peer, "", 0); }

 private:
  bool receivePart(zmq::message_t& part);
  bool sendPart(const void* data, std::size_t size, zmq::send_flags flags);

  zmq::context_t context_;
  zmq::socket_t socket_;
  std::set<std::string> peers_;
};

}  // namespace planar_mapping::transport::detail
