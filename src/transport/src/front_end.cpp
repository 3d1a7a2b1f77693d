// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/front_end.h"

#include <algorithm>
#include <deque>
#include <random>
#include <thread>

#include "mapper_connection.h"

namespace planar_mapping::transport {
namespace {

using detail::Clock;
using detail::MapperConnection;
using detail::secondsBetween;
using detail::secondsText;

constexpr double kPumpInterval = 0.05;    // seconds between looks at the stop flag
constexpr double kPatience = 1.0;         // seconds until it says that it waits
constexpr double kReconnectPause = 0.05;  // seconds, so that a peer that hangs up is not flooded

/// The user asked to stop.
struct Interrupted {};

std::uint64_t newInstance() {
  std::random_device device;
  return (std::uint64_t{device()} << 32U) | device();
}

/// One run of a front-end, over as many connections as it takes.
class FrontEnd {
 public:
  FrontEnd(const Endpoint& endpoint, const ProducerFactory& makeProducer,
           const FrontEndOptions& options)
      : endpoint_(endpoint),
        makeProducer_(makeProducer),
        options_(options),
        progress_at_(Clock::now()) {
    requireInRange("timeout", options.timeout, 0.01, 1e6, "s");
    requireInRange("largest_window", options.largest_window, 1, 1024);
  }

  FrontEndResult run();

 private:
  struct KeptFrame {
    std::uint64_t position;
    Bytes body;
  };

  bool serveOneConnection();
  bool shakeHands(MapperConnection& connection);
  void prepareProducer(const Welcome& welcome);
  bool sendKeptFrames(MapperConnection& connection);
  bool sendNewFrames(MapperConnection& connection);
  bool waitForEnd(MapperConnection& connection);
  bool waitForCredit(MapperConnection& connection, std::uint64_t position);
  bool sendFrame(MapperConnection& connection, const KeptFrame& frame);
  bool pump(MapperConnection& connection, double seconds);
  void checkPeer(const MapperConnection& connection) const;
  std::string peer() const { return "the mapping side at " + toText(endpoint_); }
  void say(const std::string& text) const {
    if (options_.say) options_.say(text);
  }

