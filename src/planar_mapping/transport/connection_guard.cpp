// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/connection_guard.h"

#include <fcntl.h>
#include <linux/filter.h>
#include <sys/socket.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace planar_mapping::transport {
namespace {

constexpr std::size_t kMaxConnections = 64;
constexpr int kBacklog = 32;  // connections that the system takes before ZeroMQ does
// Descriptors kept for saving: those of files, and of connections of the backlog.
constexpr int kReserved = 32 + kBacklog;
constexpr int kEvents = ZMQ_EVENT_LISTENING | ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_DISCONNECTED;

}  // namespace

ConnectionGuard::ConnectionGuard(zmq::context_t& context, zmq::socket_t& listener)
    : monitor_(context, listener, "connections", kEvents) {
  listener.set(zmq::sockopt::backlog, kBacklog);
  for (int i = 0; i < kReserved; ++i) {
    const int descriptor = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (descriptor >= 0) reserved_.push_back(descriptor);
  }
}

ConnectionGuard::~ConnectionGuard() {
  for (const int descriptor : reserved_) ::close(descriptor);
}

void ConnectionGuard::protect(zmq::message_t& part) {
  protects_ = true;
  protected_ = ::zmq_msg_get(part.handle(), ZMQ_SRCFD);
}

void ConnectionGuard::watch() {
  while (const std::optional<SocketEvent> event = monitor_.next()) {
    if (event->type == ZMQ_EVENT_LISTENING) listening_ = event->value;
    if (event->type == ZMQ_EVENT_ACCEPTED) connections_.push_back(event->value);
    if (event->type != ZMQ_EVENT_DISCONNECTED) continue;
    connections_.erase(std::remove(connections_.begin(), connections_.end(), event->value),
                       connections_.end());
  }
  closeOldest(kMaxConnections);
}

void ConnectionGuard::closeOldest(std::size_t kept) {
  if (protects_ && protected_ < 0) return;
  for (std::size_t i = 0; i < connections_.size() && connections_.size() > kept;) {
    if (connections_[i] == protected_) {
      ++i;
      continue;
    }
    ::shutdown(connections_[i], SHUT_RDWR);  // ZeroMQ notices, and gives the descriptor back
    connections_.erase(connections_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void ConnectionGuard::close(const Endpoint& endpoint) {
  watch();
  // zmq_unbind() would close all connections. A filter that passes nothing lets no new one in.
  sock_filter nothing = BPF_STMT(BPF_RET | BPF_K, 0);
  const sock_fprog filter{1, &nothing};
  ::setsockopt(listening_, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof(filter));
  if (endpoint.isIpc()) {
    std::error_code ignored;
    std::filesystem::remove(endpoint.host.substr(std::string("ipc://").size()), ignored);
  }
  closeOldest(0);
  for (const int descriptor : std::exchange(reserved_, {})) ::close(descriptor);
}

}  // namespace planar_mapping::transport
