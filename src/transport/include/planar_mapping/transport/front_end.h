// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/transport/endpoint.h"
#include "planar_mapping/transport/message.h"

namespace planar_mapping {
namespace transport {

/// Makes the frames that a front-end sends. The same input and configuration give the same frames,
/// bit for bit: a front-end that was restarted makes those again that it does not send.
class PLANAR_MAPPING_EXPORT FrameProducer {
 public:
  virtual ~FrameProducer();
  virtual Ready describe() const = 0;
  /// The next one, from the first on, or nothing at the end.
  virtual std::optional<Frame> next() = 0;
};

/// From the configuration the mapping side sent (Welcome::configuration).
using ProducerFactory = std::function<std::unique_ptr<FrameProducer>(const std::string& yaml)>;

/// Input of a front-end on files.
struct FrontEndInput {
  std::vector<std::string> inputs;  ///< as of `planar_map run -i`
  std::string poses;                ///< TUM file; empty = of the input
  int threads = -1;                 ///< -1 = 1, 0 = all cores; changes no result
};

/// Reads a sequence and runs the stages through Features on each frame.
/// \throws ConfigError if the configuration cannot be run here: unknown stages, or keys that would
///         make this machine load files the mapping side names; IoError, InputError for the input
PLANAR_MAPPING_EXPORT std::unique_ptr<FrameProducer> makePipelineProducer(
    const std::string& yaml, const FrontEndInput& input);

struct FrontEndOptions {
  /// [ours] Seconds to wait for a mapping side that is not there (yet), went away or says nothing.
  double timeout = 30.0;
  /// [ours] Frames kept in memory at most, however many the mapping side would take ahead, >= 1.
  std::uint32_t largest_window = 16;
  CloudEncoding encoding = CloudEncoding::Compact;
  const std::atomic<bool>* stop = nullptr;      ///< set by a signal: says goodbye and returns
  std::function<void(const std::string&)> say;  ///< what a person should know at once
  /// Called when a frame was sent: frames sent or made again so far, frames in all.
  std::function<void(std::uint64_t, std::uint64_t)> progress;
};

struct FrontEndResult {
  bool interrupted = false;
  std::uint64_t frames_sent = 0;  ///< frames sent again after a lost connection count again
  std::uint64_t bytes_sent = 0;   ///< in frames, with headers
};

/// The front-end's half of a session: finds the mapping side, makes frames as it says, sends them
/// no faster than it takes them, and returns when it has taken all. At most Welcome::window frames
/// are kept in memory, and no more than FrontEndOptions::largest_window. A lost connection is taken
/// up again; so is a mapping side that was restarted, from the frame it asks for.
/// \throws InputError if the mapping side cannot be found, says nothing, turns us away or breaks
///         the protocol; what the producer throws, after telling the mapping side
PLANAR_MAPPING_EXPORT FrontEndResult runFrontEnd(const Endpoint& endpoint,
                                                 const ProducerFactory& makeProducer,
                                                 const FrontEndOptions& options);

}  // namespace transport
}  // namespace planar_mapping
