// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Frames of any clouds, poses and parameters into a map.
#include <limits>

#include "any_map.h"
#include "planar_mapping/map/map_query.h"
#include "planar_mapping/map/planar_map.h"

using namespace planar_mapping;

namespace {

// Small, for many executions: large ones are of tests/unit/map/store/test_space_budget.cpp.
constexpr int kMaxFrames = 3;
constexpr unsigned kMaxSide = 6;  // pixels
constexpr double kMaxRangeInCells = 6.0;

struct Cloud {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> xyz;
  PointsView view() const {
    return height > 1 ? PointsView(xyz.data(), width, height, 3) : PointsView(xyz.data(), width);
  }
};

PlanarMapParams anyParams(fuzz::Input& input) {
  const Profile profile = input.flag() ? Profile::Compact : Profile::Paper;
  PlanarMapParams params = PlanarMapParams::of(profile);
  params.approximation.profile = profile;
  params.approximation.resolution = input.between(0.02, 2.0);
  params.approximation.min_points_per_cell = 1 + static_cast<int>(input.below(3));
  params.unknown_space = input.below(4) != 0;
  params.unseen = input.flag() ? Unseen::Unknown : Unseen::Free;
  params.max_range = params.approximation.resolution * input.between(1.0, kMaxRangeInCells);
  params.range_image_step = input.between(0.05, 0.2);
  params.belief_gain = input.between(0.05, 1.0);
  params.miss_factor = input.between(0.0, 1.0);
  params.min_probability = input.between(0.0, 1.0);
  params.first_belief = input.between(0.05, 1.0);
  return params;
}

/// A wall before a camera, points in a cube, or any floats whatever.
Cloud anyCloud(fuzz::Input& input) {
  const unsigned kind = input.below(4);
  Cloud cloud;
  cloud.width = 1 + input.below(kMaxSide);
  cloud.height = kind == 0 ? 2 + input.below(kMaxSide) : 1;
  const double extent = std::pow(10.0, input.between(-2.0, 4.0));
  for (std::uint32_t i = 0; i < cloud.width * cloud.height; ++i) {
    if (kind == 3) {
      for (int k = 0; k < 3; ++k) cloud.xyz.push_back(input.number<float>());
      continue;
    }
    double p[3];
    for (double& x : p) x = extent * (2.0 * input.number<std::uint8_t>() / 255.0 - 1.0);
    if (kind == 0) {
      const unsigned depth = input.number<std::uint8_t>();
      p[2] =
          extent * (depth < 250 ? 0.5 + 0.001 * depth : std::numeric_limits<double>::quiet_NaN());
      p[0] = p[2] * (i % cloud.width - 0.5 * cloud.width) / kMaxSide;
      p[1] = p[2] * (i / cloud.width - 0.5 * cloud.height) / kMaxSide;
    }
    if (kind == 1) p[2] = 0.01 * p[0] + 1.0;
    for (const double x : p) cloud.xyz.push_back(static_cast<float>(x));
  }
  return cloud;
}

void insertAny(fuzz::Input& input, PlanarMap& map, int number) {
  const Cloud cloud = anyCloud(input);
  FrameObservation frame;
  frame.T_world_sensor = fuzz::anyPose(input);
  frame.timestamp = number;
  frame.points = cloud.view();
  MultiPlaneParams planes;
  planes.min_inliers = 3 + static_cast<int>(input.below(30));
  planes.distance_threshold = map.params().approximation.resolution / 2;
  const std::vector<PlaneSegment> found = findPlanes(frame.points, nullptr, planes).planes;
  if (input.flag()) frame.planes = &found;
  if (input.flag()) frame.noise = StereoNoise{300.0, 0.12, 0.5};
  if (cloud.height > 1 && input.flag()) {
    frame.camera = PinholeCamera{kMaxSide,
                                 kMaxSide,
                                 0.5 * cloud.width,
                                 0.5 * cloud.height,
                                 static_cast<int>(cloud.width),
                                 static_cast<int>(cloud.height)};
  }
  map.insert(frame);
}

bool sameCuboids(const PlanarMap& a, const PlanarMap& b) {
  const auto same = [](const Cuboid& l, const Cuboid& r) {
    return l.center == r.center && l.size == r.size && l.plane_id == r.plane_id &&
           l.orientation.coeffs() == r.orientation.coeffs();
  };
  return std::equal(a.cuboids().begin(), a.cuboids().end(), b.cuboids().begin(), b.cuboids().end(),
                    same);
}

void query(fuzz::Input& input, const PlanarMap& map, const PlanarMap& loaded) {
  Vector3 low = Vector3::Constant(-1), high = Vector3::Constant(1);
  map.bounds(low, high);
  for (int i = 0; i < 8; ++i) {
    const auto along = [&](int k) {
      return low[k] + (high[k] - low[k]) * input.between(-0.2, 1.2);
    };
    const Vector3 p(along(0), along(1), along(2));
    fuzz::require(map.isOccupied(p) + map.isFree(p) + map.isUnknown(p) == 1, "one state anywhere");
    fuzz::require(map.isOccupied(p) == !map.cuboidsAt(p).empty(), "occupied is within a cuboid");
    fuzz::require(map.stateAt(p) == loaded.stateAt(p), "a saved map answers the same");
    fuzz::succeeds([&] { castRay(map, p, Vector3(input.between(-1, 1), 0.3, 0.2), 20.0); });
    fuzz::succeeds([&] { stateOfBox(map, p, p + Vector3::Constant(input.between(0, 2))); });
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  PlanarMap map(anyParams(input));
  const int frames = 1 + static_cast<int>(input.below(kMaxFrames));
  for (int i = 0; i < frames; ++i) {
    if (!fuzz::succeeds([&] { insertAny(input, map, i); })) break;
  }
  switch (input.below(3)) {  // one at a time, for more executions
    case 0: {
      const std::vector<std::uint8_t> saved = map.serialize();
      const PlanarMap loaded = PlanarMap::deserialize(saved.data(), saved.size());
      fuzz::require(loaded.serialize() == saved, "a map that was read is saved as the same bytes");
      fuzz::require(sameCuboids(map, loaded), "a map that was read has the same cuboids");
      fuzz::require(map.cuboids().size() <= map.cuboidCountAtMost(), "the bound is one");
      query(input, map, loaded);
      break;
    }
    case 1: {
      const std::vector<std::uint8_t> finished = map.finished().serialize();
      const PlanarMap small = PlanarMap::deserialize(finished.data(), finished.size());
      fuzz::require(small.cuboidCount() == map.cuboidCount(), "finished it has the same cuboids");
      break;
    }
    default: {
      PlanarMap merged = map;
      fuzz::succeeds([&] { merged.merge(map); });  // refused at the end of the lattice
      fuzz::require(merged.serialize() == map.serialize(),
                    "merging a map with itself changes nothing");
    }
  }
  return 0;
}
