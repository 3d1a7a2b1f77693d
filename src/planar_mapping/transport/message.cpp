// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/message.h"

#include <netdb.h>
#include <sys/socket.h>
#include <zmq.h>

#include <cerrno>
#include <charconv>
#include <iterator>
#include <locale>
#include <memory>
#include <sstream>
#include <zmq_addon.hpp>

#include "planar_mapping/transport/endpoint.h"

namespace planar_mapping::transport {
namespace {

constexpr std::uint32_t kMagic = 0x45464D50;  // "PMFE"
constexpr std::uint16_t kProtocolVersion = 7;
constexpr int kLingerMs = 500;      // for goodbyes
constexpr int kHandshakeMs = 5000;  // who connects and says nothing is cut off
// A connection whose machine is gone is closed after kIdle + kProbes * kInterval seconds.
constexpr int kKeepAliveIdle = 5;
constexpr int kKeepAliveInterval = 3;
constexpr int kKeepAliveProbes = 3;
constexpr int kMaxUnsentMs = 15000;  // likewise, with data on its way

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
  if (number < 1 || number > static_cast<std::uint16_t>(MessageType::Bye))
    ByteReader::fail("type", "has an unknown value");
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
               std::size_t max_body) {
  socket.set(zmq::sockopt::linger, kLingerMs);
  // libzmq 4.3.4 aborts where a peer closes a connection whose queue is full, and a heartbeat is
  // due or waits in the queue (restart_input, timer_event): no queue is ever full.
  socket.set(zmq::sockopt::rcvhwm, 0);
  if (!resolved.isIpc() && resolved.host.find(':') != std::string::npos)
    socket.set(zmq::sockopt::ipv6, 1);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(max_body));
  socket.set(zmq::sockopt::handshake_ivl, kHandshakeMs);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, kKeepAliveIdle);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, kKeepAliveInterval);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, kKeepAliveProbes);
  socket.set(zmq::sockopt::tcp_maxrt, kMaxUnsentMs);
  if (keys.secret_key.empty()) return;
  socket.set(zmq::sockopt::curve_secretkey, keys.secret_key);
  socket.set(zmq::sockopt::curve_publickey, keys.public_key);
}

SocketMonitor::SocketMonitor(zmq::context_t& context, zmq::socket_t& socket,
                             const std::string& name, int events)
    : watched_(socket), reader_(context, zmq::socket_type::pair) {
  const std::string address = "inproc://" + name;
  ::zmq_socket_monitor(watched_.handle(), address.c_str(), events);
  reader_.set(zmq::sockopt::rcvhwm, 0);  // ZeroMQ's thread waits where a queue is full
  reader_.connect(address);
}

SocketMonitor::~SocketMonitor() {
  ::zmq_socket_monitor(watched_.handle(), nullptr, 0);
}

std::optional<SocketEvent> SocketMonitor::next() {
  const std::optional<Received> received = receive(reader_, false);
  if (!received) return std::nullopt;
  SocketEvent event;
  ByteReader reader(received->envelope.data(), received->envelope.size());
  reader.number(event.type, "event");
  reader.number(event.value, "value");
  return event;
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

Bytes envelopeOf(MessageType type, std::uint64_t instance) {
  ByteWriter envelope;
  envelope.number(kMagic, "magic");
  envelope.number(kProtocolVersion, "version");
  envelope.number(static_cast<std::uint16_t>(type), "type");
  envelope.number(instance, "instance");
  return std::move(envelope.bytes);
}

Sent send(zmq::socket_t& socket, const std::string& peer, MessageType type, std::uint64_t instance,
          const Bytes& body) {
  const Bytes envelope = envelopeOf(type, instance);
  std::vector<zmq::const_buffer> parts = {zmq::buffer(envelope), zmq::buffer(body)};
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

Endpoint parseEndpoint(const std::string& text) {
  const InputError error("'" + text + "' is not HOST:PORT with a port of 0 to 65535");
  Endpoint endpoint;
  if (text.size() > 6 && Endpoint{text, 0}.isIpc()) return {text, 0};
  const std::size_t colon = text.rfind(':');
  std::string port = text;
  if (colon != std::string::npos) {
    endpoint.host = text.substr(0, colon);
    port = text.substr(colon + 1);
    const bool bracketed =
        endpoint.host.size() > 2 && endpoint.host.front() == '[' && endpoint.host.back() == ']';
    if (bracketed) endpoint.host = endpoint.host.substr(1, endpoint.host.size() - 2);
    if (!bracketed && endpoint.host.find(':') != std::string::npos) throw error;
  }
  const char* const end = port.data() + port.size();
  const auto result = std::from_chars(port.data(), end, endpoint.port);
  const bool is_name =
      !endpoint.host.empty() && endpoint.host.find_first_of(" \t\r\n/[]@;,") == std::string::npos;
  if (port.empty() || result.ec != std::errc() || result.ptr != end || !is_name) throw error;
  return endpoint;
}

std::string toText(const Endpoint& endpoint) {
  if (endpoint.isIpc()) return endpoint.host;
  const bool is_ipv6 = endpoint.host.find(':') != std::string::npos;
  return (is_ipv6 ? "[" + endpoint.host + "]" : endpoint.host) + ":" +
         std::to_string(endpoint.port);
}

Endpoint resolved(const Endpoint& endpoint) {
  if (endpoint.isIpc()) return endpoint;
  // RFC 6761: this name is the loopback, whether or not the machine has a list of hosts.
  if (endpoint.host == "localhost") return {"127.0.0.1", endpoint.port};
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  char address[NI_MAXHOST] = {};
  // IPv4 where there is one.
  for (const int family : {AF_INET, AF_INET6}) {
    hints.ai_family = family;
    const int problem = ::getaddrinfo(endpoint.host.c_str(), nullptr, &hints, &found);
    if (problem != 0 && family == AF_INET) continue;
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
    if (problem != 0 || ::getnameinfo(found->ai_addr, found->ai_addrlen, address, sizeof(address),
                                      nullptr, 0, NI_NUMERICHOST) != 0) {
      throw InputError("the host name '" + endpoint.host +
                       "' cannot be resolved: " + ::gai_strerror(problem));
    }
    break;
  }
  return {address, endpoint.port};
}

bool isLoopback(const Endpoint& endpoint) {
  const std::string host = resolved(endpoint).host;
  return endpoint.isIpc() || host.compare(0, 4, "127.") == 0 || host == "::1";
}

Keys makeKeys() {
  char public_key[41] = {};
  char secret_key[41] = {};
  if (::zmq_curve_keypair(public_key, secret_key) != 0)
    throw Error(std::string("no keys can be made: ") + ::zmq_strerror(::zmq_errno()));
  return {secret_key, public_key, {}};
}

}  // namespace planar_mapping::transport
