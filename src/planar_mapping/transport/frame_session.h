// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "planar_mapping/transport/frame_listener.h"
#include "planar_mapping/transport/message.h"

namespace planar_mapping::transport {

/// The mapping side of the protocol without its sockets (docs/dev/front_end_protocol.md): what each
/// message of any peer means, who owns the session, and what is answered.
/// Not thread-safe.
class FrameSession {
 public:
  /// To whom messages go.
  struct Peers {
    std::function<Sent(const std::string& peer, MessageType type, const Bytes& body)> send;
    /// The connection by which this message came is the owner's.
    std::function<void(zmq::message_t& envelope)> protect;
  };

  FrameSession(const ListenerOptions& options, Peers peers);

  /// Handles a message; what breaks the protocol is refused.
  void take(Received& message);
  /// From here on the next frame is waited for.
  void awaitFrame() { progress_at_ = Clock::now(); }
  /// Probes the owner where it is time to. \throws InputError if the wait is too long
  void checkTime();
  /// \throws InputError if the owner said that it cannot continue
  void requireOwner() const;
  /// The frame that waits, if any. The owner hears that it was taken.
  std::optional<Frame> takeFrame();
  /// Tells the owner that the session is over, once.
  /// \param is_done  all its frames are in a result that is safe
  void sayGoodbye(bool is_done = false);
  /// One of at most kMaxEvents sentences for the user.
  void report(const std::string& text);

  bool hasFrame() const { return frame_.has_value(); }
  bool hasEnded() const { return ended_; }
  bool stopRequested() const { return options_.stop != nullptr && *options_.stop; }
  /// Of the owner's first frame.
  const std::optional<InputDescription>& input() const { return input_; }

  static constexpr int kMaxEvents = 100;

 private:
  void handle(Received& message);
  void handleFrame(Received& message, const InputDescription& described, std::uint64_t at,
                   ByteReader& reader);
  void handleBye(const Received& message, const Bye& bye);
  void welcome(Received& message);
  void refuse(const Received& message, ByeReason reason, const std::string& text);
  bool isServingAnother(const Received& message);
  bool isOwner(const Received& message) const { return owner_ == message.instance; }
  void setOwner(Received& message);
  void setPeer(Received& message);
  void probeOwner();
  void limitNotes(Frame& frame);
  std::uint64_t received() const { return taken_ + (frame_ ? 1 : 0); }
  std::string position() const;

  const ListenerOptions& options_;
  Peers peers_;
  std::optional<InputDescription> input_;
  std::optional<std::uint64_t> owner_;  ///< instance of the front-end that sent the last frame
  std::string owner_peer_;              ///< its connection
  bool owner_connected_ = false;
  std::optional<Frame> frame_;  ///< next to be taken
  std::uint64_t taken_ = 0;     ///< frames
  bool ended_ = false;
  std::string failure_;  ///< of the owner; thrown once all frames are taken
  bool said_goodbye_ = false;
  std::size_t note_bytes_ = 0;
  std::set<std::string> statistic_names_;
  int events_ = 0;
  std::uint64_t repeated_ = 0;  ///< frames of a restarted front-end, since the last new one
  Clock::time_point progress_at_ = Clock::now();
  Clock::time_point ack_at_ = Clock::now();
};

}  // namespace planar_mapping::transport
