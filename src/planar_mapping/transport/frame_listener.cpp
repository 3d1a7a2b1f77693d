// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/frame_listener.h"

#include <cerrno>
#include <iterator>
#include <set>
#include <zmq_addon.hpp>

#include "planar_mapping/transport/connection_guard.h"
#include "planar_mapping/transport/message.h"

namespace planar_mapping::transport {
namespace {

constexpr double kAckInterval = 0.25;  // seconds; shows whether the front-end is there
constexpr int kMaxMessagesPerTurn = 64;
constexpr int kMaxEvents = 100;
// Of a session: what a front-end may add to run.log and to the columns of frames.csv.
constexpr std::size_t kMaxNoteBytes = std::size_t{1} << 20U;
constexpr std::size_t kMaxStatisticNames = 64;
constexpr std::uint64_t kMaxFrames = 1000000000;

std::string advice(int error_number) {
  switch (error_number) {
    case EADDRINUSE:
      return "another program listens there; choose another port, or 0 for any free one";
    case EACCES:
    case EPERM:
      return "this needs more rights; choose a port from 1024 on";
    case EADDRNOTAVAIL:
    case ENODEV:
      return "this machine has no such address; give one of its own, or 0.0.0.0 for all";
    default:
      return zmq_strerror(error_number);
  }
}

bool isSame(const InputDescription& a, const InputDescription& b) {
  return a.kind == b.kind && a.pose_source == b.pose_source && a.frames == b.frames &&
         a.fingerprint == b.fingerprint;
}

}  // namespace

void ListenerOptions::validate() const {
  requireInRange("timeout", timeout, 0.01, 1e6, "s");
  requireInRange("max_frame", static_cast<double>(max_frame), 65536.0, 4294967295.0, "B");
}

struct FrameListener::Impl {
  Impl(const Endpoint& where, ListenerOptions asked) : options(std::move(asked)) {
    options.validate();
    try {
      listen(where);
    } catch (const zmq::error_t& error) {
      throw InputError("cannot listen on " + toText(where) + ": " + advice(error.num()));
    }
  }

  ~Impl() {
    close();
    sayGoodbye();
  }

  void listen(const Endpoint& where) {
    const Endpoint address = resolved(where);
    configure(router, address, options.keys, options.max_frame + kMaxText + 64);
    router.set(zmq::sockopt::router_mandatory, 1);  // sending tells that a peer is gone
    // ZeroMQ asks this socket before a peer gets as far as a message (RFC 27, ZAP). With it libzmq
    // refuses ZMTP 1, whose peers can make 4.3.4 abort.
    authenticator.bind("inproc://zeromq.zap.01");
    router.set(zmq::sockopt::zap_domain, "planar_mapping");
    if (!options.keys.secret_key.empty()) router.set(zmq::sockopt::curve_server, 1);
    router.bind(zmqAddress(address));
    endpoint = where;
    if (where.isIpc()) return;
    const std::string bound = router.get(zmq::sockopt::last_endpoint);
    endpoint.port = parseEndpoint(bound.substr(std::string("tcp://").size())).port;
  }

  const InputDescription* waitForInput() {
    if (!input) waitForFrame();
    return input ? &*input : nullptr;
  }

  /// Until a frame waits, the session is over or a stop is requested.
  void waitForFrame() {
    progress_at = Clock::now();
    while (!frame && !ended && !stopRequested()) {
      if (!failure.empty()) throw InputError(failure);
      poll(router, authenticator, kPollInterval);
      authenticate();
      guard.watch();
      for (int i = 0; i < kMaxMessagesPerTurn && !frame && !ended; ++i) {
        std::optional<Received> message = receive(router, true);
        if (!message) break;
        try {
          handle(*message);
        } catch (const VersionError& error) {
          refuse(*message, ByeReason::Version, error.what());
        } catch (const ProtocolError& error) {
          refuse(*message, ByeReason::Protocol, error.what());
        }
      }
      if (secondsSince(ack_at) > kAckInterval) probeOwner();
      if (!frame && !ended && failure.empty()) checkDeadline();
    }
  }

  void close() {
    if (!std::exchange(is_closed, true)) guard.close(endpoint);
  }

