// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/endpoint.h"

#include <netdb.h>
#include <sys/socket.h>
#include <zmq.h>

#include <charconv>
#include <memory>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::transport {

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
  if (::zmq_curve_keypair(public_key, secret_key) != 0) {
    throw Error(std::string("no keys can be made: ") + ::zmq_strerror(::zmq_errno()));
  }
  return {secret_key, public_key, {}};
}

}  // namespace planar_mapping::transport
