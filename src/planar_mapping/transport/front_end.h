// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "planar_mapping/pipeline/frame_source.h"
#include "planar_mapping/transport/endpoint.h"

namespace planar_mapping::transport {

/// Makes the input from the configuration that the mapping side sent. The same input and
/// configuration have to give the same frames, bit for bit: a restarted front-end repeats them.
/// size() has to be known.
using SourceFactory = std::function<std::unique_ptr<FrameSource>(const std::string& yaml)>;

/// How clouds travel. Both are exact to the last bit.
enum class CloudEncoding : std::uint8_t {
  Raw = 0,      ///< three floats a point
  Compact = 1,  ///< packed by zstd
};

struct FrontEndOptions {
  /// [ours] Seconds to wait for a mapping side that is not there (yet) or went away.
  double timeout = 30.0;
  CloudEncoding encoding = CloudEncoding::Compact;
  Keys keys;                                    ///< empty = in the clear
  const std::atomic<bool>* stop = nullptr;      ///< set by a signal: says goodbye and returns
  std::function<void(const std::string&)> say;  ///< connection lost, waiting, beginning again
  /// Called when a frame was sent: frames sent or repeated so far, frames in all.
  std::function<void(std::uint64_t, std::uint64_t)> progress;
};

struct FrontEndResult {
  bool interrupted = false;
  std::uint64_t frames_sent = 0;  ///< frames sent again after a lost connection count again
  std::uint64_t bytes_sent = 0;   ///< in frames
};

/// The front-end's half of a session: connects, makes frames as the mapping side's configuration
/// says, one at a time, makes the next one while one is on its way, and returns when the mapping
/// side has saved them all. After a lost connection it sends again what was not acknowledged; for a
/// restarted mapping side it begins again.
/// \throws InputError if the mapping side cannot be found, refuses us or breaks the protocol; what
///         the source throws, after telling the mapping side
PLANAR_MAPPING_EXPORT FrontEndResult runFrontEnd(const Endpoint& endpoint,
                                                 const SourceFactory& makeSource,
                                                 const FrontEndOptions& options);

}  // namespace planar_mapping::transport