  /// Answers one request for admission: version, id, domain, address, identity, mechanism, key.
  void authenticate() {
    std::vector<zmq::message_t> parts;
    const auto flags = zmq::recv_flags::dontwait;
    if (!zmq::recv_multipart(authenticator, std::back_inserter(parts), flags)) return;
    bool admitted = options.keys.secret_key.empty();
    if (!admitted && parts.size() == 7 && parts[6].size() == 32) {
      char key[41] = {};
      zmq_z85_encode(key, parts[6].data<std::uint8_t>(), parts[6].size());
      const std::vector<std::string>& known = options.keys.peers;
      admitted = std::find(known.begin(), known.end(), key) != known.end();
    }
    if (!admitted) event("turned a peer away: its key is not among those of --keys");
    const std::string id = parts.size() > 1 ? parts[1].to_string() : "";
    const std::string reply[] = {"1.0", id, admitted ? "200" : "400", "", "", ""};
    std::vector<zmq::const_buffer> buffers;
    for (const std::string& text : reply) buffers.push_back(zmq::buffer(text));
    zmq::send_multipart(authenticator, buffers);
  }

  void handle(Received& message) {
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
    if (input && !isSame(*input, described))
      return refuse(message, ByeReason::OtherInput,
                    "this map was begun from another input (" + input->name + ", " +
                        std::to_string(input->frames) + " frames)");
    const auto count = decode<Count>(reader).frames;
    if (message.type == MessageType::Frame) return handleFrame(message, described, count, reader);
    if (count != received() || (!isOwner(message) && count != described.frames))
      throw ProtocolError("it ends after " + std::to_string(count) + " frames, but " +
                          std::to_string(received()) + " came");
    setOwner(message);
    ended = true;
  }

  /// The next frame, if valid, makes its sender the owner of the session. Earlier ones, of a
  /// front-end that was restarted, are acknowledged unread.
  void handleFrame(Received& message, const InputDescription& described, std::uint64_t at,
                   ByteReader& reader) {
    if (at >= described.frames) ByteReader::fail("position", "is beyond the last frame");
    if (at > received()) ByteReader::fail("position", "is beyond the next frame");
    if (at < received()) {
      if (at >= repeated) progress_at = Clock::now();
      repeated = std::max(repeated, at + 1);
      send(router, message.peer, MessageType::Ack, 0, encode(Count{at + 1}));
      return;
    }
    Frame decoded = decodeFrame(reader, options.max_frame);
    input = input ? input : described;
    setOwner(message);
    limitNotes(decoded);
    frame = std::move(decoded);
    repeated = 0;
  }

  void handleBye(const Received& message, const Bye& bye) {
    const std::string what = bye.reason == ByeReason::Interrupted ? "was interrupted" : "gave up";
    const std::string why = bye.text.empty() ? "" : ": " + bye.text;
    if (!isOwner(message)) return event("a front-end " + what + " before its first frame" + why);
    owner_connected = false;
    failure = "the front-end " + what + position() + why;
  }

  void welcome(Received& message) {
    if (isOwner(message)) setOwner(message);
    if (!owner) setPeer(message);  // hears of the end, if there is no frame before
    send(router, message.peer, MessageType::Welcome, 0,
         encode(Welcome{options.configuration, received(), options.max_frame}));
  }

  bool isServingAnother(const Received& message) {
    if (isOwner(message) || !owner_connected) return false;
    probeOwner();
    return owner_connected;
  }

  bool isOwner(const Received& message) const { return owner == message.instance; }
  void setOwner(Received& message) {
    if (!owner_connected)
      event(owner ? "a front-end is back" + position() : "a front-end is connected");
    owner = message.instance;
    setPeer(message);
    owner_connected = true;
  }
  void setPeer(Received& message) {
    owner_peer = message.peer;
    guard.protect(message.envelope);
  }

  /// Acknowledges, and finds out whether the owner is still there.
  void probeOwner() {
    ack_at = Clock::now();
    if (!owner_connected) return;
    if (send(router, owner_peer, MessageType::Ack, 0, encode(Count{taken})) == Sent::Unreachable) {
      owner_connected = false;
      progress_at = Clock::now();  // it has the whole timeout to come back
      event("lost the connection to the front-end" + position());
    }
  }

  /// What a front-end reports beside its frames grows no further than stated.
  void limitNotes(Frame& received) {
    for (std::vector<std::string>* texts : {&received.notes, &received.warnings}) {
      for (const std::string& text : *texts) note_bytes += text.size();
      if (note_bytes > kMaxNoteBytes) texts->clear();
    }
    const auto is_surplus = [this](const FrameStatistic& item) {
      if (statistic_names.size() < kMaxStatisticNames) statistic_names.insert(item.name);
      return statistic_names.count(item.name) == 0;
    };
    auto& items = received.statistics;
    items.erase(std::remove_if(items.begin(), items.end(), is_surplus), items.end());
  }

