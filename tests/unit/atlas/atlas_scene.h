// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "map_scene.h"
#include "planar_mapping/atlas/atlas_data.h"

namespace planar_mapping::test {

/// A walk through the room of map_scene.h in one session: a submap a frame with two keyframes, a
/// link between neighbours, and a loop between the last submap and the first. Numbers from 0.
inline AtlasData walkedAtlas(int submaps, double resolution = 0.1) {
  AtlasData data;
  data.sessions.push_back({0, "walk", "version: 1\n"});
  PlanarMapParams params;
  params.approximation.resolution = resolution;
  const auto link = [&](LinkKind kind, std::int64_t from, std::int64_t to) {
    Link made;
    made.id = static_cast<std::int64_t>(data.links.size());
    made.kind = kind;
    made.from_submap = from;
    made.to_submap = to;
    made.from_keyframe = 2 * from;
    made.to_keyframe = 2 * to;
    made.covariance = 1e-4 * Matrix6::Identity();
    made.covariance(0, 1) = made.covariance(1, 0) = 1e-5;
    made.evidence = {60, 80, 30, 0.9, 0.01, 4.5};
    made.residual = 1.0 / 3.0;
    data.links.push_back(made);
  };
  for (int i = 0; i < submaps; ++i) {
    const Pose pose = lookFrom({-0.2 + 0.05 * i, 0.0, 1.0}, 0.03 * i);
    PlanarMap map(params);
    map.insert(look(Scene(), pose, i).frame());
    Submap submap;
    submap.id = i;
    submap.map = std::make_shared<PlanarMap>(map);
    if (i > 0) submap.T_world_submap.translation() = Vector3(0.001 * i, -0.0, 1e-3 / 3.0);
    data.submaps.push_back(submap);
    for (int k = 0; k < 2; ++k) {
      Keyframe keyframe;
      keyframe.id = 2 * i + k;
      keyframe.submap = i;
      keyframe.frame = static_cast<std::size_t>(10 * i + k);
      keyframe.source = "rgb/" + std::to_string(keyframe.frame) + ".png";
      keyframe.timestamp = i + 0.1 * k;
      keyframe.T_submap_keyframe = pose;
      keyframe.camera.fx = 250.0 + i;
      keyframe.width = 320;
      keyframe.height = 240;
      keyframe.sightings = {{1.5, 2.5, 1.0 / 3.0}, {100.25, 7.0, 0.5}};
      keyframe.descriptor_bytes = 4;
      keyframe.descriptors = {0, 1, 2, 3, 255, 254, 253, static_cast<std::uint8_t>(i)};
      keyframe.cells_across = 3;
      keyframe.inverse_depths = {0, 1, 65535, 4096, 2048, 7};
      if (k == 0) keyframe.thumbnail = {0x89, 'P', 'N', 'G', static_cast<std::uint8_t>(i)};
      data.keyframes.push_back(keyframe);
    }
    if (i > 0) link(LinkKind::Neighbour, i - 1, i);
  }
  if (submaps > 2) link(LinkKind::Loop, 0, submaps - 1);
  return data;
}

/// One submap of an atlas with its keyframes and the links to earlier ones, as a run appends it.
inline AtlasData submapOf(const AtlasData& data, std::int64_t id) {
  AtlasData part;
  for (const Submap& submap : data.submaps)
    if (submap.id == id) part.submaps.push_back(submap);
  for (const Keyframe& keyframe : data.keyframes)
    if (keyframe.submap == id) part.keyframes.push_back(keyframe);
  for (const Link& link : data.links)
    if (std::max(link.from_submap, link.to_submap) == id) part.links.push_back(link);
  if (id == 0) part.sessions = data.sessions;
  return part;
}

template <typename T>
std::string bytesOf(const T& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), sizeof(double) * numbers.size()};
}

