// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/base/detail/parallel.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace planar_mapping {
namespace {

TEST(Parallel, CallsEveryChunkOnce) {
  for (const int threads : {0, 1, 2, 3, 8}) {
    for (const std::size_t chunks :
         {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{1000}}) {
      std::vector<std::atomic<int>> calls(chunks);
      parallelFor(chunks, threads, [&](std::size_t chunk) { ++calls[chunk]; });
      for (const auto& count : calls) EXPECT_EQ(count, 1);
    }
  }
}

TEST(Parallel, OneThreadRunsInOrderInTheCaller) {
  std::vector<std::size_t> order;
  const auto caller = std::this_thread::get_id();
  parallelFor(5, 1, [&](std::size_t chunk) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    order.push_back(chunk);
  });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
}

TEST(Parallel, RethrowsTheExceptionOfTheLowestChunk) {
  for (const int threads : {2, 4}) {
    try {
      parallelFor(100, threads, [](std::size_t chunk) {
        if (chunk == 17 || chunk == 60) throw std::runtime_error(std::to_string(chunk));
      });
      FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "17");
    }
  }
}

TEST(Parallel, GoesOnWithoutThreadsThatTheSystemRefuses) {
  pthread_attr_t usual, huge;
  ASSERT_EQ(pthread_getattr_default_np(&usual), 0);
  ASSERT_EQ(pthread_getattr_default_np(&huge), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&huge, std::size_t{1} << 60U), 0);
  ASSERT_EQ(pthread_setattr_default_np(&huge), 0);
  std::vector<std::atomic<int>> calls(100);
  EXPECT_NO_THROW(parallelFor(100, 4, [&](std::size_t chunk) { ++calls[chunk]; }));
  ASSERT_EQ(pthread_setattr_default_np(&usual), 0);
  for (const auto& count : calls) EXPECT_EQ(count, 1);
}

TEST(Parallel, ResolvesTheNumberOfThreads) {
  EXPECT_EQ(resolveThreads(3), 3);
  EXPECT_GE(resolveThreads(0), 1);
  EXPECT_GE(resolveThreads(-1), 1);
}

}  // namespace
}  // namespace planar_mapping
