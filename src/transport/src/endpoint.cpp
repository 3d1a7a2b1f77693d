// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/endpoint.h"

#include <netdb.h>
#include <sys/socket.h>

#include <charconv>
#include <memory>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::transport {

Endpoint parseEndpoint(const std::string& text) {
  const InputError error("'" + text + "' is not HOST:PORT with a port of 0 to 65535");
  const std::size_t colon = text.rfind(':');
  Endpoint endpoint;
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
  const bool is_ipv6 = endpoint.host.find(':') != std::string::npos;
  return (is_ipv6 ? "[" + endpoint.host + "]" : endpoint.host) + ":" +
         std::to_string(endpoint.port);
}

Endpoint resolved(const Endpoint& endpoint) {
  // RFC 6761: this name is the loopback, whether or not the machine has a list of hosts.
  if (endpoint.host == "localhost") return {"127.0.0.1", endpoint.port};
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  int problem = ::getaddrinfo(endpoint.host.c_str(), nullptr, &hints, &found);
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  char address[NI_MAXHOST] = {};
  if (problem == 0) {
    // IPv4 where there is one.
    const addrinfo* best = found;
    for (const addrinfo* item = found; item != nullptr; item = item->ai_next) {
      if (item->ai_family == AF_INET) {
        best = item;
        break;
      }
    }
    problem = ::getnameinfo(best->ai_addr, best->ai_addrlen, address, sizeof(address), nullptr, 0,
                            NI_NUMERICHOST);
  }
  if (problem != 0) {
    throw InputError("the host name '" + endpoint.host +
                     "' cannot be resolved: " + ::gai_strerror(problem));
  }
  return {address, endpoint.port};
}

}  // namespace planar_mapping::transport
