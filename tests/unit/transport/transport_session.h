// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <future>
#include <stdexcept>
#include <thread>

#include "planar_mapping/base/error.h"
#include "planar_mapping/transport/frame_listener.h"
#include "planar_mapping/transport/front_end.h"
#include "transport_frames.h"

namespace planar_mapping::transport {

/// Frames without a sequence or stages. Counts what it makes, and can fail.
class FakeSource : public FrameSource {
 public:
  struct Plan {
    std::uint64_t frames = 8;
    std::uint64_t fails_at = ~std::uint64_t{0};  ///< like a crash: no goodbye is said
    std::string problem = "";                    ///< thrown as InputError at fails_at, if set
    std::atomic<std::uint64_t>* made = nullptr;
    const std::atomic<bool>* may_fail = nullptr;  ///< waits for it, 20 s at most
  };

  explicit FakeSource(const Plan& plan) : plan_(plan) {}

  std::vector<std::string> names() const override { return {"fake"}; }
  io::SequenceKind kind() const override { return io::SequenceKind::Clouds; }
  io::PoseSource poseSource() const override { return io::PoseSource::File; }
  std::optional<std::size_t> size() const override { return plan_.frames; }
  std::optional<Frame> next() override {
    if (position_ == plan_.fails_at) {
      for (int i = 0; i < 20000 && plan_.may_fail != nullptr && !*plan_.may_fail; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (!plan_.problem.empty()) throw InputError(plan_.problem);
      throw std::runtime_error("crash");
    }
    if (position_ == plan_.frames) return std::nullopt;
    if (plan_.made != nullptr) ++*plan_.made;
    return transportFrame(40, 30, ++position_);
  }

 private:
  Plan plan_;
  std::uint64_t position_ = 0;
};

inline ListenerOptions listenerOptions(double timeout = 5.0) {
  ListenerOptions options;
  options.configuration = "version: 1\n";
  options.timeout = timeout;
  return options;
}

inline FrontEndOptions frontEndOptions(double timeout = 5.0) {
  FrontEndOptions options;
  options.timeout = timeout;
  return options;
}

inline FrontEndResult sendFakeFrames(const Endpoint& endpoint, const FakeSource::Plan& plan,
                                     const FrontEndOptions& options = frontEndOptions()) {
  return runFrontEnd(
      endpoint, [&plan](const std::string&) { return std::make_unique<FakeSource>(plan); },
      options);
}

inline std::future<FrontEndResult> sendInBackground(
    const Endpoint& endpoint, const FakeSource::Plan& plan,
    const FrontEndOptions& options = frontEndOptions()) {
  return std::async(std::launch::async, [=]() { return sendFakeFrames(endpoint, plan, options); });
}

/// Takes all frames as a run that ends well, and checks that they are those of FakeSource, each
/// once and in order.
inline std::uint64_t takeAll(FrameListener& listener, std::uint64_t first = 0) {
  std::uint64_t taken = first;
  while (const std::optional<Frame> frame = listener.next()) {
    const Frame sent = transportFrame(40, 30, taken + 1);
    if (frame->number != sent.number || !sameCloud(*sent.cloud, *frame->cloud)) {
      throw std::runtime_error("frame " + std::to_string(taken) + " is another one");
    }
    ++taken;
  }
  listener.close();
  listener.confirm();
  return taken;
}

/// The message of what a call throws.
template <typename Call>
std::string errorOf(const Call& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

}  // namespace planar_mapping::transport
