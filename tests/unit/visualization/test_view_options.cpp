// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/view_options.h"

#include <gtest/gtest.h>

#include <cmath>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

TEST(Layers, ShowsWhatIsNamedAndNothingElse) {
  const Layers layers = Layers::fromString("occupied,ground-grid");
  EXPECT_TRUE(layers.occupied);
  EXPECT_TRUE(layers.ground_grid);
  EXPECT_FALSE(layers.unknown || layers.trajectory || layers.cloud || layers.edges || layers.axes ||
               layers.legend);
}

TEST(Layers, KnowsAllAndNone) {
  const Layers all = Layers::fromString("all");
  EXPECT_TRUE(all.occupied && all.unknown && all.trajectory && all.cloud && all.edges && all.axes &&
              all.ground_grid && all.legend);
  const Layers none = Layers::fromString("none");
  EXPECT_FALSE(none.occupied || none.unknown || none.legend);
}

TEST(Layers, RefusesAnUnknownWord) {
  EXPECT_THROW(Layers::fromString("occupied,egdes"), ParameterError);
  EXPECT_THROW(Layers::fromString("occupied,,edges"), ParameterError);
}

TEST(ViewOptions, ReadsASize) {
  ViewOptions options;
  options.setSize("640x480");
  EXPECT_EQ(options.width, 640);
  EXPECT_EQ(options.height, 480);
  for (const char* bad : {"", "640", "640x", "x480", "640x480x3", "15x480", "640x16385", "640X480",
                          "-640x480", "16384x16384", "99999x99999", "640x48O"}) {
    EXPECT_THROW(options.setSize(bad), ParameterError) << bad;
  }
  EXPECT_EQ(options.width, 640) << "a bad size must not change anything";
}

TEST(ViewOptions, RefusesWhatIsNotFinite) {
  ViewOptions options;
  options.camera_position = Vector3(0.0, NAN, 0.0);
  EXPECT_THROW(options.validate(), ParameterError);
  options = ViewOptions();
  options.zoom = NAN;
  EXPECT_THROW(options.validate(), ParameterError);
  options.zoom = 0.0;
  EXPECT_THROW(options.validate(), ParameterError);
  options = ViewOptions();
  options.view_up = Vector3::Zero();
  EXPECT_THROW(options.validate(), ParameterError);
  options = ViewOptions();
  options.clip_above = INFINITY;
  EXPECT_THROW(options.validate(), ParameterError);
  options = ViewOptions();
  options.point_size = 0.0;
  EXPECT_THROW(options.validate(), ParameterError);
}

TEST(Words, RoundTrip) {
  for (const char* word : {"iso", "top", "front", "back", "left", "right", "first-person"}) {
    EXPECT_STREQ(toString(cameraPresetFromString(word)), word);
  }
  for (const char* word : {"none", "ceiling", "seen"}) {
    EXPECT_STREQ(toString(cutawayFromString(word)), word);
  }
  EXPECT_THROW(cameraPresetFromString("isometric"), ParameterError);
}

}  // namespace
}  // namespace planar_mapping
