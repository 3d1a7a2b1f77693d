// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/frame_session.h"

namespace planar_mapping::transport {
namespace {

constexpr double kAckInterval = 0.25;  // seconds; shows whether the front-end is there
// Of a session: what a front-end may add to run.log and to the columns of frames.csv.
constexpr std::size_t kMaxNoteBytes = std::size_t{1} << 20U;
constexpr std::size_t kMaxStatisticNames = 64;
constexpr std::uint64_t kMaxFrames = 1000000000;

bool isSame(const InputDescription& a, const InputDescription& b) {
  return a.kind == b.kind && a.pose_source == b.pose_source && a.frames == b.frames &&
         a.fingerprint == b.fingerprint;
}

}  // namespace

FrameSession::FrameSession(const ListenerOptions& options, Peers peers)
    : options_(options), peers_(std::move(peers)) {}

void FrameSession::take(Received& message) {
  try {
    handle(message);
  } catch (const VersionError& error) {
    refuse(message, ByeReason::Version, error.what());
  } catch (const ProtocolError& error) {
    refuse(message, ByeReason::Protocol, error.what());
  }
}

void FrameSession::handle(Received& message) {
  message.open();
  ByteReader reader = message.reader();
  if (message.type == MessageType::Bye) return handleBye(message, decode<Bye>(reader));
  if (message.type == MessageType::Welcome || message.type == MessageType::Ack)
    throw ProtocolError("a message came out of turn");
  if (isServingAnother(message))
    return refuse(message, ByeReason::Busy,
                  "the mapping side is serving another front-end already");
  if (message.type == MessageType::Hello) return welcome(message);
  const auto described = decode<InputDescription>(reader);
  if (described.frames < 1 || described.frames > kMaxFrames)
    ByteReader::fail("frames", "is not within 1 and 1e9");
  if (input_ && !isSame(*input_, described))
    return refuse(message, ByeReason::OtherInput,
                  "this map was begun from another input (" + input_->name + ", " +
                      std::to_string(input_->frames) + " frames)");
  const auto count = decode<Count>(reader).frames;
  if (message.type == MessageType::Frame) return handleFrame(message, described, count, reader);
  if (count != received() || (!isOwner(message) && count != described.frames))
    throw ProtocolError("it ends after " + std::to_string(count) + " frames, but " +
                        std::to_string(received()) + " came");
  setOwner(message);
  ended_ = true;
}

/// The next frame, if valid, makes its sender the owner of the session. Earlier ones, of a
/// front-end that was restarted, are acknowledged unread.
void FrameSession::handleFrame(Received& message, const InputDescription& described,
                               std::uint64_t at, ByteReader& reader) {
  if (at >= described.frames) ByteReader::fail("position", "is beyond the last frame");
  if (at > received()) ByteReader::fail("position", "is beyond the next frame");
  if (at < received()) {
    if (at >= repeated_) progress_at_ = Clock::now();
    repeated_ = std::max(repeated_, at + 1);
    peers_.send(message.peer, MessageType::Ack, encode(Count{at + 1}));
    return;
  }
  Frame decoded = decodeFrame(reader, options_.max_frame);
  input_ = input_ ? input_ : described;
  setOwner(message);
  limitNotes(decoded);
  frame_ = std::move(decoded);
  repeated_ = 0;
}

void FrameSession::handleBye(const Received& message, const Bye& bye) {
  const std::string what = bye.reason == ByeReason::Interrupted ? "was interrupted" : "gave up";
  const std::string why = bye.text.empty() ? "" : ": " + bye.text;
  if (!isOwner(message)) return report("a front-end " + what + " before its first frame" + why);
  owner_connected_ = false;
  failure_ = "the front-end " + what + position() + why;
}

void FrameSession::welcome(Received& message) {
  if (isOwner(message)) setOwner(message);
  if (!owner_) setPeer(message);  // hears of the end, if there is no frame before
  peers_.send(message.peer, MessageType::Welcome,
              encode(Welcome{options_.configuration, received(), options_.max_frame}));
}

bool FrameSession::isServingAnother(const Received& message) {
  if (isOwner(message) || !owner_connected_) return false;
  probeOwner();
  return owner_connected_;
}

void FrameSession::setOwner(Received& message) {
  if (!owner_connected_)
    report(owner_ ? "a front-end is back" + position() : "a front-end is connected");
  owner_ = message.instance;
  setPeer(message);
  owner_connected_ = true;
}
void FrameSession::setPeer(Received& message) {
  owner_peer_ = message.peer;
  peers_.protect(message.envelope);
}

/// Acknowledges, and finds out whether the owner is still there.
void FrameSession::probeOwner() {
  ack_at_ = Clock::now();
  if (!owner_connected_) return;
  if (peers_.send(owner_peer_, MessageType::Ack, encode(Count{taken_})) == Sent::Unreachable) {
    owner_connected_ = false;
    progress_at_ = Clock::now();  // it has the whole timeout to come back
    report("lost the connection to the front-end" + position());
  }
}

/// What a front-end reports beside its frames grows no further than stated.
void FrameSession::limitNotes(Frame& received) {
  for (std::vector<std::string>* texts : {&received.notes, &received.warnings}) {
    for (const std::string& text : *texts) note_bytes_ += text.size();
    if (note_bytes_ > kMaxNoteBytes) texts->clear();
  }
  const auto is_surplus = [this](const FrameStatistic& item) {
    if (statistic_names_.size() < kMaxStatisticNames) statistic_names_.insert(item.name);
    return statistic_names_.count(item.name) == 0;
  };
  auto& items = received.statistics;
  items.erase(std::remove_if(items.begin(), items.end(), is_surplus), items.end());
}

void FrameSession::refuse(const Received& message, ByeReason reason, const std::string& text) {
  peers_.send(message.peer, MessageType::Bye, encode(Bye{reason, text}));
  const bool is_owner = owner_connected_ && message.peer == owner_peer_;
  report((is_owner ? "cut off the front-end" + position() + ": " : "turned a peer away: ") + text);
  if (is_owner) owner_connected_ = false;
}

void FrameSession::sayGoodbye(bool is_done) {
  if (std::exchange(said_goodbye_, true)) return;
  Bye bye{ByeReason::Failed, "the mapping side could not " +
                                 std::string(ended_ ? "save the map" : "go on to the last frame") +
                                 "; it says why on its own screen"};
  if (is_done) {
    bye = {ByeReason::Done, ""};
  } else if (stopRequested()) {
    bye = {ByeReason::Interrupted, "the mapping side was interrupted"};
  }
  if (!owner_peer_.empty()) peers_.send(owner_peer_, MessageType::Bye, encode(bye));
}

void FrameSession::report(const std::string& text) {
  if (++events_ > kMaxEvents || !options_.say) return;
  options_.say(events_ < kMaxEvents ? text : "further events are not reported");
}

void FrameSession::checkTime() {
  if (secondsSince(ack_at_) > kAckInterval) probeOwner();
  if (frame_ || ended_ || !failure_.empty() || secondsSince(progress_at_) <= options_.timeout)
    return;
  const std::string within = " for " + secondsText(options_.timeout);
  if (owner_connected_) throw InputError("the front-end sent nothing" + within + position());
  if (owner_)
    throw InputError("the front-end went away" + position() + " and did not come back" + within);
  throw InputError("no front-end connected" + within +
                   "; start one with 'planar_map frontend -i SEQUENCE --connect HOST:PORT', or "
                   "wait longer with --timeout");
}

std::optional<Frame> FrameSession::takeFrame() {
  if (!frame_ || stopRequested()) {
    if (!ended_) sayGoodbye();
    return std::nullopt;
  }
  std::optional<Frame> frame = std::exchange(frame_, std::nullopt);
  ++taken_;
  probeOwner();
  return frame;
}

void FrameSession::requireOwner() const {
  if (!failure_.empty()) throw InputError(failure_);
}

std::string FrameSession::position() const {
  if (!input_) return "";
  return " after frame " + std::to_string(received()) + " of " + std::to_string(input_->frames);
}

}  // namespace planar_mapping::transport
