// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// How many links between keyframes far apart are right, on sequences with true poses, and what they
// cost in processor time:
//
//   place_recognition FOLDER...
//
// A link is right within 5 degrees and 10 cm + 5 % of the true motion. Links between different
// folders are wrong. Prints a row per folder, and retrieval at 100 and 1,000 keyframes.
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <string>
#include <vector>

#include "planar_mapping/atlas/keyframe_maker.h"
#include "planar_mapping/atlas/place_finder.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/stereo/matching/stereo_matcher.h"

namespace {

using namespace planar_mapping;

constexpr int kPerSubmap = 3;
constexpr std::size_t kCandidates = 8;

/// Milliseconds of processor time, of calls.
struct Timer {
  double total = 0.0;
  double most = 0.0;
  int calls = 0;
  template <typename Call>
  auto run(const Call& call) {
    const std::clock_t start = std::clock();
    auto result = call();
    const double ms = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    total += ms;
    most = std::max(most, ms);
    ++calls;
    return result;
  }
  double mean() const { return calls > 0 ? total / calls : 0.0; }
};

struct Set {
  std::string name;
  std::vector<Keyframe> keys;
  std::vector<Pose> truth;  ///< T_world_camera
  Timer making;
};

std::size_t bytesOf(const Keyframe& key) {
  return key.descriptors.size() + key.sightings.size() * sizeof(FeatureSighting) +
         2 * key.inverse_depths.size() + key.thumbnail.size();
}

Set readSet(const std::string& folder, std::int64_t first_id) {
  Set set;
  set.name = folder.substr(folder.find_last_of('/') + 1);
  const io::Sequence sequence({folder});
  const io::Calibration calibration = *sequence.calibration();
  FeatureCamera camera;
  camera.setPinhole(calibration.camera);
  const bool stereo = sequence.kind() == io::SequenceKind::Stereo;
  camera.depth_error = stereo ? 0.0 : 0.005;
  camera.depth_error_growth = stereo ? 0.5 / (*calibration.baseline * camera.fx) : 0.003;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    io::Frame frame = sequence.read(i);
    std::vector<float> xyz = frame.cloud.xyz;
    if (stereo) {
      const DisparityImage disparity = StereoMatcher().match(frame.left, frame.right, calibration);
      triangulate(disparity, calibration, xyz);
    }
    const io::Image gray = io::toGray(frame.left);
    const PointsView cloud(xyz.data(), static_cast<std::uint32_t>(gray.width),
                           static_cast<std::uint32_t>(gray.height), 3);
    Keyframe key = set.making.run([&]() { return makeKeyframe(gray, cloud, camera); });
    key.id = first_id + static_cast<std::int64_t>(i);
    key.submap = key.id - static_cast<std::int64_t>(i % kPerSubmap);
    key.frame = i;
    const std::size_t start = i - i % kPerSubmap;
    set.truth.push_back(*frame.T_world_sensor);
    key.T_submap_keyframe = set.truth[start].inverse() * set.truth[i];
    set.keys.push_back(std::move(key));
  }
  return set;
}

bool isRight(const Pose& is, const Pose& should) {
  const Vector6 error = motionDifference(should, is);
  const double length = should.translation().norm();
  return error.tail<3>().norm() < 5.0 * M_PI / 180.0 &&
         (is.translation() - should.translation()).norm() < 0.1 + 0.05 * length;
}

