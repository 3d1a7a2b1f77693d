// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "mapper_connection.h"

namespace planar_mapping::transport::detail {

MapperConnection::MapperConnection(const Endpoint& endpoint, std::uint64_t instance)
    : instance_(instance), heard_at_(Clock::now()) {
  socket_.connect(endpoint);
}

void MapperConnection::pump(double seconds) {
  bool waited = false;
  while (!lost_ && !bye_) {
    const std::optional<StreamEvent> event = socket_.receive();
    if (!event) {
      if (waited) return;
      waited = true;
      socket_.wait(seconds);
      continue;
    }
    waited = true;  // something came: take what there is, then return
    heard_at_ = Clock::now();
    switch (event->kind) {
      case StreamEvent::Kind::Connected:
        peer_ = event->peer;
        send(MessageType::Hello, encode(Hello{instance_, "planar_map " PLANAR_MAPPING_VERSION}));
        break;
      case StreamEvent::Kind::Disconnected:
        lost_ = true;
        break;
      case StreamEvent::Kind::Data:
        assembler_.feed(
            event->data.data<std::uint8_t>(), event->data.size(),
            [this](const MessageHeader& header) { return limitFor(header); },
            [this](const MessageHeader& header, const Bytes& body) { handle(header, body); });
        break;
    }
  }
}

bool MapperConnection::send(MessageType type, const Bytes& body) {
  if (!peer_ || lost_) return false;
  const HeaderBytes header = sealer_.seal(type, session_, body);
  lost_ = !socket_.send(*peer_, header.data(), header.size()) ||
          (!body.empty() && !socket_.send(*peer_, body.data(), body.size()));
  return !lost_;
}

std::size_t MapperConnection::limitFor(const MessageHeader& header) const {
  const bool is_welcome = header.type == MessageType::Welcome;
  const bool allowed = header.type == MessageType::Bye || (is_welcome && !welcome_) ||
                       (header.type == MessageType::Ack && welcome_);
  if (!allowed || bye_) {
    throw ProtocolError("a message of type " + std::to_string(static_cast<int>(header.type)) +
                        " came out of turn");
  }
  if (!is_welcome && header.session != session_) {
    throw ProtocolError("a message belongs to another session");
  }
  return largestBody(header.type, 0);
}

void MapperConnection::handle(const MessageHeader& header, const Bytes& body) {
  switch (header.type) {
    case MessageType::Welcome:
      welcome_ = decodeWelcome(body);
      session_ = header.session;
      sent_ = welcome_->next_frame;
      break;
    case MessageType::Ack:
      handleAck(decodeAck(body));
      break;
    default:
      bye_ = decodeBye(body);
      break;
  }
}

void MapperConnection::handleAck(const Ack& ack) {
  if (ack.next_frame < acknowledged_ || ack.next_frame > sent_) {
    throw ProtocolError("it acknowledges frame " + std::to_string(ack.next_frame) +
                        ", which cannot be");
  }
  acknowledged_ = ack.next_frame;
}

}  // namespace planar_mapping::transport::detail
