// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/image.h"

#include <gtest/gtest.h>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/image_file.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

Image filled(int width, int height, Color color) {
  Image image{width, height, 3, {}};
  for (int i = 0; i < width * height; ++i) {
    image.pixels.insert(image.pixels.end(), {color.red, color.green, color.blue});
  }
  return image;
}

void set(Image& image, int column, int row, Color color) {
  std::uint8_t* p = &image.pixels[static_cast<std::size_t>(3 * (row * image.width + column))];
  p[0] = color.red;
  p[1] = color.green;
  p[2] = color.blue;
}

Image pattern() {
  Image image = filled(7, 5, {10, 20, 30});
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 7; ++column) {
      set(image, column, row,
          {static_cast<std::uint8_t>(30 * column), static_cast<std::uint8_t>(50 * row), 200});
    }
  }
  return image;
}

TEST(ColorAt, CountsRowsFromTheTop) {
  EXPECT_EQ(colorAt(pattern(), 6, 1), (Color{180, 50, 200}));
}

TEST(IsBlank, SeesASinglePixel) {
  Image image = filled(40, 30, {200, 210, 220});
  EXPECT_TRUE(isBlank(image));
  set(image, 39, 29, {200, 210, 224});
  EXPECT_FALSE(isBlank(image));
  set(image, 39, 29, {202, 210, 218});
  EXPECT_TRUE(isBlank(image)) << "rounding noise is not a picture";
  EXPECT_TRUE(isBlank(Image()));
}

TEST(CompareImages, CountsChangedPixels) {
  const Image a = filled(10, 10, {100, 100, 100});
  Image b = a;
  EXPECT_EQ(compareImages(a, b).changed, 0.0);
  set(b, 3, 4, {100, 117, 100});
  set(b, 5, 4, {100, 116, 100});
  EXPECT_DOUBLE_EQ(compareImages(a, b).changed, 0.01);
  EXPECT_NEAR(compareImages(a, b).mean, 33.0 / (255.0 * 300.0), 1e-12);
  EXPECT_THROW(compareImages(a, filled(10, 9, {})), InputError);
}

TEST(Png, ReadsBackWhatWasWritten) {
  const TemporaryDirectory dir;
  io::writeImage(dir / "a.png", pattern());
  const Image back = readPng(dir / "a.png");
  EXPECT_EQ(back.width, 7);
  EXPECT_EQ(back.height, 5);
  EXPECT_EQ(back.pixels, pattern().pixels);
  EXPECT_THROW(io::writeImage(dir / "a.png", filled(3, 3, {})), IoError);
  EXPECT_EQ(readPng(dir / "a.png").width, 7);
  io::writeImage(dir / "a.png", filled(3, 3, {}), io::Overwrite::Allow);
  EXPECT_EQ(readPng(dir / "a.png").width, 3);
}

TEST(Png, AGrayFileHasThreeEqualChannels) {
  const TemporaryDirectory dir;
  io::writeImage(dir / "gray.png", {2, 1, 1, {7, 200}});
  EXPECT_EQ(readPng(dir / "gray.png").pixels, (std::vector<std::uint8_t>{7, 7, 7, 200, 200, 200}));
}

}  // namespace
}  // namespace planar_mapping
