// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "planar_mapping/pipeline/frame_source.h"
#include "planar_mapping/transport/endpoint.h"

namespace planar_mapping::transport {

struct ListenerOptions {
  std::string configuration;  ///< frontEndYaml() of the run
  double timeout = 30.0;      ///< [ours] seconds without a frame after which it gives up, > 0
  std::size_t max_frame = std::size_t{64} << 20U;  ///< bytes of a message, 64 KiB to 4 GiB
  Keys keys;                                       ///< empty = anybody may connect, in the clear
  const std::atomic<bool>* stop = nullptr;  ///< set by a signal: next() gives nothing from then on
  /// What kind() returns where the stop came before any front-end.
  io::SequenceKind expected = io::SequenceKind::Clouds;
  /// Peers that come, go or are refused: at most 100 sentences in a session.
  std::function<void(const std::string&)> say;

  /// \throws ParameterError
  PLANAR_MAPPING_EXPORT void validate() const;
};

/// Frames of a front-end in another process (docs/dev/front_end_protocol.md).
///
/// A session belongs to the front-end that sends the first valid frame; nobody else can end or
/// delay it. A front-end that goes away has ListenerOptions::timeout to come back, and continues
/// with the next frame. Destruction tells the front-end that the session is over; that it is done,
/// confirm() alone.
/// Not thread-safe: all calls from one thread.
class PLANAR_MAPPING_EXPORT FrameListener : public FrameSource {
 public:
  /// \throws InputError if it cannot listen there; ParameterError
  FrameListener(const Endpoint& endpoint, ListenerOptions options);
  ~FrameListener() override;
  FrameListener(const FrameListener&) = delete;
  FrameListener& operator=(const FrameListener&) = delete;

  /// Where it listens; the port is the one that was taken.
  const Endpoint& endpoint() const;

  /// These wait for the first frame. \throws InputError if none comes
  std::vector<std::string> names() const override;
  io::SequenceKind kind() const override;
  io::PoseSource poseSource() const override;
  /// Unknown before the first frame; does not wait.
  std::optional<std::size_t> size() const override;
  /// \throws InputError if the front-end went away, reports that it cannot continue, or none came
  std::optional<Frame> next() override;
  /// Takes no further connections, closes those of strangers, and gives back the descriptors that
  /// were kept for a result.
  void close() override;
  /// Tells the front-end that all its frames are in a result that is safe.
  void confirm() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping::transport