void report(const Set& set) {
  PlaceFinder finder;
  Timer retrieval;
  Timer verification;
  int right = 0;
  int wrong = 0;
  double chi2 = 0.0;
  double features = 0.0;
  std::size_t bytes = 0;
  int found_of_all = 0;  // pairs that a check of every pair finds
  for (std::size_t b = 0; b < set.keys.size(); ++b) {
    const Keyframe& key = set.keys[b];
    features += static_cast<double>(key.sightings.size());
    bytes = std::max(bytes, bytesOf(key));
    const auto ids = retrieval.run(
        [&]() { return finder.candidates(key, kCandidates, {key.submap - kPerSubmap}); });
    for (const std::int64_t id : ids) {
      const auto a = static_cast<std::size_t>(id - set.keys.front().id);
      const auto link = verification.run([&]() { return PlaceFinder::verify(set.keys[a], key); });
      if (!link) continue;
      const auto submapOf = [&](std::size_t i) { return set.truth[i - i % kPerSubmap]; };
      const Pose T_b_a_submaps = submapOf(b).inverse() * submapOf(a);
      const Pose T_b_a =
          key.T_submap_keyframe.inverse() * link->T_to_from * set.keys[a].T_submap_keyframe;
      const bool good = isRight(T_b_a, set.truth[b].inverse() * set.truth[a]);
      ++(good ? right : wrong);
      if (good) {
        const Vector6 error = motionDifference(T_b_a_submaps, link->T_to_from);
        chi2 += error.dot(link->covariance.inverse() * error) / 6.0;
      } else {
        std::printf(
            "  wrong: %zu %zu inliers %zu of %zu off %zu agree %.2f through %.3f odds %.1f\n", a, b,
            link->evidence.inliers, link->evidence.matches, link->evidence.off_plane,
            link->evidence.agreement, link->evidence.seen_through, link->evidence.log_odds);
      }
    }
    finder.add(key);
  }
  for (std::size_t b = 0; b < set.keys.size() && set.keys.size() < 100; ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      const bool far = set.keys[b].submap - set.keys[a].submap > kPerSubmap;
      if (far && PlaceFinder::verify(set.keys[a], set.keys[b])) ++found_of_all;
    }
  }
  std::printf("%-22s %4zu %5.0f %6zu %5d %5d %6d %6.2f %6.1f %6.1f %6.2f %6.2f\n", set.name.c_str(),
              set.keys.size(), features / static_cast<double>(set.keys.size()), bytes, right, wrong,
              found_of_all, right > 0 ? chi2 / right : 0.0, set.making.mean(), set.making.most,
              retrieval.mean(), verification.mean());
  std::fflush(stdout);
}

/// Every third keyframe of a set with every third of another.
void reportBetween(const std::vector<Set>& sets) {
  int pairs = 0;
  int links = 0;
  for (std::size_t m = 0; m < sets.size(); ++m) {
    for (std::size_t n = 0; n < m; ++n) {
      for (std::size_t i = 0; i < sets[m].keys.size(); i += 3) {
        for (std::size_t j = 0; j < sets[n].keys.size(); j += 3) {
          ++pairs;
          if (PlaceFinder::verify(sets[m].keys[i], sets[n].keys[j])) ++links;
        }
      }
    }
  }
  std::printf("between folders: %d links of %d pairs, all wrong\n", links, pairs);
}

/// Retrieval among keyframes of all sets, repeated with noise until there are so many.
void reportSize(const std::vector<Set>& sets, std::size_t count) {
  PlaceFinder finder;
  std::vector<Keyframe> keys;
  for (const Set& set : sets) keys.insert(keys.end(), set.keys.begin(), set.keys.end());
  for (std::size_t i = 0; i < count && !keys.empty(); ++i) {
    Keyframe key = keys[i % keys.size()];
    key.submap = static_cast<std::int64_t>(i);
    key.id = key.submap;
    finder.add(key);
  }
  Timer retrieval;
  for (std::size_t i = 0; i < keys.size(); i += 5) {
    Keyframe key = keys[i];
    key.submap = -1;
    retrieval.run([&]() { return finder.candidates(key, kCandidates); });
  }
  std::printf("retrieval among %zu keyframes: %.2f ms, at most %.2f ms\n", count, retrieval.mean(),
              retrieval.most);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::vector<Set> sets;
    std::printf("%-22s %4s %5s %6s %5s %5s %6s %6s %6s %6s %6s %6s\n", "folder", "keys", "feat.",
                "bytes", "right", "wrong", "pairs", "chi2/6", "make", "most", "find", "verify");
    std::int64_t next_id = 0;
    for (int i = 1; i < argc; ++i) {
      sets.push_back(readSet(argv[i], next_id));
      next_id += 1000;
      report(sets.back());
    }
    reportBetween(sets);
    reportSize(sets, 100);
    reportSize(sets, 1000);
  } catch (const Error& error) {
    std::fprintf(stderr, "place_recognition: %s\n", error.what());
    return 1;
  }
  return 0;
}
