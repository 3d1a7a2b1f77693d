// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "transport_session.h"

namespace planar_mapping::transport {
namespace {

class KeysTest : public ::testing::Test {
 protected:
  KeysTest() {
    mapper_.peers = {known_.public_key};
    known_.peers = {mapper_.public_key};
    ListenerOptions options = listenerOptions();
    options.keys = mapper_;
    options.say = [this](const std::string& text) { said_ += text + "\n"; };
    listener_ = std::make_unique<FrameListener>(Endpoint{"127.0.0.1", 0}, options);
  }
  std::future<FrontEndResult> sendWith(const Keys& keys, double timeout = 5.0) {
    FrontEndOptions options = frontEndOptions(timeout);
    options.keys = keys;
    return sendInBackground(listener_->endpoint(), {4}, options);
  }
  /// The run goes on undisturbed.
  void expectTheKnownOneGetsThrough() {
    auto sender = sendWith(known_);
    EXPECT_EQ(4U, takeAll(*listener_));
    EXPECT_EQ(4U, sender.get().frames_sent);
  }

  Keys mapper_ = makeKeys();
  Keys known_ = makeKeys();
  std::string said_;
  std::unique_ptr<FrameListener> listener_;
};

TEST_F(KeysTest, AKnownFrontEndIsAdmitted) {
  expectTheKnownOneGetsThrough();
}

TEST_F(KeysTest, AnUnknownKeyIsRefusedAndBothSidesSaySo) {
  Keys stranger = makeKeys();
  stranger.peers = {mapper_.public_key};
  auto refused = sendWith(stranger);
  auto taken = std::async(std::launch::async, [this]() { return takeAll(*listener_); });
  EXPECT_NE(std::string::npos, errorOf([&]() { refused.get(); }).find("does not know our key"));
  EXPECT_EQ(4U, sendWith(known_).get().frames_sent);
  EXPECT_EQ(4U, taken.get());
  EXPECT_NE(std::string::npos, said_.find("its key is not among those of --keys"));
}

TEST_F(KeysTest, WhoHasNoKeyOrTakesUsForAnotherIsNotAdmitted) {
  auto without = sendWith(Keys(), 1.0);
  Keys misled = known_;
  misled.peers = {makeKeys().public_key};
  auto other = sendWith(misled, 1.0);
  auto taken = std::async(std::launch::async, [this]() { return takeAll(*listener_); });
  EXPECT_NE("nothing was thrown", errorOf([&]() { without.get(); }));
  EXPECT_NE("nothing was thrown", errorOf([&]() { other.get(); }));
  EXPECT_EQ(4U, sendWith(known_).get().frames_sent);
  EXPECT_EQ(4U, taken.get());
}

}  // namespace
}  // namespace planar_mapping::transport