  const Endpoint& endpoint_;
  const ProducerFactory& makeProducer_;
  const FrontEndOptions& options_;
  const std::uint64_t instance_ = newInstance();
  std::unique_ptr<FrameProducer> producer_;
  std::string configuration_;
  Ready ready_;
  std::uint64_t produced_ = 0;     ///< frames
  std::deque<KeptFrame> kept_;     ///< not acknowledged yet
  Clock::time_point progress_at_;  ///< the mapping side did something for us
  bool was_connected_ = false;
  bool said_waiting_ = false;
  FrontEndResult result_;
};

FrontEndResult FrontEnd::run() {
  try {
    while (!serveOneConnection()) {
      std::this_thread::sleep_for(detail::seconds(kReconnectPause));
    }
  } catch (const Interrupted&) {
    result_.interrupted = true;
  }
  return result_;
}

/// \return false if the connection was lost and another one is worth trying
bool FrontEnd::serveOneConnection() {
  MapperConnection connection(endpoint_, instance_);
  try {
    if (!shakeHands(connection)) return false;
    was_connected_ = true;
    said_waiting_ = false;
    prepareProducer(*connection.welcome());
    const bool done = connection.send(MessageType::Ready, encode(ready_)) &&
                      sendKeptFrames(connection) && sendNewFrames(connection) &&
                      waitForEnd(connection);
    if (!done) {
      progress_at_ = std::max(progress_at_, connection.heardAt());
      say("lost the connection to " + peer() + "; trying again for " +
          secondsText(options_.timeout));
    }
    return done;
  } catch (const Interrupted&) {
    connection.send(MessageType::Bye, encode(Bye{ByeReason::Interrupted, ""}));
    throw;
  } catch (const ProtocolError& error) {
    connection.send(MessageType::Bye, encode(Bye{ByeReason::Protocol, error.what()}));
    throw InputError(peer() + " breaks the protocol of 'planar_map run --listen': " + error.what());
  } catch (const Error& error) {
    if (!connection.bye()) {
      connection.send(MessageType::Bye, encode(Bye{ByeReason::Failed, error.what()}));
    }
    throw;
  }
}

/// Waits for the connection and the Welcome, for as long as there was no progress.
bool FrontEnd::shakeHands(MapperConnection& connection) {
  const Clock::time_point start = Clock::now();
  while (!connection.welcome()) {
    const bool open = pump(connection, kPumpInterval);
    if (connection.welcome()) break;
    const Clock::time_point now = Clock::now();
    if (secondsBetween(progress_at_, now) > options_.timeout) {
      const std::string within = " within " + secondsText(options_.timeout);
      throw InputError(
          connection.isConnected() || connection.isLost()
              ? peer() + " does not answer" + within + "; is it 'planar_map run --listen'?"
              : peer() + (was_connected_ ? " did not come back" : " cannot be reached") + within +
                    "; start it with 'planar_map run CONFIG --listen HOST:PORT', check address and "
                    "firewall, or wait longer with --timeout");
    }
    if (!open) return false;
    if (!said_waiting_ && secondsBetween(start, now) > kPatience) {
      said_waiting_ = true;
      say("waiting for " + peer());
    }
  }
  return true;
}

/// Frames it has got stay valid while the mapping side goes on with the same map.
void FrontEnd::prepareProducer(const Welcome& welcome) {
  const std::uint64_t first_kept = kept_.empty() ? produced_ : kept_.front().position;
  if (producer_ && welcome.configuration == configuration_ && welcome.next_frame >= first_kept) {
    return;
  }
  if (producer_) say(peer() + " was restarted: beginning again");
  producer_ = makeProducer_(welcome.configuration);
  configuration_ = welcome.configuration;
  ready_ = producer_->describe();
  produced_ = 0;
  kept_.clear();
}

bool FrontEnd::sendKeptFrames(MapperConnection& connection) {
  const std::uint64_t wanted = connection.welcome()->next_frame;
  while (!kept_.empty() && kept_.front().position < wanted) kept_.pop_front();
  for (std::size_t i = 0; i < kept_.size();) {
    const std::uint64_t position = kept_[i].position;
    if (!waitForCredit(connection, position)) return false;
    // Waiting may have shortened the list.
    for (i = 0; i < kept_.size() && kept_[i].position != position;) ++i;
    if (i < kept_.size() && !sendFrame(connection, kept_[i])) return false;
    ++i;
  }
  return true;
}

/// Frames the mapping side has already are made, for what stages remember of them, but not sent.
bool FrontEnd::sendNewFrames(MapperConnection& connection) {
  const Welcome& welcome = *connection.welcome();
  for (;;) {
    if (!pump(connection, 0.0)) return false;
    std::optional<Frame> frame = producer_->next();
    if (!frame) return true;
    const std::uint64_t position = produced_++;
    if (position < welcome.next_frame) {
      if (!connection.send(MessageType::Progress, encode(Progress{produced_}))) return false;
    } else {
      kept_.push_back({position, encodeFrame(*frame, position, options_.encoding)});
      frame.reset();
      if (kept_.back().body.size() > welcome.largest_frame) {
        throw InputError("frame " + std::to_string(position) + " takes " +
                         std::to_string(kept_.back().body.size()) + " bytes, and " + peer() +
                         " takes " + std::to_string(welcome.largest_frame) +
                         " at most; start it with a larger --max-message-mb");
      }
      if (!waitForCredit(connection, position) || !sendFrame(connection, kept_.back())) {
        return false;
      }
    }
    if (options_.progress) options_.progress(produced_, ready_.frames);
  }
}

bool FrontEnd::sendFrame(MapperConnection& connection, const KeptFrame& frame) {
  connection.countFrame();
  if (!connection.send(MessageType::Frame, frame.body)) return false;
  ++result_.frames_sent;
  result_.bytes_sent += kHeaderBytes + frame.body.size();
  return true;
}

bool FrontEnd::waitForCredit(MapperConnection& connection, std::uint64_t position) {
  const std::uint64_t window = std::min(connection.welcome()->window, options_.largest_window);
  while (position >= connection.acknowledged() + window) {
    if (!pump(connection, kPumpInterval)) return false;
  }
  return true;
}

bool FrontEnd::waitForEnd(MapperConnection& connection) {
  if (!connection.send(MessageType::End, encode(End{produced_}))) return false;
  for (;;) {
    if (connection.bye() && connection.bye()->reason == ByeReason::Done) return true;
    if (!pump(connection, kPumpInterval)) {
      const bool done = connection.bye() && connection.bye()->reason == ByeReason::Done;
      return done || connection.acknowledged() == produced_;
    }
  }
}

/// \return false if the connection is lost. \throws if the session cannot go on, or was stopped
bool FrontEnd::pump(MapperConnection& connection, double seconds) {
  if (options_.stop != nullptr && *options_.stop) throw Interrupted();
  const std::uint64_t before = connection.acknowledged();
  connection.pump(seconds);
  if (connection.acknowledged() > before) progress_at_ = Clock::now();
  // The one frame that is being sent stays, whatever the mapping side acknowledges.
  while (kept_.size() > 1 && kept_.front().position < connection.acknowledged()) kept_.pop_front();
  checkPeer(connection);
  return !connection.isLost() && !connection.bye();
}

void FrontEnd::checkPeer(const MapperConnection& connection) const {
  if (connection.bye() && connection.bye()->reason != ByeReason::Done) {
    throw InputError(peer() + " ended the session: " + connection.bye()->text);
  }
  if (connection.welcome() && !connection.bye() && !connection.isLost() &&
      secondsBetween(connection.heardAt(), Clock::now()) > options_.timeout) {
    throw InputError(peer() + " has been silent for " + secondsText(options_.timeout));
  }
}

}  // namespace

FrameProducer::~FrameProducer() = default;

FrontEndResult runFrontEnd(const Endpoint& endpoint, const ProducerFactory& makeProducer,
                           const FrontEndOptions& options) {
  return FrontEnd(endpoint, makeProducer, options).run();
}

}  // namespace planar_mapping::transport
