// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "planar_mapping/core/base/export.h"

namespace planar_mapping {
namespace transport {

/// Where a mapping side listens, or is to be found.
struct Endpoint {
  std::string host = "127.0.0.1";  ///< name or address, IPv6 without brackets
  std::uint16_t port = 0;          ///< 0 = any free one (to listen only)
};

/// "HOST:PORT", "[IPv6]:PORT" or "PORT", which means 127.0.0.1: the network is asked for, not
/// given. \throws InputError
PLANAR_MAPPING_EXPORT Endpoint parseEndpoint(const std::string& text);

/// The form parseEndpoint() reads.
PLANAR_MAPPING_EXPORT std::string toText(const Endpoint& endpoint);

/// The same with a numeric address in place of a name. Asks the name service, which may take
/// seconds. \throws InputError naming host and reason
PLANAR_MAPPING_EXPORT Endpoint resolved(const Endpoint& endpoint);

}  // namespace transport
}  // namespace planar_mapping
