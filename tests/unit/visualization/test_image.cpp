// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/image.h"

#include <gtest/gtest.h>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/image_file.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

Image pattern() {
  Image image(7, 5, {10, 20, 30});
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 7; ++column) {
      image.set(column, row,
                {static_cast<std::uint8_t>(30 * column), static_cast<std::uint8_t>(50 * row), 200});
    }
  }
  return image;
}

TEST(Image, RefusesAbsurdSizes) {
  EXPECT_THROW(Image(0, 5, {}), ParameterError);
  EXPECT_THROW(Image(5, -1, {}), ParameterError);
  EXPECT_THROW(Image(16385, 1, {}), ParameterError);
}

TEST(IsBlank, SeesASinglePixel) {
  Image image(40, 30, {200, 210, 220});
  EXPECT_TRUE(isBlank(image));
  image.set(39, 29, {200, 210, 224});
  EXPECT_FALSE(isBlank(image));
  image.set(39, 29, {202, 210, 218});
  EXPECT_TRUE(isBlank(image)) << "rounding noise is not a picture";
  EXPECT_TRUE(isBlank(Image()));
}

TEST(CompareImages, CountsChangedPixels) {
  const Image a(10, 10, {100, 100, 100});
  Image b = a;
  EXPECT_EQ(compareImages(a, b).changed, 0.0);
  b.set(3, 4, {100, 117, 100});
  b.set(5, 4, {100, 116, 100});
  EXPECT_DOUBLE_EQ(compareImages(a, b).changed, 0.01);
  EXPECT_NEAR(compareImages(a, b).mean, 33.0 / (255.0 * 300.0), 1e-12);
  EXPECT_THROW(compareImages(a, Image(10, 9, {})), InputError);
}

TEST(Png, ReadsBackWhatWasWritten) {
  const TemporaryDirectory dir;
  writePng(pattern(), dir / "a.png", false);
  const Image back = readPng(dir / "a.png");
  EXPECT_EQ(back.width, 7);
  EXPECT_EQ(back.height, 5);
  EXPECT_EQ(back.rgb, pattern().rgb);
  EXPECT_THROW(writePng(Image(3, 3, {}), dir / "a.png", false), IoError);
  EXPECT_EQ(readPng(dir / "a.png").width, 7);
  writePng(Image(3, 3, {}), dir / "a.png", true);
  EXPECT_EQ(readPng(dir / "a.png").width, 3);
}

TEST(Png, AGrayFileHasThreeEqualChannels) {
  const TemporaryDirectory dir;
  io::writeImage(dir / "gray.png", {2, 1, 1, {7, 200}});
  EXPECT_EQ(readPng(dir / "gray.png").rgb, (std::vector<std::uint8_t>{7, 7, 7, 200, 200, 200}));
}

}  // namespace
}  // namespace planar_mapping
