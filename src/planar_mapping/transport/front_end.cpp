// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/front_end.h"

#include <deque>
#include <filesystem>
#include <random>
#include <thread>

#include "planar_mapping/transport/message.h"

namespace planar_mapping::transport {
namespace {

constexpr double kPatience = 1.0;  // seconds until it says that it waits
constexpr int kReconnectMs = 100;  // and from there up to
constexpr int kMaxReconnectMs = 1000;
constexpr int kHeartbeatMs = 1000;  // answered by ZeroMQ, also while a frame is mapped
constexpr int kMaxSilenceMs = 5000;
constexpr std::size_t kMaxKept = 2;  // frames: one on its way, and the next one
constexpr int kHandshakeFailed =
    ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL;

/// The user asked to stop.
struct Interrupted {};

std::uint64_t randomNumber() {
  std::random_device device;
  return (std::uint64_t{device()} << 32U) | device();
}

/// The connection was lost.
struct Lost {};

/// One run of a front-end, over as many connections as it takes.
class FrontEnd {
 public:
  FrontEnd(const Endpoint& endpoint, const SourceFactory& makeSource,
           const FrontEndOptions& options)
      : endpoint_(endpoint),
        address_(resolved(endpoint)),
        makeSource_(makeSource),
        options_(options) {
    requireInRange("timeout", options.timeout, 0.01, 1e6, "s");
  }
  FrontEndResult run() {
    try {
      while (!session()) continue;
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
  /// One connection. \return whether all is done
  bool session() {
    try {
      connect();
      send(MessageType::Hello, {});
      waitFor([this]() { return welcome_.has_value(); });
      prepareSource();
      sendFrames();
      if (!is_done_) send(MessageType::End, encode(input_, Count{produced_}));
      waitFor([]() { return false; });
    } catch (const Lost&) {
      if (welcome_) {
        progress_at_ = Clock::now();
        say("lost the connection to " + peer() + "; trying again for " +
            secondsText(options_.timeout));
      }
      welcome_.reset();
    }
    return is_done_;
  }

  void connect() {
    monitor_.reset();
    socket_ = zmq::socket_t(context_, zmq::socket_type::dealer);
    is_connected_ = false;
    configure(socket_, address_, options_.keys, kMaxControlBody);
    socket_.set(zmq::sockopt::reconnect_ivl, kReconnectMs);
    socket_.set(zmq::sockopt::reconnect_ivl_max, kMaxReconnectMs);
    socket_.set(zmq::sockopt::heartbeat_ivl, kHeartbeatMs);
    socket_.set(zmq::sockopt::heartbeat_timeout, kMaxSilenceMs);
    if (!options_.keys.peers.empty())
      socket_.set(zmq::sockopt::curve_serverkey, options_.keys.peers.front());
    monitor_.emplace(context_, socket_, "events" + std::to_string(++connections_),
                     ZMQ_EVENT_CONNECTED | ZMQ_EVENT_DISCONNECTED | kHandshakeFailed);
    try {
      socket_.connect(zmqAddress(address_));
    } catch (const zmq::error_t& error) {
      throw InputError("cannot connect to " + toText(endpoint_) + ": " + error.what());
    }
  }

  /// Frames that were made stay valid while the mapping side continues the same map.
  void prepareSource() {
    if (is_done_ || (source_ && welcome_->configuration == configuration_ &&
                     welcome_->next_frame >= produced_ - kept_.size())) {
      return dropTaken(welcome_->next_frame);
    }
    if (source_) say(peer() + " was restarted: beginning again");
    source_ = makeSource_(welcome_->configuration);
    configuration_ = welcome_->configuration;
    input_ = describe(*source_);
    produced_ = 0;
    kept_.clear();
    has_more_ = true;
  }

  void dropTaken(std::uint64_t frames) {
    while (!kept_.empty() && produced_ - kept_.size() < frames) kept_.pop_front();
  }

  void produce() {
    const std::optional<Frame> frame = source_->next();
    has_more_ = frame.has_value();
    if (!frame) return;
    kept_.push_back(encodeFrame(input_, produced_, *frame, options_.encoding, welcome_->max_frame));
    ++produced_;
  }

  void sendFrames() {
    while (!is_done_) {
      if (kept_.empty() && has_more_) produce();
      if (kept_.empty()) return;
      const std::uint64_t position = produced_ - kept_.size();
      send(MessageType::Frame, kept_.front());
      ++result_.frames_sent;
      result_.bytes_sent += kept_.front().size();
      if (options_.progress) options_.progress(position + 1, input_.frames);
      if (has_more_ && kept_.size() < kMaxKept) produce();  // while that one is on its way
      waitFor([this, position]() { return taken_ > position; });
      dropTaken(position + 1);
    }
  }

  void send(MessageType type, const Bytes& body) {
    waitFor([this, type, &body]() {
      return transport::send(socket_, "", type, instance_, body) == Sent::Yes;
    });
  }

  /// Until the condition holds or all is done. \throws Lost, Interrupted; InputError if the session
  /// cannot continue
  template <typename Condition>
  void waitFor(const Condition& condition) {
    const Clock::time_point start = Clock::now();
    bool has_said = false;
    for (double seconds = 0.0;; seconds = kPollInterval) {
      pump(seconds);
      if (is_done_ || condition()) return;
      if (welcome_) continue;
      if (secondsSince(progress_at_) > options_.timeout) giveUp();
      if (!has_said && secondsSince(start) > kPatience) say("waiting for " + peer());
      has_said = has_said || secondsSince(start) > kPatience;
    }
  }

  [[noreturn]] void giveUp() const {
    const std::string within = " within " + secondsText(options_.timeout);
    if (is_connected_)
      throw InputError(peer() + " does not answer" + within + "; is it 'planar_map run --listen'?");
    if (was_connected_ && !source_)
      throw InputError(peer() + " closed each connection" + within +
                       "; is it 'planar_map run --listen', and is our key in its --keys?");
    throw InputError(
        peer() + (source_ ? " did not come back" : " cannot be reached") + within +
        "; start it with 'planar_map run CONFIG --listen HOST:PORT', check address and "
        "firewall, or wait longer with --timeout");
  }

  /// Takes what came, and waits for something to come until time is up.
  void pump(double seconds) {
    if (options_.stop != nullptr && *options_.stop) throw Interrupted();
    poll(socket_, monitor_->reader(), seconds);
    // Events last: whatever a connection brought was there before the event that it is lost.
    std::vector<int> events;
    while (const std::optional<SocketEvent> event = monitor_->next()) events.push_back(event->type);
    while (std::optional<Received> received = receive(socket_, false)) handle(*received);
    if (is_done_) return;
    for (const int event : events) {
      if ((event & kHandshakeFailed) != 0) {
        throw InputError(peer() +
                         (event == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH
                              ? " does not know our key; make keys with 'planar_map keys'"
                              : " is no 'planar_map run --listen', or one with other --keys"));
      }
      is_connected_ = event == ZMQ_EVENT_CONNECTED;
      was_connected_ |= is_connected_;
      if (is_connected_) continue;
      if (!welcome_) std::this_thread::sleep_for(std::chrono::milliseconds(kReconnectMs));
      throw Lost();
    }
  }

  void handle(Received& received) {
    received.open();
    ByteReader reader = received.reader();
    if (received.type == MessageType::Bye) {
      const auto bye = decode<Bye>(reader);
      is_over_ = true;
      if (bye.reason != ByeReason::Done)
        throw InputError(peer() + " ended the session: " + bye.text);
      is_done_ = true;
    } else if (received.type == MessageType::Welcome && !welcome_) {
      welcome_ = decode<Welcome>(reader);
      taken_ = 0;
    } else if (received.type == MessageType::Ack && welcome_) {
      taken_ = decode<Count>(reader).frames;
      if (taken_ > produced_) ByteReader::fail("frames", "acknowledges what was not sent");
    } else if (received.type != MessageType::Ack) {
      throw ProtocolError("a message came out of turn");
    }
    if (received.type != MessageType::Ack) reader.expectEnd();
  }

  void sayGoodbye(ByeReason reason, const std::string& text) {
    if (is_over_ || !is_connected_) return;
    transport::send(socket_, "", MessageType::Bye, instance_, encode(Bye{reason, text}));
  }

  std::string peer() const { return "the mapping side at " + toText(endpoint_); }
  void say(const std::string& text) const {
    if (options_.say) options_.say(text);
  }

  const Endpoint& endpoint_;
  const Endpoint address_;
  const SourceFactory& makeSource_;
  const FrontEndOptions& options_;
  const std::uint64_t instance_ = randomNumber();
  zmq::context_t context_{1};
  zmq::socket_t socket_;
  std::optional<SocketMonitor> monitor_;
  int connections_ = 0;

  bool is_connected_ = false;  ///< TCP, perhaps without a handshake
  bool was_connected_ = false;
  std::optional<Welcome> welcome_;                ///< of the present connection
  bool is_over_ = false;                          ///< the mapping side said Bye
  bool is_done_ = false;                          ///< and has all frames
  Clock::time_point progress_at_ = Clock::now();  ///< the mapping side did something for us

  std::unique_ptr<FrameSource> source_;
  std::string configuration_;  ///< of the source
  InputDescription input_;
  bool has_more_ = true;        ///< the source may have
  std::uint64_t produced_ = 0;  ///< frames
  std::uint64_t taken_ = 0;     ///< frames that the mapping side has
  std::deque<Bytes> kept_;      ///< the last ones produced, not acknowledged
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
