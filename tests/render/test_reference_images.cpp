// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Small pictures of fixed scenes against tests/render/reference, with tolerance: drivers differ in
// edge pixels. PLANAR_MAPPING_UPDATE_REFERENCE=1 rewrites them; the commit says why they moved.
#include <gtest/gtest.h>

#include <cstdlib>

#include "planar_mapping/viewer/drawing/projection_2d.h"
#include "planar_mapping/viewer/window/snapshot.h"
#include "scenes.h"

namespace planar_mapping {
namespace {

// No text: fonts differ between machines.
ViewOptions small(const std::string& layers) {
  ViewOptions options;
  options.width = 240;
  options.height = 160;
  options.show = Layers::fromString(layers);
  return options;
}

void expectLikeReference(const Image& image, const std::string& name) {
  const std::string path =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/tests/render/reference/" + name + ".png";
  if (std::getenv("PLANAR_MAPPING_UPDATE_REFERENCE") != nullptr) {
    io::writeImage(path, image, io::Overwrite::Allow);
    GTEST_SKIP() << "rewritten: " << path;
  }
  const ImageDifference difference = compareImages(image, readPng(path));
  EXPECT_LT(difference.changed, 0.03) << name;
  EXPECT_LT(difference.mean, 0.01) << name;
}

TEST(ReferenceImage, RoomByPlane) {
  expectLikeReference(
      renderSnapshot(testing::room(), small("occupied,trajectory,edges,ground-grid,unknown")),
      "room_plane");
}

TEST(ReferenceImage, RoomByHeightFromAbove) {
  ViewOptions options = small("occupied,edges");
  options.camera = CameraPreset::Top;
  options.color = ColorBy::Height;
  expectLikeReference(renderSnapshot(testing::room(), options), "room_height_top");
}

TEST(ReferenceImage, RoomInFirstPersonByTilt) {
  ViewOptions options = small("occupied,edges");
  options.camera = CameraPreset::FirstPerson;
  options.color = ColorBy::Tilt;
  expectLikeReference(renderSnapshot(testing::room(), options), "room_tilt_first_person");
}

TEST(ReferenceImage, FieldByProbability) {
  ViewOptions options = small("occupied,edges");
  options.color = ColorBy::Probability;
  expectLikeReference(renderSnapshot(testing::field(3000), options), "field_probability");
}

TEST(ReferenceImage, RoomAsAPlan) {
  expectLikeReference(
      drawProjection2d(testing::room(), small("occupied,unknown,trajectory,ground-grid")),
      "room_plan");
}

}  // namespace
}  // namespace planar_mapping
