// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/frame_listener.h"

#include <cerrno>
#include <iterator>
#include <zmq_addon.hpp>

#include "planar_mapping/transport/connection_guard.h"
#include "planar_mapping/transport/frame_session.h"
#include "planar_mapping/transport/message.h"

namespace planar_mapping::transport {
namespace {

constexpr int kMaxMessagesPerTurn = 64;

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
    session.sayGoodbye();
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
    if (!session.input()) waitForFrame();
    return session.input() ? &*session.input() : nullptr;
  }

  /// Until a frame waits, the session is over or a stop is requested.
  void waitForFrame() {
    session.awaitFrame();
    const auto is_over = [this] { return session.hasFrame() || session.hasEnded(); };
    while (!is_over() && !session.stopRequested()) {
      session.requireOwner();
      poll(router, authenticator, kPollInterval);
      authenticate();
      guard.watch();
      for (int i = 0; i < kMaxMessagesPerTurn && !is_over(); ++i) {
        std::optional<Received> message = receive(router, true);
        if (!message) break;
        session.take(*message);
      }
      session.checkTime();
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
    if (!admitted) session.report("turned a peer away: its key is not among those of --keys");
    const std::string id = parts.size() > 1 ? parts[1].to_string() : "";
    const std::string reply[] = {"1.0", id, admitted ? "200" : "400", "", "", ""};
    std::vector<zmq::const_buffer> buffers;
    for (const std::string& text : reply) buffers.push_back(zmq::buffer(text));
    zmq::send_multipart(authenticator, buffers);
  }

  const ListenerOptions options;
  Endpoint endpoint;
  zmq::context_t context{1};
  zmq::socket_t authenticator{context, zmq::socket_type::rep};
  zmq::socket_t router{context, zmq::socket_type::router};
  ConnectionGuard guard{context, router};
  bool is_closed = false;
  FrameSession session{options,
                       {[this](const std::string& peer, MessageType type, const Bytes& body) {
                          return send(router, peer, type, 0, body);
                        },
                        [this](zmq::message_t& envelope) { guard.protect(envelope); }}};
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
  if (!impl_->session.input()) return std::nullopt;
  return impl_->session.input()->frames;
}

std::optional<Frame> FrameListener::next() {
  impl_->waitForFrame();
  return impl_->session.takeFrame();
}

void FrameListener::close() {
  impl_->close();
}

void FrameListener::confirm() {
  impl_->session.sayGoodbye(true);
}

}  // namespace planar_mapping::transport