/// Bit for bit.
inline void expectSame(const AtlasData& a, const AtlasData& b) {
  ASSERT_EQ(a.sessions.size(), b.sessions.size());
  for (std::size_t i = 0; i < a.sessions.size(); ++i) {
    EXPECT_EQ(a.sessions[i].id, b.sessions[i].id);
    EXPECT_EQ(a.sessions[i].source, b.sessions[i].source);
    EXPECT_EQ(a.sessions[i].configuration, b.sessions[i].configuration);
  }
  ASSERT_EQ(a.submaps.size(), b.submaps.size());
  for (std::size_t i = 0; i < a.submaps.size(); ++i) {
    EXPECT_EQ(a.submaps[i].id, b.submaps[i].id);
    EXPECT_EQ(a.submaps[i].session, b.submaps[i].session);
    EXPECT_EQ(a.submaps[i].component, b.submaps[i].component);
    EXPECT_EQ(bytesOf(a.submaps[i].T_world_submap.matrix()),
              bytesOf(b.submaps[i].T_world_submap.matrix()));
    ASSERT_EQ(a.submaps[i].map == nullptr, b.submaps[i].map == nullptr);
    if (a.submaps[i].map != nullptr) {
      EXPECT_TRUE(a.submaps[i].map->serialize() == b.submaps[i].map->serialize());
    }
  }
  ASSERT_EQ(a.keyframes.size(), b.keyframes.size());
  for (std::size_t i = 0; i < a.keyframes.size(); ++i) {
    const Keyframe &left = a.keyframes[i], &right = b.keyframes[i];
    EXPECT_EQ(left.id, right.id);
    EXPECT_EQ(left.submap, right.submap);
    EXPECT_EQ(left.frame, right.frame);
    EXPECT_EQ(left.source, right.source);
    EXPECT_EQ(left.timestamp, right.timestamp);
    EXPECT_EQ(bytesOf(left.T_submap_keyframe.matrix()), bytesOf(right.T_submap_keyframe.matrix()));
    EXPECT_EQ(left.camera.fx, right.camera.fx);
    EXPECT_EQ(left.camera.fy, right.camera.fy);
    EXPECT_EQ(left.camera.cx, right.camera.cx);
    EXPECT_EQ(left.camera.cy, right.camera.cy);
    EXPECT_EQ(left.camera.pixel_error, right.camera.pixel_error);
    EXPECT_EQ(left.camera.depth_error, right.camera.depth_error);
    EXPECT_EQ(left.camera.depth_error_growth, right.camera.depth_error_growth);
    EXPECT_EQ(left.width, right.width);
    EXPECT_EQ(left.height, right.height);
    ASSERT_EQ(left.sightings.size(), right.sightings.size());
    for (std::size_t k = 0; k < left.sightings.size(); ++k) {
      EXPECT_EQ(left.sightings[k].column, right.sightings[k].column);
      EXPECT_EQ(left.sightings[k].row, right.sightings[k].row);
      EXPECT_EQ(left.sightings[k].inverse_depth, right.sightings[k].inverse_depth);
    }
    EXPECT_EQ(left.descriptors, right.descriptors);
    EXPECT_EQ(left.descriptor_bytes, right.descriptor_bytes);
    EXPECT_EQ(left.inverse_depths, right.inverse_depths);
    EXPECT_EQ(left.cells_across, right.cells_across);
    EXPECT_EQ(left.thumbnail, right.thumbnail);
    EXPECT_EQ(left.points, right.points);
    EXPECT_EQ(left.point_step, right.point_step);
    EXPECT_EQ(left.is_scan, right.is_scan);
  }
  ASSERT_EQ(a.links.size(), b.links.size());
  for (std::size_t i = 0; i < a.links.size(); ++i) {
    const Link &left = a.links[i], &right = b.links[i];
    EXPECT_EQ(left.id, right.id);
    EXPECT_EQ(left.kind, right.kind);
    EXPECT_EQ(left.state, right.state);
    EXPECT_EQ(left.from_submap, right.from_submap);
    EXPECT_EQ(left.to_submap, right.to_submap);
    EXPECT_EQ(left.from_keyframe, right.from_keyframe);
    EXPECT_EQ(left.to_keyframe, right.to_keyframe);
    EXPECT_EQ(bytesOf(left.T_to_from.matrix()), bytesOf(right.T_to_from.matrix()));
    EXPECT_EQ(bytesOf(left.covariance), bytesOf(right.covariance));
    EXPECT_EQ(left.evidence.inliers, right.evidence.inliers);
    EXPECT_EQ(left.evidence.matches, right.evidence.matches);
    EXPECT_EQ(left.evidence.off_plane, right.evidence.off_plane);
    EXPECT_EQ(left.evidence.log_odds, right.evidence.log_odds);
    EXPECT_EQ(left.evidence.agreement, right.evidence.agreement);
    EXPECT_EQ(left.evidence.seen_through, right.evidence.seen_through);
    EXPECT_EQ(left.residual, right.residual);
  }
}

}  // namespace planar_mapping::test
