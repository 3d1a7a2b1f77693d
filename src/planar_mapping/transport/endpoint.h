// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"

namespace planar_mapping::transport {

/// Where a mapping side listens, or is to be found.
struct Endpoint {
  std::string host = "127.0.0.1";  ///< name, address (IPv6 without brackets) or "ipc://PATH"
  std::uint16_t port = 0;          ///< 0 = any free one (to listen only)

  bool isIpc() const { return host.compare(0, 6, "ipc://") == 0; }
};

/// "HOST:PORT", "[IPv6]:PORT", "ipc://PATH" or "PORT", which means 127.0.0.1. \throws InputError
PLANAR_MAPPING_EXPORT Endpoint parseEndpoint(const std::string& text);

/// The form parseEndpoint() reads.
PLANAR_MAPPING_EXPORT std::string toText(const Endpoint& endpoint);

/// The same with a numeric address in place of a name. Asks the name service, which may take
/// seconds. \throws InputError naming host and reason
PLANAR_MAPPING_EXPORT Endpoint resolved(const Endpoint& endpoint);

/// Whether only this machine can reach it: 127.0.0.0/8, ::1 or ipc. \throws as resolved()
PLANAR_MAPPING_EXPORT bool isLoopback(const Endpoint& endpoint);

/// CURVE keys (Curve25519) of one side, as 40 characters of Z85 each. Empty = no encryption.
struct Keys {
  std::string secret_key;
  std::string public_key;
  /// Mapping side: front-ends that may connect. Front-end: exactly the mapping side.
  std::vector<std::string> peers;
};

/// A new key pair, without peers. \throws Error if the system gives no random numbers
PLANAR_MAPPING_EXPORT Keys makeKeys();

}  // namespace planar_mapping::transport
