// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/detail/listener_session.h"

#include <algorithm>
#include <random>
#include <utility>

#include "duration.h"

namespace planar_mapping::transport {

void ListenerSettings::validate() const {
  requireInRange("timeout", timeout, 0.01, 1e6, "s");
  requireInRange("window", window, 1, 1024);
  requireInRange("largest_frame", static_cast<double>(largest_frame), 65536.0, 4294967295.0, "B");
}

namespace detail {
namespace {

constexpr double kLongestHelloWait = 5.0;  // seconds a connection may say nothing
constexpr double kSignOfLifeInterval = 1.0;
constexpr double kGoodbyeTime = 0.5;    // from goodbye to closing, so that it is read
constexpr int kLargestRetries = 5;      // connections in a row without a frame
constexpr double kShortestStale = 2.0;  // seconds of silence after which a front-end is replaced

/// Never 0, and not one a peer of an earlier run knows.
std::uint64_t newSession() {
  std::random_device device;
  const std::uint64_t number = (std::uint64_t{device()} << 32U) | device();
  return number != 0 ? number : 1;
}

}  // namespace

ListenerSession::ListenerSession(const ListenerSettings& settings, Time now)
    : settings_(settings), progress_at_(now), sign_of_life_at_(now) {
  settings_.validate();
}

void ListenerSession::connected(const Peer& peer, Time now) {
  Connection& connection = connections_[peer];
  connection = Connection();
  connection.connected_at = now;
  connection.heard_at = now;
  if (connections_.size() > kLargestConnections || !isOpen()) {
    event("turned a connection away: there are too many");
    connection.close_at = now;
  }
}

void ListenerSession::disconnected(const Peer& peer, Time now) {
  const auto found = connections_.find(peer);
  if (found == connections_.end()) return;
  if (owner_ == peer) {
    owner_.reset();
    lost_ = true;
    prolong(now);  // it has the whole timeout to come back
    if (isOpen()) event("lost the connection to the front-end" + position());
  }
  connections_.erase(found);
}

void ListenerSession::received(const Peer& peer, const std::uint8_t* data, std::size_t size,
                               Time now) {
  const auto found = connections_.find(peer);
  if (found == connections_.end() || found->second.close_at || closed_) return;
  found->second.heard_at = now;
  try {
    found->second.assembler.feed(
        data, size, [&](const MessageHeader& header) { return limitFor(peer, header); },
        [&](const MessageHeader& header, const Bytes& body) { handle(peer, header, body, now); });
  } catch (const ForeignProtocolError& error) {
    if (found->second.session == 0) {
      found->second.close_at = now;  // it would not understand a goodbye
      event(std::string("turned a peer away: ") + error.what());
    } else {
      turnAway(peer, ByeReason::Protocol, error.what(), now);
    }
  } catch (const VersionError& error) {
    turnAway(peer, ByeReason::Version, error.what(), now);
  } catch (const ProtocolError& error) {
    turnAway(peer, ByeReason::Protocol, error.what(), now);
  }
}

/// Who may send what, and when: asked before memory is taken for it.
std::size_t ListenerSession::limitFor(const Peer& peer, const MessageHeader& header) const {
  const Connection& connection = connections_.at(peer);
  const bool is_owner = owner_ == peer;
  if (connection.close_at) throw ProtocolError("it goes on after goodbye");
  if (header.session != connection.session) {
    throw ProtocolError("a message belongs to another session");
  }
  bool allowed = false;
  switch (header.type) {
    case MessageType::Hello:
      allowed = !is_owner;
      break;
    case MessageType::Ready:
      allowed = is_owner && !connection.ready;
      break;
    case MessageType::Frame:
      allowed = is_owner && connection.ready && !ended_;
      if (allowed && frames_.size() >= settings_.window) {
        throw ProtocolError("the front-end sends more frames ahead than it was allowed to");
      }
      break;
    case MessageType::Progress:
    case MessageType::End:
      allowed = is_owner && connection.ready && !ended_;
      break;
    case MessageType::Bye:
      allowed = true;
      break;
    default:
      break;
  }
  if (!allowed) {
    throw ProtocolError("a message of type " + std::to_string(static_cast<int>(header.type)) +
                        " came out of turn");
  }
  return largestBody(header.type, settings_.largest_frame);
}

void ListenerSession::handle(const Peer& peer, const MessageHeader& header, const Bytes& body,
                             Time now) {
  switch (header.type) {
    case MessageType::Hello:
      return handleHello(peer, decodeHello(body), now);
    case MessageType::Ready:
      return handleReady(peer, decodeReady(body), now);
    case MessageType::Frame:
      return handleFrame(body, now);
    case MessageType::Progress:
      return handleProgress(connections_.at(peer), decodeProgress(body), now);
    case MessageType::End:
      return handleEnd(decodeEnd(body));
    default:
      return handleBye(peer, decodeBye(body), now);
  }
}

void ListenerSession::handleHello(const Peer& peer, const Hello& hello, Time now) {
  connections_.at(peer).instance = hello.instance;
  if (owner_) {
    const Connection& owner = connections_.at(*owner_);
    // One that has not even said what its input is keeps nobody out for long.
    const double stale =
        owner.ready ? std::max(kShortestStale, 0.5 * settings_.timeout) : kShortestStale;
    const bool is_same = owner.instance == hello.instance;
    if (!is_same && secondsBetween(owner.heard_at, now) < stale) {
      turnAway(peer, ByeReason::Busy, "the mapping side is serving another front-end already", now);
      return;
    }
    turnAway(*owner_, ByeReason::Busy, "another connection of a front-end took over", now);
  }
  welcome(peer, now);
}

void ListenerSession::welcome(const Peer& peer, Time now) {
  Connection& connection = connections_.at(peer);
  owner_ = peer;
  lost_ = false;
  do {
    connection.session = newSession();
  } while (connection.session == last_session_);
  last_session_ = connection.session;
  connection.heard_at = now;
  ++sessions_without_frame_;
  prolong(now);
  Welcome message;
  message.configuration = settings_.configuration;
  message.next_frame = received_;
  message.window = settings_.window;
  message.largest_frame = settings_.largest_frame;
  message.timeout = settings_.timeout;
  send(peer, MessageType::Welcome, encode(message));
  sendAck(peer);
  event(received_ == 0 ? "a front-end is connected" : "a front-end is back" + position());
}

void ListenerSession::handleReady(const Peer& peer, const Ready& ready, Time now) {
  if (input_ && (input_->kind != ready.kind || input_->pose_source != ready.pose_source ||
                 input_->frames != ready.frames || input_->fingerprint != ready.fingerprint)) {
    turnAway(peer, ByeReason::OtherInput,
             "this map was begun from another input (" + input_->name + ", " +
                 std::to_string(input_->frames) + " frames)",
             now);
    return;
  }
  input_ = ready;
  connections_.at(peer).ready = true;
  prolong(now);
}

void ListenerSession::handleFrame(const Bytes& body, Time now) {
  FrameMessage message = decodeFrame(body, largestPoints(settings_.largest_frame));
  if (message.position != received_ || message.position >= input_->frames) {
    throw ProtocolError("frame " + std::to_string(message.position) + " came where frame " +
                        std::to_string(received_) + " of " + std::to_string(input_->frames) +
                        " was due");
  }
  ++received_;
  frames_.push_back(std::move(message.frame));
  sessions_without_frame_ = 0;
  prolong(now);
}

void ListenerSession::handleProgress(Connection& connection, const Progress& progress, Time now) {
  if (progress.frames <= connection.progress || progress.frames > received_) {
    throw ProtocolError("it reports progress that is none");
  }
  connection.progress = progress.frames;
  prolong(now);
}

void ListenerSession::handleEnd(const End& end) {
  if (end.frames != received_) {
    throw ProtocolError("it ends after " + std::to_string(end.frames) + " frames, but " +
                        std::to_string(received_) + " came");
  }
  ended_ = true;
}

void ListenerSession::handleBye(const Peer& peer, const Bye& bye, Time now) {
  connections_.at(peer).close_at = now;
  if (owner_ != peer) return;
  owner_.reset();
  if (!isOpen()) return;
  if (!connections_.at(peer).ready && bye.reason == ByeReason::Done) return;
  fail("the front-end " +
           std::string(bye.reason == ByeReason::Interrupted ? "was interrupted" : "gave up") +
           position() + (bye.text.empty() ? "" : ": " + bye.text),
       now);
}

void ListenerSession::turnAway(const Peer& peer, ByeReason reason, const std::string& text,
                               Time now) {
  Connection& connection = connections_.at(peer);
  if (connection.close_at) return;
  send(peer, MessageType::Bye, encode(Bye{reason, text}));
  connection.close_at = now + seconds(kGoodbyeTime);
  event((owner_ == peer ? "cut off the front-end" + position() + ": " : "turned a peer away: ") +
        text);
  if (owner_ == peer) {
    owner_.reset();
    prolong(now);
  }
}

/// Something useful happened, so that the timeout starts anew. Nobody keeps a run waiting for ever:
/// connections that bring no frame prolong it a few times only.
void ListenerSession::prolong(Time now) {
  if (sessions_without_frame_ <= kLargestRetries) progress_at_ = std::max(progress_at_, now);
}

void ListenerSession::tick(Time now) {
  closeLateConnections(now);
  if (closed_) return;
  const double interval = std::min(kSignOfLifeInterval, 0.25 * settings_.timeout);
  if (owner_ && secondsBetween(sign_of_life_at_, now) >= interval) {
    sign_of_life_at_ = now;
    sendAck(*owner_);
  }
  // While frames wait here the front-end need not send any.
  if (isOpen() && frames_.empty() && secondsBetween(progress_at_, now) > settings_.timeout) {
    fail(silence(), now);
  }
}

std::string ListenerSession::silence() const {
  const std::string within = " for " + secondsText(settings_.timeout);
  if (owner_) return "the front-end sent nothing" + within + position();
  if (received_ > 0 || lost_) {
    return "the front-end went away" + position() + " and did not come back" + within;
  }
  return "no front-end connected" + within +
         "; start one with 'planar_map frontend -i SEQUENCE --connect HOST:PORT', or wait longer "
         "with --timeout";
}

void ListenerSession::closeLateConnections(Time now) {
  const double longest = std::min(kLongestHelloWait, settings_.timeout);
  std::vector<Peer> late;
  for (auto& [peer, connection] : connections_) {
    if (connection.close_at && now >= *connection.close_at) late.push_back(peer);
    const bool is_silent = !connection.close_at && connection.session == 0 &&
                           secondsBetween(connection.connected_at, now) > longest;
    if (is_silent) {
      event("turned a connection away: it did not say who it is");
      late.push_back(peer);
    }
  }
  for (const Peer& peer : late) {
    if (owner_ == peer) owner_.reset();
    connections_.erase(peer);
    outgoing_.push_back({peer, {}});
  }
}

std::optional<Frame> ListenerSession::takeFrame(Time now) {
  if (frames_.empty()) return std::nullopt;
  Frame frame = std::move(frames_.front());
  frames_.pop_front();
  ++taken_;
  progress_at_ = std::max(progress_at_, now);
  if (owner_) sendAck(*owner_);
  return frame;
}

void ListenerSession::close(const Bye& bye, Time now) {
  if (closed_) return;
  closed_ = true;
  for (auto& [peer, connection] : connections_) {
    if (connection.close_at) continue;
    send(peer, MessageType::Bye, encode(bye));
    connection.close_at = now + seconds(kGoodbyeTime);
  }
}

ListenerSession::State ListenerSession::state() const {
  if (!frames_.empty()) return State::Open;
  if (ended_) return State::Ended;
  return failure_.empty() ? State::Open : State::Failed;
}

void ListenerSession::fail(const std::string& text, Time now) {
  failure_ = text;
  if (owner_) {
    const Peer peer = *owner_;
    send(peer, MessageType::Bye, encode(Bye{ByeReason::Failed, text}));
    connections_.at(peer).close_at = now + seconds(kGoodbyeTime);
    owner_.reset();
  }
}

void ListenerSession::sendAck(const Peer& peer) {
  send(peer, MessageType::Ack, encode(Ack{taken_}));
}

void ListenerSession::send(const Peer& peer, MessageType type, const Bytes& body) {
  Connection& connection = connections_.at(peer);
  const HeaderBytes header = connection.sealer.seal(type, connection.session, body);
  Bytes bytes(header.begin(), header.end());
  bytes.insert(bytes.end(), body.begin(), body.end());
  outgoing_.push_back({peer, std::move(bytes)});
}

std::vector<ListenerSession::Outgoing> ListenerSession::takeOutgoing() {
  return std::exchange(outgoing_, {});
}

std::vector<std::string> ListenerSession::takeEvents() {
  return std::exchange(events_, {});
}

void ListenerSession::event(const std::string& text) {
  ++event_count_;
  if (event_count_ < kLargestEvents) events_.push_back(text);
  if (event_count_ == kLargestEvents) events_.emplace_back("further events are not reported");
}

std::string ListenerSession::position() const {
  if (!input_) return "";
  return " after frame " + std::to_string(received_) + " of " + std::to_string(input_->frames);
}

}  // namespace detail
}  // namespace planar_mapping::transport
