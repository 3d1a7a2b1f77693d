// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>
#include <zmq.hpp>

#include "planar_mapping/transport/endpoint.h"
#include "planar_mapping/transport/message.h"

namespace planar_mapping::transport {

/// Keeps connections of strangers from using up the descriptors of the process.
class ConnectionGuard {
 public:
  /// Before the socket is bound. Takes the descriptors that close() gives back.
  ConnectionGuard(zmq::context_t& context, zmq::socket_t& listener);
  ~ConnectionGuard();
  ConnectionGuard(const ConnectionGuard&) = delete;
  ConnectionGuard& operator=(const ConnectionGuard&) = delete;

  /// The connection by which a message came, and no other, is never closed.
  void protect(zmq::message_t& part);
  /// Closes the oldest connections beyond the limit.
  void watch();
  /// No connection is taken from here on; those of strangers are closed, and descriptors are there.
  void close(const Endpoint& endpoint);

 private:
  void closeOldest(std::size_t kept);

  SocketMonitor monitor_;
  int listening_ = -1;            ///< descriptor
  std::vector<int> connections_;  ///< descriptors, the oldest first
  bool protects_ = false;
  int protected_ = -1;         ///< descriptor; -1 = not known
  std::vector<int> reserved_;  ///< descriptors
};

}  // namespace planar_mapping::transport
