// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/transport/detail/message_assembler.h"
#include "planar_mapping/transport/message.h"

namespace planar_mapping {
namespace transport {

/// What the mapping side asks of a front-end, and how long it waits.
struct ListenerSettings {
  std::string configuration;  ///< of the front-end: Welcome::configuration
  double timeout = 30.0;      ///< [ours] seconds without a frame after which it gives up, > 0
  std::uint32_t window = 4;   ///< [ours] frames that may wait in memory, 1 to 1024
  std::size_t largest_frame = kDefaultLargestFrame;  ///< bytes of a message, >= 64 kB

  /// \throws ParameterError
  PLANAR_MAPPING_EXPORT void validate() const;
};

namespace detail {

/// The mapping side's half of the protocol, without sockets, threads or clocks: bytes and times go
/// in, bytes and frames come out. Peers are known by a name the network layer gives them.
///
/// One peer at a time is the front-end. Whoever else connects is turned away, whoever breaks the
/// protocol is cut off, and neither touches the frames taken so far.
class PLANAR_MAPPING_EXPORT ListenerSession {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Peer = std::string;
  struct Outgoing {
    Peer peer;
    Bytes bytes;  ///< empty = close the connection
  };
  enum class State { Open, Ended, Failed };

  ListenerSession(const ListenerSettings& settings, Time now);

  // From the network.
  void connected(const Peer& peer, Time now);
  void disconnected(const Peer& peer, Time now);
  void received(const Peer& peer, const std::uint8_t* data, std::size_t size, Time now);
  /// To be called every now and then: signs of life, deadlines.
  void tick(Time now);
  /// To the network, in order.
  std::vector<Outgoing> takeOutgoing();

  // From the mapper.
  /// The oldest frame received, if there is one; it makes room for another.
  std::optional<Frame> takeFrame(Time now);
  /// Says goodbye to whoever is connected; nothing is taken from then on.
  void close(const Bye& bye, Time now);

  bool hasConnections() const { return !connections_.empty(); }
  /// Ended and Failed only once all frames are taken.
  State state() const;
  /// Why, when Failed.
  const std::string& failure() const { return failure_; }
  /// What the front-end says of its input, once one has.
  const std::optional<Ready>& input() const { return input_; }
  /// What a person should know: peers that came, went or were turned away. At most kLargestEvents
  /// in a session.
  std::vector<std::string> takeEvents();

  static constexpr std::size_t kLargestConnections = 16;
  static constexpr std::size_t kLargestEvents = 100;

 private:
  struct Connection {
    MessageAssembler assembler;
    MessageSealer sealer;
    std::uint64_t session = 0;   ///< 0 until welcomed
    std::uint64_t instance = 0;  ///< of Hello
    std::uint64_t progress = 0;
    bool ready = false;
    Time connected_at;
    Time heard_at;
    std::optional<Time> close_at;  ///< said goodbye; nothing more is read
  };

  std::size_t limitFor(const Peer& peer, const MessageHeader& header) const;
  void handle(const Peer& peer, const MessageHeader& header, const Bytes& body, Time now);
  void handleHello(const Peer& peer, const Hello& hello, Time now);
  void handleReady(const Peer& peer, const Ready& ready, Time now);
  void handleFrame(const Bytes& body, Time now);
  void handleProgress(Connection& connection, const Progress& progress, Time now);
  void handleEnd(const End& end);
  void handleBye(const Peer& peer, const Bye& bye, Time now);
  void welcome(const Peer& peer, Time now);
  void turnAway(const Peer& peer, ByeReason reason, const std::string& text, Time now);
  void sendAck(const Peer& peer);
  void send(const Peer& peer, MessageType type, const Bytes& body);
  void prolong(Time now);
  void fail(const std::string& text, Time now);
  void event(const std::string& text);
  void closeLateConnections(Time now);
  bool isOpen() const { return !ended_ && failure_.empty() && !closed_; }
  std::string position() const;
  std::string silence() const;

  ListenerSettings settings_;
  std::map<Peer, Connection> connections_;
  std::optional<Peer> owner_;  ///< the front-end
  std::uint64_t last_session_ = 0;
  std::uint64_t received_ = 0;  ///< frames
  std::uint64_t taken_ = 0;
  std::deque<Frame> frames_;
  std::optional<Ready> input_;
  bool ended_ = false;
  bool closed_ = false;
  int sessions_without_frame_ = 0;
  bool lost_ = false;  ///< there was a front-end, and it went without a word
  std::string failure_;
  Time progress_at_;  ///< something useful happened
  Time sign_of_life_at_;
  std::vector<Outgoing> outgoing_;
  std::vector<std::string> events_;
  std::size_t event_count_ = 0;
};

}  // namespace detail
}  // namespace transport
}  // namespace planar_mapping
