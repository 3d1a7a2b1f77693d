// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "byte_stream.h"

namespace planar_mapping::transport::detail {

/// Section 'cloud' of a frame message. \param camera of the cloud, for CloudEncoding::Compact
/// \throws InputError if width and height do not agree with the number of points
void writeCloud(const FrameCloud& cloud, const std::optional<PinholeCamera>& camera,
                CloudEncoding encoding, Bytes& bytes);

/// \param largest_points a cloud may have, holes counted: memory is taken for all of them
/// \throws ProtocolError
FrameCloud::Ptr readCloud(ByteReader& reader, const std::optional<PinholeCamera>& camera,
                          std::size_t largest_points);

}  // namespace planar_mapping::transport::detail
