// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/front_end.h"

#include <deque>
#include <filesystem>
#include <random>

#include "planar_mapping/transport/message.h"

namespace planar_mapping::transport {
namespace {

constexpr double kPatience = 1.0;  // seconds until it says that it waits
constexpr int kReconnectMs = 100;  // and from there up to
constexpr int kMaxReconnectMs = 1000;
constexpr const char* kMonitorAddress = "inproc://events";
constexpr int kHandshakeFailed =
    ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL;

/// The user asked to stop.
struct Interrupted {};

std::uint64_t randomNumber() {
  std::random_device device;
  return (std::uint64_t{device()} << 32U) | device();
}

/// One run of a front-end, over as many connections as ZeroMQ has to make.
class FrontEnd {
 public:
  FrontEnd(const Endpoint& endpoint, const SourceFactory& makeSource,
           const FrontEndOptions& options)
      : endpoint_(endpoint), makeSource_(makeSource), options_(options) {
    requireInRange("timeout", options.timeout, 0.01, 1e6, "s");
    requireInRange("max_window", options.max_window, 1, kMaxWindow);
    connect();
  }
  FrontEndResult run() {
    try {
      while (!serveConnection())
        say("lost the connection to " + peer() + "; trying again for " +
            secondsText(options_.timeout));
    } catch (const Interrupted&) {
      sayGoodbye(ByeReason::Interrupted, "");
      result_.interrupted = true;
    } catch (const ProtocolError& error) {
      sayGoodbye(ByeReason::Protocol, error.what());
      throw InputError(peer() +
                       " breaks the protocol of 'planar_map run --listen': " + error.what());
    } catch (const Error& error) {
      sayGoodbye(ByeReason::Failed, error.what());
      throw;
    }
    return result_;
  }

 private:
  void connect() {
    const Endpoint address = resolved(endpoint_);
    configure(socket_, address, options_.keys, kMaxControlBody, options_.timeout);
    socket_.set(zmq::sockopt::reconnect_ivl, kReconnectMs);
    socket_.set(zmq::sockopt::reconnect_ivl_max, kMaxReconnectMs);
    if (!options_.keys.peers.empty())
      socket_.set(zmq::sockopt::curve_serverkey, options_.keys.peers.front());
    ::zmq_socket_monitor(socket_.handle(), kMonitorAddress,
                         ZMQ_EVENT_CONNECTED | ZMQ_EVENT_DISCONNECTED |
                             ZMQ_EVENT_HANDSHAKE_SUCCEEDED | kHandshakeFailed);
    monitor_.connect(kMonitorAddress);
    try {
      socket_.connect(zmqAddress(address));
    } catch (const zmq::error_t& error) {
      throw InputError("cannot connect to " + toText(endpoint_) + ": " + error.what());
    }
  }

  /// \return false if the connection was lost
  bool serveConnection() {
    waitForWelcome();
    prepareSource();
    return sendFrames() && waitForEnd();
  }

  void waitForWelcome() {
    const Clock::time_point start = Clock::now();
    bool said_waiting = false;
    while (!pump(kPollInterval)) {
      if (secondsSince(progress_at_) > options_.timeout) {
        const std::string within = " within " + secondsText(options_.timeout);
        throw InputError(
            is_connected_
                ? peer() + " does not answer" + within + "; is it 'planar_map run --listen'?"
                : peer() + (was_welcomed_ ? " did not come back" : " cannot be reached") + within +
                      "; start it with 'planar_map run CONFIG --listen HOST:PORT', check address "
                      "and "
                      "firewall, or wait longer with --timeout");
      }
      if (!said_waiting && secondsSince(start) > kPatience) {
        said_waiting = true;
        say("waiting for " + peer());
      }
    }
    was_welcomed_ = true;
  }

  /// Frames that were made stay valid while the mapping side continues the same map.
  void prepareSource() {
    if (source_ && welcome_->configuration == configuration_ &&
        welcome_->next_frame >= produced_ - kept_.size()) {
      return;
    }
    if (source_) say(peer() + " was restarted: beginning again");
    source_ = makeSource_(welcome_->configuration);
    configuration_ = welcome_->configuration;
    input_ = describe(*source_);
    produced_ = 0;
    acknowledged_ = 0;
    kept_.clear();
  }

  /// \return false at the end
  bool produce() {
    const std::optional<Frame> frame = source_->next();
    if (!frame) return false;
    kept_.push_back(encodeFrame(input_, produced_++, *frame, options_.encoding));
    const std::size_t size = kept_.back().size();
    if (size > welcome_->max_frame)
      throw InputError("frame " + std::to_string(produced_ - 1) + " takes " + std::to_string(size) +
                       " bytes, and " + peer() + " takes " + std::to_string(welcome_->max_frame) +
                       " at most; start it with a larger --max-message-mb");
    return true;
  }

  /// Sends what was not acknowledged, and new frames to the end.
  bool sendFrames() {
    const std::uint64_t window = std::min(welcome_->window, options_.max_window);
    for (std::uint64_t position = produced_ - kept_.size();; ++position) {
      if (produced_ == position && !produce()) return true;
      do {
        if (!pump(position < acknowledged_ + window ? 0.0 : kPollInterval)) return false;
      } while (position >= acknowledged_ + window);
      if (position < acknowledged_) continue;
      const Bytes& body = kept_[position - (produced_ - kept_.size())];
      if (!send(MessageType::Frame, body)) return false;
      ++result_.frames_sent;
      result_.bytes_sent += body.size();
      if (options_.progress) options_.progress(produced_, input_.frames);
    }
  }

