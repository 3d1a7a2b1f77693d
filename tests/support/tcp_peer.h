// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

namespace planar_mapping {

/// A TCP connection to 127.0.0.1, or a socket listening there, that speaks no ZeroMQ.
class TcpPeer {
 public:
  static TcpPeer to(std::uint16_t port, double patience_s = 5.0) {
    TcpPeer peer;
    const timeval patience{static_cast<time_t>(patience_s),
                           static_cast<suseconds_t>(1e6 * (patience_s - std::floor(patience_s)))};
    ::setsockopt(peer.descriptor_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
    const sockaddr_in address = loopback(port);
    if (::connect(peer.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) !=
        0) {
      throw std::runtime_error("cannot connect");
    }
    return peer;
  }
  /// On a free port. Connections are made by the system, and nothing is ever answered.
  static TcpPeer listening() {
    TcpPeer peer;
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof(address);
    if (::bind(peer.descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0 ||
        ::listen(peer.descriptor_, 8) != 0 ||
        ::getsockname(peer.descriptor_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      throw std::runtime_error("cannot listen");
    }
    peer.port_ = ntohs(address.sin_port);
    return peer;
  }
  TcpPeer accept() const {
    TcpPeer peer;
    ::close(std::exchange(peer.descriptor_, ::accept(descriptor_, nullptr, nullptr)));
    return peer;
  }
  TcpPeer(TcpPeer&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)), port_(other.port_) {}
  ~TcpPeer() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

  std::uint16_t port() const { return port_; }
  /// \return false if the other side has closed
  bool send(const std::string& bytes) {
    return ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  /// Until so many bytes came, for 5 s at most.
  bool waitForBytes(std::size_t count) {
    const timeval patience{5, 0};
    ::setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    std::string bytes(count, '\0');
    return ::recv(descriptor_, bytes.data(), count, MSG_WAITALL) == static_cast<ssize_t>(count);
  }

 private:
  TcpPeer() : descriptor_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const int yes = 1;  // the port can be taken again at once
    ::setsockopt(descriptor_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  }
  static sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }

  int descriptor_ = -1;
  std::uint16_t port_ = 0;
};

}  // namespace planar_mapping
