// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/front_end.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "planar_mapping/transport/message.h"
#include "tcp_peer.h"
#include "temporary_directory.h"
#include "transport_session.h"

namespace planar_mapping::transport {
namespace {

using std::chrono::milliseconds;

const Endpoint kAnyPort = {"127.0.0.1", 0};

::testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "no '" << part << "' in '" << text << "'";
}

/// A port on which nothing listens (any more).
Endpoint deadEndpoint() {
  return {"127.0.0.1", TcpPeer::listening().port()};
}

TEST(FrontEnd, AllFramesArriveOnceInOrderAndExactly) {
  for (const CloudEncoding encoding : {CloudEncoding::Raw, CloudEncoding::Compact}) {
    FrameListener listener(kAnyPort, listenerOptions());
    EXPECT_GT(listener.endpoint().port, 0);
    FrontEndOptions options = frontEndOptions();
    options.encoding = encoding;
    auto sender = sendInBackground(listener.endpoint(), {20}, options);
    EXPECT_EQ(io::PoseSource::File, listener.poseSource());
    EXPECT_EQ(io::SequenceKind::Clouds, listener.kind());
    EXPECT_EQ(20U, listener.size().value());
    EXPECT_TRUE(contains(listener.names().front(), "(fake)"));
    EXPECT_EQ(20U, takeAll(listener));
    const FrontEndResult result = sender.get();
    EXPECT_EQ(20U, result.frames_sent);
    EXPECT_GT(result.bytes_sent, 20U * 40 * 30);
    EXPECT_FALSE(result.interrupted);
  }
}

TEST(FrontEnd, ASlowMapperSlowsItDown) {
  FrameListener listener(kAnyPort, listenerOptions());
  std::atomic<std::uint64_t> made{0};
  auto sender = sendInBackground(listener.endpoint(), {30, ~std::uint64_t{0}, "", &made});
  (void)listener.kind();
  std::this_thread::sleep_for(milliseconds(200));
  EXPECT_LE(made, 2U);  // one on its way, and the next one
  EXPECT_TRUE(listener.next().has_value());
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_LE(made, 3U);
  EXPECT_EQ(30U, takeAll(listener, 1));
  EXPECT_EQ(30U, sender.get().frames_sent);
}

TEST(FrontEnd, IsDoneWhenTheResultIsSafeAndNotBefore) {
  std::future<FrontEndResult> sender;
  {
    FrameListener listener(kAnyPort, listenerOptions());
    sender = sendInBackground(listener.endpoint(), {3});
    while (listener.next()) continue;
    listener.close();
    EXPECT_EQ(std::future_status::timeout, sender.wait_for(milliseconds(300)));
    listener.confirm();
    EXPECT_EQ(3U, sender.get().frames_sent);
  }
  {
    FrameListener listener(kAnyPort, listenerOptions());
    sender = sendInBackground(listener.endpoint(), {3});
    while (listener.next()) continue;
  }  // without a result
  EXPECT_TRUE(contains(errorOf([&]() { sender.get(); }), "could not save the map"));
}

TEST(FrontEnd, WaitsForAMapperThatStartsLater) {
  const Endpoint endpoint = deadEndpoint();
  auto sender = sendInBackground(endpoint, {3});
  std::this_thread::sleep_for(milliseconds(300));
  FrameListener listener(endpoint, listenerOptions());
  EXPECT_EQ(3U, takeAll(listener));
  EXPECT_EQ(3U, sender.get().frames_sent);
}

TEST(FrontEnd, GivesUpWhereNobodyListens) {
  const Endpoint endpoint = deadEndpoint();
  const std::string error = errorOf([&]() { sendFakeFrames(endpoint, {}, frontEndOptions(0.3)); });
  EXPECT_TRUE(contains(error, "the mapping side at " + toText(endpoint) +
                                  " cannot be reached within 0.3 s; start it with"));
}

TEST(FrontEnd, GoesOnAfterACrash) {
  FrameListener listener(kAnyPort, listenerOptions());
  // A crash loses what is on its way: it may only come once five frames have arrived.
  std::atomic<bool> may_fail{false};
  auto crashing = sendInBackground(listener.endpoint(), {12, 6, "", nullptr, &may_fail});
  for (std::uint64_t i = 0; i < 5; ++i) EXPECT_TRUE(listener.next().has_value());
  may_fail = true;
  EXPECT_EQ("crash", errorOf([&]() { crashing.get(); }));
  std::atomic<std::uint64_t> made{0};
  auto again = sendInBackground(listener.endpoint(), {12, ~std::uint64_t{0}, "", &made});
  EXPECT_EQ(12U, takeAll(listener, 5));
  EXPECT_EQ(12U, again.get().frames_sent);  // takeAll() saw each once all the same
  EXPECT_EQ(12U, made);
}

TEST(FrontEnd, SendsAgainWhatWasNotAcknowledgedAndBeginsAgainForARestartedMapper) {
  std::vector<std::string> said;
  FrontEndOptions options = frontEndOptions();
  options.say = [&said](const std::string& text) { said.push_back(text); };
  const Endpoint endpoint = deadEndpoint();
  auto sender = sendInBackground(endpoint, {6}, options);
  // A mapping side that acknowledges one frame, and vanishes without a word at the next one.
  const auto mapOnce = [&](std::uint64_t next_frame) {
    zmq::context_t context;
    zmq::socket_t router(context, zmq::socket_type::router);
    router.bind(zmqAddress(endpoint));
    std::vector<std::uint64_t> positions;
    while (positions.size() < 2) {
      std::optional<Received> message = receive(router, true);
      if (!message) continue;
      message->open();
      if (message->type == MessageType::Hello) {
        send(router, message->peer, MessageType::Welcome, 0,
             encode(Welcome{"version: 1\n", next_frame, 1000000}));
      } else if (message->type == MessageType::Frame) {
        ByteReader reader = message->reader();
        decode<InputDescription>(reader);
        positions.push_back(decode<Count>(reader).frames);
        if (positions.size() == 1)
          send(router, message->peer, MessageType::Ack, 0, encode(Count{positions[0] + 1}));
      }
    }
    return positions;
  };
  EXPECT_EQ((std::vector<std::uint64_t>{0, 1}), mapOnce(0));
  EXPECT_EQ((std::vector<std::uint64_t>{1, 2}), mapOnce(1));  // the same one is back
  FrameListener listener(endpoint, listenerOptions());        // another one
  EXPECT_EQ(6U, takeAll(listener));
  EXPECT_GE(sender.get().frames_sent, 10U);
  ASSERT_EQ(3U, said.size());
  EXPECT_TRUE(contains(said[0], "lost the connection"));
  EXPECT_TRUE(contains(said[1], "lost the connection"));
  EXPECT_TRUE(contains(said[2], "was restarted: beginning again"));
}

TEST(FrontEnd, AStopSaysGoodbyeAndTheMapperKnowsWhy) {
  FrameListener listener(kAnyPort, listenerOptions());
  std::atomic<bool> stop{false};
  FrontEndOptions options = frontEndOptions();
  options.stop = &stop;
  auto sender = sendInBackground(listener.endpoint(), {50}, options);
  EXPECT_TRUE(listener.next().has_value());
  stop = true;
  EXPECT_TRUE(sender.get().interrupted);
  EXPECT_TRUE(contains(errorOf([&]() { takeAll(listener, 1); }), "the front-end was interrupted"));
}

TEST(FrontEnd, AStopEndsTheWaitForAMapper) {
  std::atomic<bool> stop{true};
  FrontEndOptions options = frontEndOptions(60.0);
  options.stop = &stop;
  EXPECT_TRUE(sendFakeFrames(deadEndpoint(), {}, options).interrupted);
}

TEST(FrontEnd, AStoppedMapperTellsTheFrontEnd) {
  std::atomic<bool> stop{false};
  ListenerOptions options = listenerOptions();
  options.stop = &stop;
  std::string error;
  {
    FrameListener listener(kAnyPort, options);
    auto sender = sendInBackground(listener.endpoint(), {50});
    EXPECT_TRUE(listener.next().has_value());
    stop = true;
    while (listener.next()) continue;
    error = errorOf([&]() { sender.get(); });
  }
  EXPECT_TRUE(contains(error, "ended the session: the mapping side was interrupted"));
}

TEST(FrontEnd, AMapperThatFailsTellsTheFrontEnd) {
  std::future<FrontEndResult> sender;
  {
    FrameListener listener(kAnyPort, listenerOptions());
    sender = sendInBackground(listener.endpoint(), {50});
    EXPECT_TRUE(listener.next().has_value());
  }
  EXPECT_TRUE(contains(errorOf([&]() { sender.get(); }),
                       "ended the session: the mapping side could not go on to the last frame"));
}

TEST(FrontEnd, ItsOwnFailureReachesTheMapper) {
  FrameListener listener(kAnyPort, listenerOptions());
  auto sender = sendInBackground(listener.endpoint(), {8, 2, "left/000002.png: gone"});
  const std::string error = errorOf([&]() { takeAll(listener); });
  EXPECT_EQ("the front-end gave up after frame 2 of 8: left/000002.png: gone", error);
  EXPECT_EQ("left/000002.png: gone", errorOf([&]() { sender.get(); }));
}

TEST(FrontEnd, FramesLargerThanAllowedAreNotSent) {
  std::string said;
  ListenerOptions options = listenerOptions(1.0);
  options.max_frame = 65536;
  options.say = [&said](const std::string& text) { said += text; };
  FrameListener listener(kAnyPort, options);
  auto sender = std::async(std::launch::async, [&]() {
    struct Large : FakeSource {
      using FakeSource::FakeSource;
      std::optional<Frame> next() override { return transportFrame(320, 240); }
    };
    return errorOf([&]() {
      runFrontEnd(
          listener.endpoint(),
          [](const std::string&) { return std::make_unique<Large>(FakeSource::Plan()); },
          frontEndOptions());
    });
  });
  EXPECT_TRUE(contains(errorOf([&]() { listener.next(); }), "no front-end connected"));
  EXPECT_TRUE(contains(said, "a front-end gave up before its first frame: frame 0 takes "));
  EXPECT_TRUE(
      contains(sender.get(), "takes 65536 at most; start it with a larger --max-message-mb"));
}

TEST(FrontEnd, AMapperThatNeverAnswersIsGivenUp) {
  TcpPeer silent = TcpPeer::listening();
  const std::string error = errorOf([&]() {
    sendFakeFrames({"127.0.0.1", silent.port()}, {}, frontEndOptions(0.3));
  });
  EXPECT_TRUE(contains(error, "does not answer within 0.3 s; is it 'planar_map run --listen'?"));
}

TEST(FrontEnd, ItTriesAgainAfterEachConnectionThatIsClosed) {
  // A connection is given up while ZeroMQ's thread still reports of it: that must not stop it.
  TcpPeer listening = TcpPeer::listening();
  constexpr int kClosed = 12;
  auto closing = std::async(std::launch::async, [&]() {
    for (int i = 0; i < kClosed; ++i) (void)listening.accept();
  });
  const std::string error = errorOf([&]() {
    sendFakeFrames({"127.0.0.1", listening.port()}, {}, frontEndOptions(3.0));
  });
  EXPECT_EQ(std::future_status::ready, closing.wait_for(milliseconds(0)));
  while (closing.wait_for(milliseconds(0)) != std::future_status::ready)
    TcpPeer::to(listening.port());
  EXPECT_FALSE(error.empty());
}

TEST(FrontEnd, SomethingElseThanAMapperIsNamed) {
  for (const std::string& greeting :
       {std::string("HTTP/1.1 400 Bad Request\r\n\r\n"), std::string("SSH-2.0-OpenSSH\r\n"),
        std::string(5000, '\0')}) {
    TcpPeer listening = TcpPeer::listening();
    auto server = std::async(std::launch::async, [&]() {
      TcpPeer peer = listening.accept();
      peer.send(greeting);
      std::this_thread::sleep_for(milliseconds(500));
    });
    const std::string error = errorOf([&]() {
      sendFakeFrames({"127.0.0.1", listening.port()}, {}, frontEndOptions(0.5));
    });
    EXPECT_TRUE(contains(error, "'planar_map run "));
  }
}

TEST(FrontEnd, WorksOverIpc) {
  const TemporaryDirectory directory;
  FrameListener listener(parseEndpoint("ipc://" + (directory / "socket")), listenerOptions());
  auto sender = sendInBackground(listener.endpoint(), {5});
  EXPECT_EQ(5U, takeAll(listener));
  EXPECT_EQ(5U, sender.get().frames_sent);
}

TEST(FrontEnd, APortInUseAndAForeignAddressAreNamed) {
  const FrameListener listener(kAnyPort, listenerOptions());
  const std::string in_use =
      errorOf([&]() { FrameListener second(listener.endpoint(), listenerOptions()); });
  EXPECT_TRUE(contains(in_use, "cannot listen on " + toText(listener.endpoint()) +
                                   ": another program listens there"));
  const std::string foreign = errorOf([]() {
    FrameListener other({"192.0.2.1", 0}, listenerOptions());
  });
  EXPECT_TRUE(contains(foreign, "this machine has no such address"));
}

TEST(FrontEnd, AMapperWithoutAFrontEndGivesUp) {
  FrameListener listener(kAnyPort, listenerOptions(0.2));
  EXPECT_TRUE(contains(errorOf([&]() { (void)listener.kind(); }), "no front-end connected"));
  EXPECT_TRUE(contains(errorOf([&]() { listener.next(); }), "no front-end connected"));
}

TEST(FrontEnd, AFrontEndThatNeverComesBackIsGivenUp) {
  FrameListener listener(kAnyPort, listenerOptions(0.8));
  auto crashing = sendInBackground(listener.endpoint(), {8, 2});
  EXPECT_EQ("the front-end went away after frame 2 of 8 and did not come back for 0.8 s",
            errorOf([&]() { takeAll(listener); }));
  EXPECT_EQ("crash", errorOf([&]() { crashing.get(); }));
}

}  // namespace
}  // namespace planar_mapping::transport
