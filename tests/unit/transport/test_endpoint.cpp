// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/endpoint.h"

#include <gtest/gtest.h>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::transport {
namespace {

TEST(Endpoint, ReadsHostAndPort) {
  const Endpoint named = parseEndpoint("robot.local:5555");
  EXPECT_EQ("robot.local", named.host);
  EXPECT_EQ(5555, named.port);
  const Endpoint ipv6 = parseEndpoint("[::1]:80");
  EXPECT_EQ("::1", ipv6.host);
  EXPECT_EQ(80, ipv6.port);
}

TEST(Endpoint, APortAloneStaysOnThisMachine) {
  const Endpoint endpoint = parseEndpoint("5555");
  EXPECT_EQ("127.0.0.1", endpoint.host);
  EXPECT_EQ(5555, endpoint.port);
}

TEST(Endpoint, TextComesBack) {
  for (const char* text : {"127.0.0.1:0", "[::1]:65535", "a-b.c:1", "ipc:///tmp/x"}) {
    EXPECT_EQ(text, toText(parseEndpoint(text)));
  }
}

TEST(Endpoint, AnythingElseIsAnError) {
  for (const char* text :
       {"", ":", "host:", ":5555", "host:65536", "host:-1", "host:12x", "host", "::1:80", "[]:80",
        "[::1]", "a b:1", "tcp://host:1", "ipc://", "1.5", " 80"}) {
    EXPECT_THROW(parseEndpoint(text), InputError) << text;
  }
}

TEST(Endpoint, OnlyThisMachineIsLoopback) {
  for (const char* text : {"5555", "localhost:1", "127.8.9.1:1", "[::1]:1", "ipc:///tmp/x"}) {
    EXPECT_TRUE(isLoopback(parseEndpoint(text))) << text;
  }
  for (const char* text : {"0.0.0.0:1", "[::]:1", "192.0.2.1:1"}) {
    EXPECT_FALSE(isLoopback(parseEndpoint(text))) << text;
  }
}

TEST(Endpoint, AddressesResolveToThemselvesAndUnknownNamesDoNot) {
  EXPECT_EQ("127.0.0.1", resolved({"127.0.0.1", 1}).host);
  EXPECT_EQ("127.0.0.1", resolved({"localhost", 1}).host);
  try {
    resolved({"no-such-host.invalid", 1});
    FAIL() << "resolved";
  } catch (const InputError& error) {
    EXPECT_NE(std::string::npos,
              std::string(error.what()).find("'no-such-host.invalid' cannot be resolved"));
  }
}

}  // namespace
}  // namespace planar_mapping::transport
