// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/gather_points.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping::detail {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

template <typename Call>
std::string messageOf(Call call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Error, ParameterErrorNamesValueRangeAndUnit) {
  EXPECT_EQ(messageOf([] { requireInRange("angle", 7.5, 0, 3, "rad"); }),
            "angle = 7.5 rad is out of range, allowed: [0, 3] rad");
  EXPECT_EQ(messageOf([] { requireInRange("count", -1, 0, kInf); }),
            "count = -1 is out of range, allowed: >= 0");
  EXPECT_EQ(messageOf([] { requirePositive("length", 0, "m"); }),
            "length = 0 m is out of range, allowed: > 0 m");
}

TEST(Error, RangesIncludeTheirEnds) {
  EXPECT_NO_THROW(requireInRange("x", 0.0, 0.0, 1.0));
  EXPECT_NO_THROW(requireInRange("x", 1.0, 0.0, 1.0));
  EXPECT_THROW(requireInRange("x", 1.0000001, 0.0, 1.0), ParameterError);
}

TEST(Error, NanIsNeverInRange) {
  EXPECT_THROW(requireInRange("x", test::kNan, -kInf, kInf), ParameterError);
  EXPECT_THROW(requirePositive("x", test::kNan), ParameterError);
  EXPECT_THROW(requirePositive("x", kInf), ParameterError);
  EXPECT_NE(messageOf([] { requireInRange("x", test::kNan, 0, 1); }).find("nan"),
            std::string::npos);
}

TEST(Error, EveryTypeIsAnErrorAndARuntimeError) {
  EXPECT_THROW(throw ParameterError("p"), Error);
  EXPECT_THROW(throw InputError("i"), Error);
  EXPECT_THROW(throw IoError("f", "p"), Error);
  EXPECT_THROW(throw ConfigError({"a"}), Error);
  EXPECT_THROW(throw RenderError("r"), std::runtime_error);
}

TEST(Error, IoErrorStartsWithThePath) {
  const IoError error("/data/a.pcd", "is empty");
  EXPECT_STREQ(error.what(), "/data/a.pcd: is empty");
  EXPECT_EQ(error.path(), "/data/a.pcd");
}

TEST(Error, ConfigErrorListsEveryProblem) {
  const ConfigError error({"a.yaml:1:1: one", "a.yaml:2:1: two"});
  EXPECT_STREQ(error.what(), "a.yaml:1:1: one\na.yaml:2:1: two");
  EXPECT_EQ(error.problems().size(), 2u);
}

TEST(StereoNoise, RejectsWhatNoCameraHas) {
  EXPECT_NO_THROW(StereoNoise().validate());
  EXPECT_THROW((StereoNoise{0.0, 500, 0.5}.validate()), ParameterError);
  EXPECT_THROW((StereoNoise{0.12, -1, 0.5}.validate()), ParameterError);
  EXPECT_THROW((StereoNoise{0.12, 500, test::kNan}.validate()), ParameterError);
  EXPECT_THROW((StereoNoise{0.12, kInf, 0.5}.validate()), ParameterError);
}

TEST(DidYouMean, FindsTheNearestWord) {
  const std::vector<std::string> words = {"distance_threshold_m", "min_inliers", "method"};
  EXPECT_EQ("; did you mean 'distance_threshold_m'?", didYouMean("distance_treshold_m", words));
  EXPECT_EQ("; did you mean 'distance_threshold_m'?", didYouMean("distance_threshold", words));
  EXPECT_EQ("; did you mean 'min_inliers'?", didYouMean("mni_inliers", words));
  EXPECT_EQ("; did you mean 'method'?", didYouMean("methods", words));
}

TEST(DidYouMean, SaysNothingWhereNothingIsNear) {
  const std::vector<std::string> words = {"min_inliers", "method"};
  EXPECT_EQ("", didYouMean("resolution", words));
  EXPECT_EQ("", didYouMean("", words));
  EXPECT_EQ("", didYouMean("method", {}));
  EXPECT_EQ("", didYouMean(std::string(100000, 'm'), words));
}

// The published demo of PCG32: pcg32_srandom(42, 54).
TEST(Random, MatchesThePublishedSequence) {
  Random random(42, 54);
  for (const std::uint32_t expected :
       {0xa15c02b7u, 0x7b47f409u, 0xba1d3330u, 0x83d2f293u, 0xbfa4784bu, 0xcbed606eu}) {
    EXPECT_EQ(random.next(), expected);
  }
}

TEST(Random, SameSeedGivesTheSameNumbers) {
  Random a(7), b(7), other_seed(8), other_stream(7, 1);
  int same_seed = 0, same_stream = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::uint32_t value = a.next();
    EXPECT_EQ(value, b.next());
    same_seed += value == other_seed.next();
    same_stream += value == other_stream.next();
  }
  EXPECT_LE(same_seed, 2);
  EXPECT_LE(same_stream, 2);
}

TEST(Random, BelowIsEvenAndInRange) {
  Random random(1);
  std::array<int, 10> counts{};
  for (int i = 0; i < 100000; ++i) ++counts[random.below(10)];
  for (const int count : counts) EXPECT_NEAR(count, 10000, 500);
  EXPECT_EQ(random.below(1), 0u);
  for (int i = 0; i < 100; ++i) EXPECT_LT(random.below(4294967295u), 4294967295u);
}

TEST(Random, UniformStaysInItsInterval) {
  Random random(2);
  double sum = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double value = random.uniform(-3.0, 5.0);
    ASSERT_GE(value, -3.0);
    ASSERT_LT(value, 5.0);
    sum += value;
  }
  EXPECT_NEAR(sum / 100000, 1.0, 0.05);
}

