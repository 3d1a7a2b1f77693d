// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "stream_socket.h"

#include <algorithm>
#include <cerrno>
#include <chrono>

namespace planar_mapping::transport::detail {
namespace {

constexpr int kQueuedChunks = 256;  // of 8 kB at most, for each peer and direction
constexpr int kLingerMs = 500;      // for goodbyes
constexpr int kReconnectMs = 100;   // and from there up to
constexpr int kLongestReconnectMs = 1000;

std::string zmqAddress(const Endpoint& endpoint) {
  return "tcp://" + toText(endpoint);
}

std::string advice(int error_number) {
  switch (error_number) {
    case EADDRINUSE:
      return "another program listens there; choose another port, or 0 for any free one";
    case EACCES:
    case EPERM:
      return "this needs more rights; choose a port from 1024 on";
    case EADDRNOTAVAIL:
    case ENODEV:
      return "this machine has no such address; give one of its own, or 0.0.0.0 for all";
    default:
      return zmq_strerror(error_number);
  }
}

}  // namespace

StreamSocket::StreamSocket() : context_(1), socket_(context_, zmq::socket_type::stream) {
  socket_.set(zmq::sockopt::linger, kLingerMs);
  socket_.set(zmq::sockopt::sndhwm, kQueuedChunks);
  socket_.set(zmq::sockopt::rcvhwm, kQueuedChunks);
  socket_.set(zmq::sockopt::reconnect_ivl, kReconnectMs);
  socket_.set(zmq::sockopt::reconnect_ivl_max, kLongestReconnectMs);
  socket_.set(zmq::sockopt::tcp_keepalive, 1);
}

Endpoint StreamSocket::bind(const Endpoint& endpoint) {
  const Endpoint numeric = resolved(endpoint);
  try {
    if (numeric.host.find(':') != std::string::npos) socket_.set(zmq::sockopt::ipv6, 1);
    socket_.bind(zmqAddress(numeric));
  } catch (const zmq::error_t& error) {
    throw InputError("cannot listen on " + toText(endpoint) + ": " + advice(error.num()));
  }
  const std::string bound = socket_.get(zmq::sockopt::last_endpoint);
  return {endpoint.host, parseEndpoint(bound.substr(std::string("tcp://").size())).port};
}

void StreamSocket::connect(const Endpoint& endpoint) {
  const Endpoint numeric = resolved(endpoint);
  try {
    if (numeric.host.find(':') != std::string::npos) socket_.set(zmq::sockopt::ipv6, 1);
    socket_.connect(zmqAddress(numeric));
  } catch (const zmq::error_t& error) {
    throw InputError("cannot connect to " + toText(endpoint) + ": " + advice(error.num()));
  }
}

std::optional<StreamEvent> StreamSocket::receive() {
  zmq::message_t peer;
  StreamEvent event;
  if (!receivePart(peer)) return std::nullopt;
  while (!receivePart(event.data)) continue;  // the parts of a message arrive together
  event.peer = peer.to_string();
  if (event.data.size() == 0) {
    const bool is_new = peers_.insert(event.peer).second;
    if (!is_new) peers_.erase(event.peer);
    event.kind = is_new ? StreamEvent::Kind::Connected : StreamEvent::Kind::Disconnected;
  }
  return event;
}

bool StreamSocket::receivePart(zmq::message_t& part) {
  try {
    return socket_.recv(part, zmq::recv_flags::dontwait).has_value();
  } catch (const zmq::error_t& error) {
    if (error.num() == EINTR) return false;  // a signal; who waits looks at its flag
    throw;
  }
}

void StreamSocket::wait(double seconds, int wake_descriptor) {
  zmq::pollitem_t items[] = {{socket_.handle(), 0, ZMQ_POLLIN, 0},
                             {nullptr, wake_descriptor, ZMQ_POLLIN, 0}};
  const auto milliseconds =
      std::chrono::milliseconds(static_cast<long>(1000.0 * std::max(0.0, seconds) + 0.5));
  try {
    zmq::poll(items, wake_descriptor >= 0 ? 2U : 1U, milliseconds);
  } catch (const zmq::error_t& error) {
    if (error.num() != EINTR) throw;
  }
}

bool StreamSocket::send(const std::string& peer, const void* data, std::size_t size) {
  return sendPart(peer.data(), peer.size(), zmq::send_flags::sndmore) &&
         sendPart(data, size, zmq::send_flags::none);
}

/// \return false if the peer is gone or its queue is full
bool StreamSocket::sendPart(const void* data, std::size_t size, zmq::send_flags flags) {
  for (;;) {
    try {
      return socket_.send(zmq::buffer(data, size), flags | zmq::send_flags::dontwait).has_value();
    } catch (const zmq::error_t& error) {
      if (error.num() == EINTR) continue;
      if (error.num() == EHOSTUNREACH) return false;
      throw;
    }
  }
}

}  // namespace planar_mapping::transport::detail
