// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

namespace planar_mapping {

/// A TCP connection or a listening socket on 127.0.0.1 that does whatever a test wants.
class TcpPeer {
 public:
  /// Connects.
  static TcpPeer to(std::uint16_t port) {
    TcpPeer peer;
    sockaddr_in address = loopback(port);
    if (::connect(peer.descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) {
      throw std::runtime_error("cannot connect");
    }
    return peer;
  }
  /// Listens on a free port.
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
    TcpPeer peer(::accept(descriptor_, nullptr, nullptr));
    if (peer.descriptor_ < 0) throw std::runtime_error("cannot accept");
    return peer;
  }

  TcpPeer(TcpPeer&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)), port_(other.port_) {}
  TcpPeer(const TcpPeer&) = delete;
  TcpPeer& operator=(const TcpPeer&) = delete;
  ~TcpPeer() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

  std::uint16_t port() const { return port_; }
  /// \return false if the other side has closed
  bool send(const std::string& bytes) {
    return ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  template <typename Container>
  bool sendBytes(const Container& bytes) {
    return send(std::string(bytes.begin(), bytes.end()));
  }
  /// What the other side sends until it closes or time is up.
  std::string readAll(double seconds, bool* closed = nullptr) {
    std::string all;
    char buffer[65536];
    if (closed != nullptr) *closed = false;
    pollfd item = {descriptor_, POLLIN, 0};
    while (::poll(&item, 1, static_cast<int>(1000.0 * seconds)) > 0) {
      const ssize_t count = ::recv(descriptor_, buffer, sizeof(buffer), 0);
      if (count <= 0) {
        if (closed != nullptr) *closed = true;
        break;
      }
      all.append(buffer, static_cast<std::size_t>(count));
    }
    return all;
  }

 private:
  TcpPeer() : TcpPeer(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {}
  explicit TcpPeer(int descriptor) : descriptor_(descriptor) {
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
