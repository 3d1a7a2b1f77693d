// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame_source.h"
#include "planar_mapping/transport/detail/listener_session.h"
#include "planar_mapping/transport/endpoint.h"

namespace planar_mapping {
namespace transport {

struct ListenerOptions {
  ListenerSettings settings;
  const std::atomic<bool>* stop = nullptr;  ///< set by a signal: next() gives nothing from then on
  /// What kind() says where the stop came before any front-end.
  io::SequenceKind expected = io::SequenceKind::Clouds;
  /// What a person should know at once: peers that come, go or are turned away. Called from the
  /// thread that calls next().
  std::function<void(const std::string&)> say;
};

/// Frames of a front-end in another process, over TCP (docs/dev/front_end_protocol.md).
///
/// Listens from construction on, in a thread of its own; at most ListenerSettings::window frames
/// wait in memory. A front-end that goes away has ListenerSettings::timeout to come back and goes
/// on where it was. Destruction tells the front-end that the session is over.
class PLANAR_MAPPING_EXPORT FrameListener : public FrameSource {
 public:
  /// \throws InputError if it cannot listen there; ParameterError
  FrameListener(const Endpoint& endpoint, ListenerOptions options);
  ~FrameListener() override;
  FrameListener(const FrameListener&) = delete;
  FrameListener& operator=(const FrameListener&) = delete;

  /// Where it listens; the port is the one that was taken.
  const Endpoint& endpoint() const;

  std::vector<std::string> names() const override;
  /// Both wait for a front-end, as names() does. \throws InputError if none comes
  io::SequenceKind kind() const override;
  io::PoseSource poseSource() const override;
  std::optional<std::size_t> size() const override;
  /// \throws InputError if the front-end went away, says that it cannot go on, or none came
  std::optional<Frame> next() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What a front-end has to know of a configuration: stages through the last Images or Features
/// stage (of a configuration without any, the first one, which the front-end does not run), which
/// frames, profile and seed; nothing that names a file.
PLANAR_MAPPING_EXPORT std::string frontEndYaml(const Configuration& configuration);

}  // namespace transport
}  // namespace planar_mapping