  void refuse(const Received& message, ByeReason reason, const std::string& text) {
    send(router, message.peer, MessageType::Bye, 0, encode(Bye{reason, text}));
    const bool is_owner = owner_connected && message.peer == owner_peer;
    event((is_owner ? "cut off the front-end" + position() + ": " : "turned a peer away: ") + text);
    if (is_owner) owner_connected = false;
  }

  void sayGoodbye(bool is_done = false) {
    if (std::exchange(said_goodbye, true)) return;
    Bye bye{ByeReason::Failed, "the mapping side could not " +
                                   std::string(ended ? "save the map" : "go on to the last frame") +
                                   "; it says why on its own screen"};
    if (is_done) {
      bye = {ByeReason::Done, ""};
    } else if (stopRequested()) {
      bye = {ByeReason::Interrupted, "the mapping side was interrupted"};
    }
    if (!owner_peer.empty()) send(router, owner_peer, MessageType::Bye, 0, encode(bye));
  }

  void event(const std::string& text) {
    if (++events > kMaxEvents || !options.say) return;
    options.say(events < kMaxEvents ? text : "further events are not reported");
  }

  void checkDeadline() const {
    if (secondsSince(progress_at) <= options.timeout) return;
    const std::string within = " for " + secondsText(options.timeout);
    if (owner_connected) throw InputError("the front-end sent nothing" + within + position());
    if (owner)
      throw InputError("the front-end went away" + position() + " and did not come back" + within);
    throw InputError("no front-end connected" + within +
                     "; start one with 'planar_map frontend -i SEQUENCE --connect HOST:PORT', or "
                     "wait longer with --timeout");
  }

  bool stopRequested() const { return options.stop != nullptr && *options.stop; }
  std::uint64_t received() const { return taken + (frame ? 1 : 0); }
  std::string position() const {
    if (!input) return "";
    return " after frame " + std::to_string(received()) + " of " + std::to_string(input->frames);
  }

  const ListenerOptions options;
  Endpoint endpoint;
  zmq::context_t context{1};
  zmq::socket_t authenticator{context, zmq::socket_type::rep};
  zmq::socket_t router{context, zmq::socket_type::router};
  ConnectionGuard guard{context, router};
  bool is_closed = false;
  std::optional<InputDescription> input;  ///< of the owner's first frame
  std::optional<std::uint64_t> owner;     ///< instance of the front-end that sent the last frame
  std::string owner_peer;                 ///< its connection
  bool owner_connected = false;
  std::optional<Frame> frame;  ///< next to be taken
  std::uint64_t taken = 0;     ///< frames
  bool ended = false;
  std::string failure;  ///< of the owner; thrown once all frames are taken
  bool said_goodbye = false;
  std::size_t note_bytes = 0;
  std::set<std::string> statistic_names;
  int events = 0;
  std::uint64_t repeated = 0;  ///< frames of a restarted front-end, since the last new one
  Clock::time_point progress_at = Clock::now();
  Clock::time_point ack_at = Clock::now();
};
FrameListener::FrameListener(const Endpoint& endpoint, ListenerOptions options)
    : impl_(std::make_unique<Impl>(endpoint, std::move(options))) {}

FrameListener::~FrameListener() = default;

const Endpoint& FrameListener::endpoint() const {
  return impl_->endpoint;
}

std::vector<std::string> FrameListener::names() const {
  const InputDescription* input = impl_->waitForInput();
  const std::string address = "front-end at " + toText(impl_->endpoint);
  return {input != nullptr ? address + " (" + input->name + ")" : address};
}

io::SequenceKind FrameListener::kind() const {
  const InputDescription* input = impl_->waitForInput();
  return input != nullptr ? input->kind : impl_->options.expected;
}

io::PoseSource FrameListener::poseSource() const {
  const InputDescription* input = impl_->waitForInput();
  return input != nullptr ? input->pose_source : io::PoseSource::File;
}

std::optional<std::size_t> FrameListener::size() const {
  if (!impl_->input) return std::nullopt;
  return impl_->input->frames;
}

std::optional<Frame> FrameListener::next() {
  impl_->waitForFrame();
  if (!impl_->frame || impl_->stopRequested()) {
    if (!impl_->ended) impl_->sayGoodbye();
    return std::nullopt;
  }
  std::optional<Frame> frame = std::exchange(impl_->frame, std::nullopt);
  ++impl_->taken;
  impl_->probeOwner();
  return frame;
}

void FrameListener::close() {
  impl_->close();
}

void FrameListener::confirm() {
  impl_->sayGoodbye(true);
}

}  // namespace planar_mapping::transport
