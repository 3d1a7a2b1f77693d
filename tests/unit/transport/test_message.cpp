// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/message.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping::transport {
namespace {

Bytes bytesOf(const std::string& text) {
  return {text.begin(), text.end()};
}

template <typename Call>
std::string problemOf(const Call& call) {
  try {
    call();
  } catch (const ProtocolError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

Welcome someWelcome() {
  return {"version: 1\nstages: []\n", 7, 4, std::uint64_t{64} << 20U, 30.0};
}

Ready someReady() {
  return {io::SequenceKind::Stereo, io::PoseSource::File, 28, 0x123456789ABCDEF0U, "street"};
}

TEST(Message, HeaderIsAsTheDocumentLaysItOut) {
  // The check value of CRC-32 (IEEE 802.3) is 0xCBF43926.
  const HeaderBytes header =
      encodeHeader(MessageType::Frame, 0x0807060504030201U, 0x100F, bytesOf("123456789"));
  const std::uint8_t expected[] = {'P', 'M', 'F', 'E', 1, 0,    4,    0,    1,    2,   3,
                                   4,   5,   6,   7,   8, 0x0F, 0x10, 0,    0,    0,   0,
                                   0,   0,   9,   0,   0, 0,    0x26, 0x39, 0xF4, 0xCB};
  for (std::size_t i = 0; i < sizeof(expected); ++i) EXPECT_EQ(expected[i], header[i]) << i;
  const MessageHeader decoded = decodeHeader(header);
  EXPECT_EQ(MessageType::Frame, decoded.type);
  EXPECT_EQ(0x0807060504030201U, decoded.session);
  EXPECT_EQ(0x100FU, decoded.sequence);
  EXPECT_EQ(9U, decoded.body_bytes);
  EXPECT_NO_THROW(checkBody(decoded, bytesOf("123456789")));
}

TEST(Message, EveryFlippedBitOfAHeaderIsNoticed) {
  const HeaderBytes good = encodeHeader(MessageType::Ack, 5, 6, bytesOf("body"));
  for (std::size_t bit = 0; bit < 8 * kHeaderBytes; ++bit) {
    HeaderBytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_THROW(decodeHeader(bad), ProtocolError) << bit;
  }
}

TEST(Message, EveryFlippedBitAndEveryCutOfABodyIsNoticed) {
  const Bytes body = encode(someReady());
  const MessageHeader header = decodeHeader(encodeHeader(MessageType::Ready, 1, 2, body));
  for (std::size_t bit = 0; bit < 8 * body.size(); ++bit) {
    Bytes bad = body;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_THROW(checkBody(header, bad), ProtocolError) << bit;
  }
  for (std::size_t size = 0; size < body.size(); ++size) {
    const Bytes cut(body.begin(), body.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_THROW(checkBody(header, cut), ProtocolError) << size;
  }
}

TEST(Message, OtherProtocolsAndVersionsAreToldApart) {
  HeaderBytes http{};
  const std::string request = "GET / HTTP/1.1\r\nHost: localhost\r\nAccept: */*\r\n";
  std::copy_n(request.begin(), kHeaderBytes, http.begin());
  EXPECT_EQ("these are no messages of a planar_map front-end",
            problemOf([&]() { decodeHeader(http); }));
  HeaderBytes newer = encodeHeader(MessageType::Hello, 0, 0, {});
  newer[4] = 9;
  EXPECT_THROW(decodeHeader(newer), VersionError);
  EXPECT_NE(std::string::npos,
            problemOf([&]() { decodeHeader(newer); }).find("version 9 of the front-end protocol"));
}

TEST(Message, LimitsDependOnTheType) {
  EXPECT_EQ(kLargestControlBody, largestBody(MessageType::Hello, 1000000));
  EXPECT_EQ(kLargestControlBody, largestBody(MessageType::Bye, 1000000));
  EXPECT_EQ(kLargestWelcomeBody, largestBody(MessageType::Welcome, 1000000));
  EXPECT_EQ(1000000U, largestBody(MessageType::Frame, 1000000));
}

TEST(Message, ControlMessagesComeBackAsTheyWere) {
  const Hello hello = decodeHello(encode(Hello{42, "planar_map 0.1.0"}));
  EXPECT_EQ(42U, hello.instance);
  EXPECT_EQ("planar_map 0.1.0", hello.software);
  const Welcome welcome = decodeWelcome(encode(someWelcome()));
  EXPECT_EQ("version: 1\nstages: []\n", welcome.configuration);
  EXPECT_EQ(7U, welcome.next_frame);
  EXPECT_EQ(4U, welcome.window);
  EXPECT_EQ(std::uint64_t{64} << 20U, welcome.largest_frame);
  EXPECT_EQ(30.0, welcome.timeout);
  const Ready ready = decodeReady(encode(someReady()));
  EXPECT_EQ(io::SequenceKind::Stereo, ready.kind);
  EXPECT_EQ(io::PoseSource::File, ready.pose_source);
  EXPECT_EQ(28U, ready.frames);
  EXPECT_EQ(0x123456789ABCDEF0U, ready.fingerprint);
  EXPECT_EQ("street", ready.name);
  EXPECT_EQ(11U, decodeAck(encode(Ack{11})).next_frame);
  EXPECT_EQ(12U, decodeProgress(encode(Progress{12})).frames);
  EXPECT_EQ(13U, decodeEnd(encode(End{13})).frames);
  const Bye bye = decodeBye(encode(Bye{ByeReason::Busy, "another one"}));
  EXPECT_EQ(ByeReason::Busy, bye.reason);
  EXPECT_EQ("another one", bye.text);
}

struct BodyCase {
  const char* name;
  Bytes body;
  std::function<void(const Bytes&)> decode;
};

std::vector<BodyCase> allBodies() {
  return {{"hello", encode(Hello{1, "a"}), [](const Bytes& b) { decodeHello(b); }},
          {"welcome", encode(someWelcome()), [](const Bytes& b) { decodeWelcome(b); }},
          {"ready", encode(someReady()), [](const Bytes& b) { decodeReady(b); }},
          {"ack", encode(Ack{1}), [](const Bytes& b) { decodeAck(b); }},
          {"progress", encode(Progress{1}), [](const Bytes& b) { decodeProgress(b); }},
          {"end", encode(End{1}), [](const Bytes& b) { decodeEnd(b); }},
          {"bye", encode(Bye{ByeReason::Done, "x"}), [](const Bytes& b) { decodeBye(b); }}};
}

TEST(Message, CutBodiesAndTrailingBytesAreErrors) {
  for (const BodyCase& item : allBodies()) {
    EXPECT_NO_THROW(item.decode(item.body)) << item.name;
    for (std::size_t size = 0; size < item.body.size(); ++size) {
      const Bytes cut(item.body.begin(), item.body.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_THROW(item.decode(cut), ProtocolError) << item.name << ' ' << size;
    }
    Bytes longer = item.body;
    longer.push_back(0);
    EXPECT_THROW(item.decode(longer), ProtocolError) << item.name;
  }
}

TEST(Message, RandomBodiesThrowOrDecodeButNeverMore) {
  Random random(7);
  const std::vector<BodyCase> cases = allBodies();
  for (int i = 0; i < 20000; ++i) {
    const BodyCase& item = cases[random.below(cases.size())];
    Bytes body = item.body;
    if (random.below(2) == 0) {
      body.assign(random.below(64), 0);
      for (std::uint8_t& byte : body) byte = static_cast<std::uint8_t>(random.below(256));
    } else {
      body[random.below(body.size())] = static_cast<std::uint8_t>(random.below(256));
    }
    try {
      item.decode(body);
    } catch (const ProtocolError&) {
      continue;
    }
  }
}

TEST(Message, ATextThatAnnouncesMoreThanWasSentIsNotAllocated) {
  Bytes body = encode(Hello{1, "abc"});
  for (std::size_t i = 8; i < 12; ++i) body[i] = 0xFF;
  EXPECT_EQ("field 'software' announces 4294967295 items, more than there are",
            problemOf([&]() { decodeHello(body); }));
}

TEST(Message, ValuesOutOfRangeAreErrors) {
  Bytes kind = encode(someReady());
  kind[0] = 3;
  EXPECT_THROW(decodeReady(kind), ProtocolError);
  Bytes pose_source = encode(someReady());
  pose_source[1] = 255;
  EXPECT_THROW(decodeReady(pose_source), ProtocolError);
  Ready empty = someReady();
  empty.frames = 0;
  EXPECT_THROW(decodeReady(encode(empty)), ProtocolError);
  Bytes reason = encode(Bye{ByeReason::Done, ""});
  reason[0] = 7;
  EXPECT_THROW(decodeBye(reason), ProtocolError);
  for (const double timeout : {0.0, -1.0, 1e7, std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity()}) {
    Welcome welcome = someWelcome();
    welcome.timeout = timeout;
    EXPECT_THROW(decodeWelcome(encode(welcome)), ProtocolError) << timeout;
  }
  for (const std::uint32_t window : {0U, 1025U}) {
    Welcome welcome = someWelcome();
    welcome.window = window;
    EXPECT_THROW(decodeWelcome(encode(welcome)), ProtocolError) << window;
  }
}

TEST(Message, TextsBecomeOnePrintableLine) {
  const auto through = [](const std::string& text) {
    return decodeBye(encode(Bye{ByeReason::Failed, text})).text;
  };
  EXPECT_EQ("red ?[31m text?new line", through("red \033[31m text\nnew line"));
  EXPECT_EQ(
      "Stra\xC3\x9F"
      "e \xE2\x82\xAC \xF0\x9F\xA4\x96",
      through("Stra\xC3\x9F"
              "e \xE2\x82\xAC \xF0\x9F\xA4\x96"));
  EXPECT_EQ("????", through("\xFF\xC0\x80\xC2"));  // no UTF-8
  EXPECT_EQ("???", through("\xED\xA0\x80"));       // a surrogate
  EXPECT_EQ("????", through("\xF4\x90\x80\x80"));  // beyond Unicode
  EXPECT_EQ("?x", through("\xC2\x9B"
                          "x"));  // C1: starts a control sequence
  EXPECT_EQ(std::string(1, '?'), through(std::string(1, '\0')));
  EXPECT_EQ(kLargestText, through(std::string(10000, 'a')).size());
}

}  // namespace
}  // namespace planar_mapping::transport
