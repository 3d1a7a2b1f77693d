// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Keyframes, submaps and links of an atlas: what a file holds is placed, and the links are solved.
#include <Eigen/Cholesky>
#include <optional>

#include "any_map.h"
#include "planar_mapping/atlas/atlas_localizer.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/atlas/pose_graph.h"
#include "planar_mapping/base/random.h"

using namespace planar_mapping;

namespace {

constexpr unsigned kMaxSubmaps = 4;
constexpr unsigned kMaxLinks = 6;
constexpr unsigned kMaxEdits = 3;  // of a keyframe that is sound otherwise
constexpr int kFeatures = 24;
constexpr int kRays = 300;
constexpr int kAcross = 8;
constexpr int kDown = 6;
constexpr std::size_t kDescriptorBytes = 64;

/// Any number at all, mostly one that could be meant.
double anyNumber(fuzz::Input& input) {
  switch (input.below(5)) {
    case 0:
      return 0.0;
    case 1:
      return input.between(-2.0, 2.0);
    case 2:
      return input.between(-1e4, 1e4);
    case 3:
      return std::copysign(std::pow(10.0, input.between(-320, 308)), input.flag() ? 1 : -1);
    default:
      return input.number<double>();
  }
}

/// Walls around the origin, so that keyframes near it show the same.
double rangeOf(const Vector3& direction) {
  const Vector3 half(2.0, 1.5, 3.0);
  return (half.array() / direction.array().abs().max(1e-9)).minCoeff();
}

Pose anyPlace(fuzz::Input& input) {
  Pose pose = Pose::Identity();
  for (double& x : pose.translation()) x = input.between(-0.5, 0.5);
  pose.linear() = Eigen::AngleAxisd(input.between(-0.3, 0.3), Vector3::UnitY()).toRotationMatrix();
  return pose;
}

/// An image of features on the walls.
void look(Keyframe& key) {
  key.width = 320;
  key.height = 240;
  key.camera.fx = key.camera.fy = 200.0;
  key.camera.cx = 159.5;
  key.camera.cy = 119.5;
  key.descriptor_bytes = kDescriptorBytes;
  Random random(1);
  for (int i = 0; i < kFeatures; ++i) {
    const Vector3 towards(random.uniform(-0.6, 0.6), random.uniform(-0.4, 0.4), 1.0);
    Random values(static_cast<std::uint64_t>(i));
    const Vector3 point = key.T_submap_keyframe.inverse() * (rangeOf(towards) * towards);
    if (point.z() < 0.1) continue;
    key.sightings.push_back(project(key.camera, point));
    for (std::size_t k = 0; k < kDescriptorBytes; ++k)
      key.descriptors.push_back(static_cast<std::uint8_t>(values.below(256)));
  }
  key.cells_across = kAcross;
  key.inverse_depths.assign(kAcross * kDown, 4096 / 3);
}

/// A scan of the walls.
void scan(Keyframe& key) {
  key.is_scan = true;
  key.point_step = 0.001;
  const Pose T_keyframe_submap = key.T_submap_keyframe.inverse();
  Random random(2);
  for (int i = 0; i < kRays; ++i) {
    const Vector3 towards(random.normal(), random.normal(), random.normal());
    const Vector3 point = T_keyframe_submap * (rangeOf(towards) * towards);
    for (const double x : point)
      key.points.push_back(static_cast<std::int16_t>(x / key.point_step));
  }
}

void edit(fuzz::Input& input, Keyframe& key) {
  const auto one = [&](auto& list) -> auto& {
    return list[input.below(255) % list.size()];
  };
  double* const numbers[] = {&key.camera.fx,
                             &key.camera.fy,
                             &key.camera.cx,
                             &key.camera.cy,
                             &key.camera.pixel_error,
                             &key.camera.depth_error,
                             &key.camera.depth_error_growth,
                             &key.point_step,
                             &key.timestamp};
  switch (input.below(9)) {
    case 0:
      *numbers[input.below(std::size(numbers))] = anyNumber(input);
      break;
    case 1:
      key.width = input.number<std::int32_t>();
      break;
    case 2:
      key.height = input.number<std::int32_t>();
      break;
    case 3:
      key.cells_across = static_cast<int>(input.below(64)) - 1;
      break;
    case 4:
      key.T_submap_keyframe = fuzz::anyPose(input, 8.0);
      break;
    case 5:
      key.inverse_depths.resize(input.below(65));
      for (std::uint16_t& depth : key.inverse_depths) depth = input.number<std::uint16_t>();
      break;
    case 6:
      key.descriptor_bytes = input.below(65);
      key.descriptors.resize(key.sightings.size() * key.descriptor_bytes);
      for (std::uint8_t& value : key.descriptors) value = input.number<std::uint8_t>();
      break;
    case 7:
      if (key.sightings.empty()) break;
      for (unsigned i = input.below(kFeatures); i > 0; --i) {
        FeatureSighting& sighting = one(key.sightings);
        double* const values[] = {&sighting.column, &sighting.row, &sighting.inverse_depth};
        *values[input.below(3)] = anyNumber(input);
      }
      break;
    default:
      if (key.points.empty()) break;
      for (unsigned i = input.below(16); i > 0; --i) one(key.points) = input.number<std::int16_t>();
      key.is_scan = input.flag();
  }
}

Keyframe anyKeyframe(fuzz::Input& input) {
  Keyframe key;
  key.T_submap_keyframe = anyPlace(input);
  if (input.below(8) != 0) look(key);
  if (input.below(8) == 0) scan(key);
  for (unsigned i = input.below(kMaxEdits + 1); i > 0; --i) edit(input, key);
  return key;
}

Link anyLink(fuzz::Input& input, const AtlasData& data) {
  const auto count = static_cast<unsigned>(data.submaps.size());
  Link link;
  link.id = static_cast<std::int64_t>(data.links.size());
  link.kind = static_cast<LinkKind>(input.below(3));
  link.state = static_cast<LinkState>(input.below(3));
  link.from_submap = input.below(count);
  link.to_submap = input.below(count);
  if (input.flag()) {  // of keyframes, which have the numbers of their submaps
    link.from_keyframe = link.from_submap;
    link.to_keyframe = link.to_submap;
  }
  link.T_to_from = input.flag() ? anyPlace(input) : fuzz::anyPose(input, 8.0);
  for (int i = 0; i < 6; ++i) link.covariance(i, i) = std::pow(10.0, input.between(-9.0, 3.0));
  if (input.below(4) == 0) {
    const unsigned row = input.below(6), column = input.below(6);
    link.covariance(row, column) = link.covariance(column, row) = anyNumber(input);
  }
  link.evidence.inliers = input.below(200);
  link.evidence.agreement = input.between(0.0, 1.0);
  link.evidence.seen_through = input.between(0.0, 0.1);
  return link;
}

AtlasData anyAtlas(fuzz::Input& input) {
  static const auto map = std::make_shared<const PlanarMap>(PlanarMap(PlanarMapParams()));
  AtlasData data;
  const unsigned submaps = 1 + input.below(kMaxSubmaps);
  data.sessions.resize(1 + input.below(2));
  data.sessions.back().id = static_cast<std::int64_t>(data.sessions.size()) - 1;
  for (unsigned i = 0; i < submaps; ++i) {
    Submap submap;
    submap.id = i;
    submap.session = input.below(static_cast<unsigned>(data.sessions.size()));
    submap.component = input.below(i + 1);
    submap.T_world_submap = fuzz::anyPose(input, 8.0);
    submap.map = map;
    data.submaps.push_back(submap);
    data.keyframes.push_back(anyKeyframe(input));
    data.keyframes.back().id = data.keyframes.back().submap = i;
  }
  for (unsigned i = input.below(kMaxLinks + 1); i > 0; --i)
    data.links.push_back(anyLink(input, data));
  return data;
}

void requireProper(const Matrix6& covariance) {
  fuzz::require(covariance.allFinite() && Eigen::LLT<Matrix6>(covariance).info() == Eigen::Success,
                "covariances are positive definite");
}

void requireRigidMotion(const Pose& pose) {
  fuzz::require(fuzz::succeeds([&] { requireRigid("a pose", pose); }), "poses are rigid");
}

void place(const AtlasData& data, AtlasData& with_links) {
  PlaceFinder places;
  for (const Keyframe& key : data.keyframes) {
    fuzz::succeeds([&] {
      places.add(key);
      for (Link link : places.links(key, data)) {
        requireRigidMotion(link.T_to_from);
        requireProper(link.covariance);
        link.id = static_cast<std::int64_t>(with_links.links.size());
        with_links.links.push_back(link);
      }
    });
  }
  fuzz::succeeds([&] {
    const AtlasLocalizer localizer(data);
    const std::optional<Place> found = localizer.find(data.keyframes.front());
    if (!found) return;
    requireRigidMotion(found->T_world_sensor);
    requireProper(found->covariance);
  });
}

void solve(AtlasData& data) {
  if (!fuzz::succeeds([&] { solvePoseGraph(data); })) return;
  for (const Submap& submap : data.submaps) requireRigidMotion(submap.T_world_submap);
  for (const Link& link : data.links)
    fuzz::require(std::isfinite(link.residual), "residuals are finite");
  AtlasData again = data;
  solvePoseGraph(again);
  for (std::size_t i = 0; i < data.submaps.size(); ++i)
    fuzz::require(data.submaps[i].component == again.submaps[i].component,
                  "solved again it has the same components");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  static const std::string path = fuzz::folder() + "/a.atlas";
  const AtlasData any = anyAtlas(input);
  if (!fuzz::succeeds([&] { saveAtlas(any, path, io::Overwrite::Allow); })) return 0;
  AtlasData loaded = loadAtlas(path);
  fuzz::require(loaded.keyframes.size() == any.keyframes.size() &&
                    loaded.links.size() == any.links.size() &&
                    loaded.submaps.size() == any.submaps.size(),
                "all that was written is read");
  AtlasData with_links = loaded;
  place(loaded, with_links);
  solve(with_links);
  // Refused where links add up to a submap that lies too far away.
  fuzz::succeeds([&] { saveAtlas(with_links, path, io::Overwrite::Allow); });
  return 0;
}