TEST(Random, NormalHasUnitVarianceAndLightTails) {
  Random random(3);
  double sum = 0.0, squares = 0.0;
  int beyond_two = 0;
  constexpr int kDraws = 100000;
  for (int i = 0; i < kDraws; ++i) {
    const double value = random.normal();
    ASSERT_TRUE(std::isfinite(value));
    sum += value;
    squares += value * value;
    beyond_two += std::abs(value) > 2.0;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 0.02);
  EXPECT_NEAR(squares / kDraws, 1.0, 0.02);
  EXPECT_NEAR(beyond_two / double(kDraws), 0.0455, 0.004);
}

/// Point i is (i, i + 1/4, i + 1/2).
struct Cloud {
  std::size_t stride;
  std::unique_ptr<float[]> data;

  Cloud(std::size_t points, std::size_t floats)
      : stride(floats), data(new float[(points - 1) * floats + 3]) {
    std::fill_n(data.get(), (points - 1) * floats + 3, -1.0F);
    for (std::size_t i = 0; i < points; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        data[i * floats + axis] = static_cast<float>(i) + 0.25F * static_cast<float>(axis);
    }
  }
};

void expectPoints(const std::vector<int>& expected, const std::vector<float>& x,
                  const std::vector<float>& y, const std::vector<float>& z) {
  for (std::size_t k = 0; k < expected.size(); ++k) {
    const auto value = static_cast<float>(expected[k]);
    ASSERT_EQ(x[k], value) << k;
    ASSERT_EQ(y[k], value + 0.25F) << k;
    ASSERT_EQ(z[k], value + 0.5F) << k;
  }
}

void expectGathered(std::size_t stride, const std::vector<int>& indices) {
  const Cloud cloud(100, stride);
  std::vector<float> x(indices.size()), y(x), z(x);
  gatherPoints(cloud.data.get(), stride, indices.data(), indices.size(), x.data(), y.data(),
               z.data());
  expectPoints(indices, x, y, z);
}

TEST(GatherPoints, ReadsAnyIndicesAtAnyStride) {
  std::vector<int> neighbours(100);
  std::iota(neighbours.begin(), neighbours.end(), 0);
  const std::vector<int> to_the_end(neighbours.begin() + 84, neighbours.end());
  const std::vector<int> backwards(neighbours.rbegin(), neighbours.rend());
  // From the first to the last as far apart as neighbours are, but none.
  std::vector<int> swapped(neighbours.begin(), neighbours.begin() + 16);
  std::swap(swapped[5], swapped[9]);
  std::vector<int> repeated(neighbours.begin(), neighbours.begin() + 16);
  repeated[7] = 6;
  const std::vector<int> few = {3, 99, 0};
  const std::vector<int> gaps = {0, 2, 3, 7, 8, 9, 20, 95, 96, 97, 98, 99};
  for (const std::size_t stride : {3, 4, 5, 8}) {
    for (const auto& indices : {neighbours, to_the_end, backwards, swapped, repeated, few, gaps})
      expectGathered(stride, indices);
  }
}

TEST(GatherPoints, ReadsAllPointsAtAnyStride) {
  for (const std::size_t stride : {3, 4, 5, 8}) {
    for (const std::size_t n : {1, 3, 4, 19}) {
      const Cloud cloud(n, stride);
      std::vector<float> x(n), y(x), z(x);
      gatherPoints(cloud.data.get(), stride, nullptr, n, x.data(), y.data(), z.data());
      std::vector<int> all(n);
      std::iota(all.begin(), all.end(), 0);
      expectPoints(all, x, y, z);
    }
  }
}

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
  EXPECT_NO_THROW(parallelFor(100, 64, [&](std::size_t chunk) { ++calls[chunk]; }));
  ASSERT_EQ(pthread_setattr_default_np(&usual), 0);
  for (const auto& count : calls) EXPECT_EQ(count, 1);
}

TEST(Parallel, CallsInsideAChunkRunInItsThread) {
  std::atomic<int> calls{0};
  parallelFor(8, 4, [&](std::size_t) {
    const auto thread = std::this_thread::get_id();
    parallelFor(8, 4, [&](std::size_t) {
      EXPECT_EQ(std::this_thread::get_id(), thread);
      ++calls;
    });
  });
  EXPECT_EQ(calls, 64);
}

TEST(Parallel, ServesManyCallersAtOnce) {
  std::vector<std::thread> callers;
  std::atomic<int> calls{0};
  for (int i = 0; i < 4; ++i) {
    callers.emplace_back([&calls] {
      for (int k = 0; k < 200; ++k) parallelFor(7, 3, [&](std::size_t) { ++calls; });
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(calls, 4 * 200 * 7);
}

TEST(Parallel, WorksInAForkedChild) {
  parallelFor(100, 4, [](std::size_t) {});
  const pid_t child = fork();
  if (child == 0) {
    std::atomic<int> calls{0};
    for (int k = 0; k < 20; ++k) parallelFor(100, 4, [&](std::size_t) { ++calls; });
    _exit(calls == 2000 ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(child, waitpid(child, &status, 0));
  EXPECT_EQ(0, status);
}

TEST(Parallel, ResolvesTheNumberOfThreads) {
  EXPECT_EQ(resolveThreads(3), 3);
  EXPECT_GE(resolveThreads(0), 1);
  EXPECT_GE(resolveThreads(-1), 1);
}

TEST(Counted, OneIsSingular) {
  EXPECT_EQ(counted(0, "frame"), "0 frames");
  EXPECT_EQ(counted(1, "frame"), "1 frame");
  EXPECT_EQ(counted(2, "frame"), "2 frames");
}

}  // namespace
}  // namespace planar_mapping::detail
