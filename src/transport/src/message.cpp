// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "message.h"

#include <cerrno>
#include <iterator>
#include <locale>
#include <sstream>
#include <zmq_addon.hpp>

namespace planar_mapping::transport {
namespace {

constexpr std::uint32_t kMagic = 0x45464D50;  // "PMFE"
constexpr std::uint16_t kProtocolVersion = 4;
constexpr int kLingerMs = 500;      // for goodbyes
constexpr int kHandshakeMs = 5000;  // who connects and says nothing is cut off
constexpr int kHeartbeatMs = 1000;
constexpr int kMinHeartbeatTimeoutMs = 2000;
constexpr int kMaxQueued = static_cast<int>(kMaxWindow);  // messages to one peer

}  // namespace

void Received::open() {
  ByteReader reader(envelope.data(), envelope.size());
  std::uint32_t magic = 0;
  std::uint16_t version = 0;
  std::uint16_t number = 0;
  if (envelope.size() >= sizeof(magic)) reader.number(magic, "magic");
  if (magic != kMagic) throw ProtocolError("these are no messages of a planar_map front-end");
  reader.number(version, "version");
  if (version != kProtocolVersion) {
    throw VersionError("the peer speaks version " + std::to_string(version) +
                       " of the front-end protocol, this program version " +
                       std::to_string(kProtocolVersion) +
                       "; install the same planar_mapping on both sides");
  }
  reader.number(number, "type");
  if (number < 1 || number > static_cast<std::uint16_t>(MessageType::Bye)) {
    ByteReader::fail("type", "has an unknown value");
  }
  type = static_cast<MessageType>(number);
  reader.number(instance, "instance");
  reader.expectEnd();
}

double secondsSince(Clock::time_point time) {
  return std::chrono::duration<double>(Clock::now() - time).count();
}

std::string secondsText(double seconds) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << seconds << " s";
  return text.str();
}

std::string zmqAddress(const Endpoint& resolved) {
  return resolved.isIpc() ? resolved.host : "tcp://" + toText(resolved);
}

void configure(zmq::socket_t& socket, const Endpoint& resolved, const Keys& keys,
               std::size_t max_body, double timeout) {
  socket.set(zmq::sockopt::linger, kLingerMs);
  socket.set(zmq::sockopt::sndhwm, kMaxQueued);
  if (!resolved.isIpc() && resolved.host.find(':') != std::string::npos) {
    socket.set(zmq::sockopt::ipv6, 1);
  }
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(max_body));
  socket.set(zmq::sockopt::handshake_ivl, kHandshakeMs);
  socket.set(zmq::sockopt::heartbeat_ivl, kHeartbeatMs);
  socket.set(zmq::sockopt::heartbeat_timeout,
             std::max(kMinHeartbeatTimeoutMs, static_cast<int>(500.0 * std::min(timeout, 1e4))));
  if (keys.secret_key.empty()) return;
  socket.set(zmq::sockopt::curve_secretkey, keys.secret_key);
  socket.set(zmq::sockopt::curve_publickey, keys.public_key);
}

std::optional<Received> receive(zmq::socket_t& socket, bool is_router) {
  std::vector<zmq::message_t> parts;
  try {
    const auto flags = zmq::recv_flags::dontwait;
    if (!zmq::recv_multipart(socket, std::back_inserter(parts), flags)) return std::nullopt;
  } catch (const zmq::error_t& error) {
    if (error.num() == EINTR) return std::nullopt;
    throw;
  }
  Received received;
  parts.resize(3);  // no message has more
  std::size_t i = 0;
  if (is_router) received.peer = parts[i++].to_string();
  received.envelope = std::move(parts[i++]);
  received.body = std::move(parts[i]);
  return received;
}

Sent send(zmq::socket_t& socket, const std::string& peer, MessageType type, std::uint64_t instance,
          const Bytes& body) {
  ByteWriter envelope;
  envelope.number(kMagic, "magic");
  envelope.number(kProtocolVersion, "version");
  envelope.number(static_cast<std::uint16_t>(type), "type");
  envelope.number(instance, "instance");
  std::vector<zmq::const_buffer> parts = {zmq::buffer(envelope.bytes), zmq::buffer(body)};
  if (!peer.empty()) parts.insert(parts.begin(), zmq::buffer(peer));
  try {
    return zmq::send_multipart(socket, parts, zmq::send_flags::dontwait) ? Sent::Yes
                                                                         : Sent::QueueFull;
  } catch (const zmq::error_t& error) {
    if (error.num() == EHOSTUNREACH) return Sent::Unreachable;
    if (error.num() == EINTR) return Sent::QueueFull;
    throw;
  }
}

void poll(zmq::socket_t& first, zmq::socket_t& second, double seconds) {
  zmq::pollitem_t items[] = {{first.handle(), 0, ZMQ_POLLIN, 0},
                             {second.handle(), 0, ZMQ_POLLIN, 0}};
  try {
    zmq::poll(items, 2U, std::chrono::milliseconds(static_cast<long>(1000.0 * seconds)));
  } catch (const zmq::error_t& error) {
    if (error.num() != EINTR) throw;  // a signal: who waits looks at its flag
  }
}

}  // namespace planar_mapping::transport