  bool waitForEnd() {
    if (!send(MessageType::End, encode(input_, Count{produced_}))) return false;
    while (!bye_) {
      if (!pump(kPollInterval) && !bye_) return acknowledged_ == produced_;
    }
    return true;
  }

  /// \return false if the connection is lost
  bool send(MessageType type, const Bytes& body) {
    if (!welcome_) return false;
    while (transport::send(socket_, "", type, instance_, body) != Sent::Yes) {
      if (!pump(kPollInterval)) return false;
    }
    return true;
  }

  /// Takes what came, and waits for something to come until time is up.
  /// \return whether we are welcome. \throws if the session cannot continue, or was stopped
  bool pump(double seconds) {
    if (options_.stop != nullptr && *options_.stop) throw Interrupted();
    poll(socket_, monitor_, seconds);
    // Events last: whatever a connection brought was there before the event that it is lost.
    std::vector<int> events;
    while (const std::optional<Received> event = receive(monitor_, false))
      events.push_back(*event->envelope.data<std::uint16_t>());
    while (std::optional<Received> received = receive(socket_, false)) handle(*received);
    for (const int event : events) handleEvent(event);
    while (produced_ - kept_.size() < acknowledged_) kept_.pop_front();
    if (hello_due_)
      hello_due_ = transport::send(socket_, "", MessageType::Hello, instance_, {}) != Sent::Yes;
    if (bye_ && bye_->reason != ByeReason::Done)
      throw InputError(peer() + " ended the session: " + bye_->text);
    return welcome_ && !bye_;
  }

  void handle(Received& received) {
    received.open();
    ByteReader reader = received.reader();
    if (received.type == MessageType::Bye) {
      bye_ = decode<Bye>(reader);
    } else if (received.type == MessageType::Welcome && !welcome_) {
      welcome_ = decode<Welcome>(reader);
      if (welcome_->window < 1 || welcome_->window > kMaxWindow)
        ByteReader::fail("window", "is not within 1 and 1024");
    } else if (received.type == MessageType::Ack) {
      const std::uint64_t frames = decode<Count>(reader).frames;
      if (!welcome_ || frames <= acknowledged_) return;
      if (frames > produced_) ByteReader::fail("frames", "acknowledges what was not sent");
      acknowledged_ = frames;
      progress_at_ = Clock::now();
    } else {
      throw ProtocolError("a message came out of turn");
    }
    reader.expectEnd();
  }

  void handleEvent(int event) {
    if ((event & kHandshakeFailed) != 0) {
      throw InputError(peer() +
                       (event == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH
                            ? " does not know our key; make keys with 'planar_map keys'"
                            : " is no 'planar_map run --listen', or one with other --keys"));
    }
    is_connected_ = event != ZMQ_EVENT_DISCONNECTED;
    hello_due_ = event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED;
    if (event != ZMQ_EVENT_DISCONNECTED || !welcome_) return;
    welcome_.reset();
    progress_at_ = Clock::now();
  }

  void sayGoodbye(ByeReason reason, const std::string& text) {
    if (bye_ || !is_connected_) return;
    transport::send(socket_, "", MessageType::Bye, instance_, encode(Bye{reason, text}));
  }

  std::string peer() const { return "the mapping side at " + toText(endpoint_); }
  void say(const std::string& text) const {
    if (options_.say) options_.say(text);
  }

  const Endpoint& endpoint_;
  const SourceFactory& makeSource_;
  const FrontEndOptions& options_;
  const std::uint64_t instance_ = randomNumber();
  zmq::context_t context_{1};
  zmq::socket_t socket_{context_, zmq::socket_type::dealer};
  zmq::socket_t monitor_{context_, zmq::socket_type::pair};

  bool is_connected_ = false;  ///< TCP, perhaps without a handshake
  bool hello_due_ = false;
  bool was_welcomed_ = false;
  std::optional<Welcome> welcome_;  ///< of the present connection
  std::optional<Bye> bye_;
  Clock::time_point progress_at_ = Clock::now();  ///< the mapping side did something for us

  std::unique_ptr<FrameSource> source_;
  std::string configuration_;  ///< of the source
  InputDescription input_;
  std::uint64_t produced_ = 0;      ///< frames
  std::uint64_t acknowledged_ = 0;  ///< frames that the mapping side has
  std::deque<Bytes> kept_;          ///< the last ones produced, not acknowledged
  FrontEndResult result_;
};
}  // namespace

InputDescription describe(const FrameSource& source) {
  const std::vector<std::string> names = source.names();
  std::uint64_t hash = 0xCBF29CE484222325U;  // FNV-1a
  for (const std::string& name : names) {
    const std::string file = std::filesystem::path(name).lexically_normal().filename().string();
    for (const char c : file + '\n') hash = (hash ^ static_cast<std::uint8_t>(c)) * 0x100000001B3U;
  }
  return {source.kind(), source.poseSource(), source.size().value_or(0), hash, names.front()};
}

FrontEndResult runFrontEnd(const Endpoint& endpoint, const SourceFactory& makeSource,
                           const FrontEndOptions& options) {
  return FrontEnd(endpoint, makeSource, options).run();
}

}  // namespace planar_mapping::transport
