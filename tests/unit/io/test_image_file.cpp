// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <turbojpeg.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"
#include "temporary_directory.h"

namespace planar_mapping::io {
namespace {

Image gradient(int width, int height, int channels) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column)
      for (int channel = 0; channel < channels; ++channel)
        image.pixels.push_back(static_cast<std::uint8_t>(3 * column + 2 * row + 40 * channel));
  return image;
}

std::vector<std::uint8_t> jpegBytes(const Image& image, int subsampling) {
  const tjhandle encoder = tjInitCompress();
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int result =
      tjCompress2(encoder, image.pixels.data(), image.width, 0, image.height,
                  image.channels == 1 ? TJPF_GRAY : TJPF_RGB, &bytes, &size, subsampling, 95, 0);
  EXPECT_EQ(result, 0);
  std::vector<std::uint8_t> copy(bytes, bytes + size);
  tjFree(bytes);
  tjDestroy(encoder);
  return copy;
}

void write(const std::string& path, const std::vector<std::uint8_t>& bytes) {
  writeFileAtomically(path, bytes.data(), bytes.size(), Overwrite::Allow);
}

/// The message readImage() refuses the file with.
std::string refusal(const std::string& path) {
  try {
    readImage(path);
  } catch (const IoError& error) {
    EXPECT_EQ(error.path(), path);
    return error.what();
  }
  ADD_FAILURE() << path << " was read";
  return "";
}

TEST(ImageFile, ReadsThePngItWrites) {
  const TemporaryDirectory dir;
  for (const int channels : {1, 3}) {
    const Image image = gradient(31, 17, channels);
    const std::string path = dir / (std::to_string(channels) + ".png");
    writeImage(path, image);
    const Image back = readImage(path);
    EXPECT_EQ(back.width, 31);
    EXPECT_EQ(back.height, 17);
    EXPECT_EQ(back.channels, channels);
    EXPECT_EQ(back.pixels, image.pixels);
    EXPECT_THROW(writeImage(path, image), IoError);
    EXPECT_NO_THROW(writeImage(path, image, Overwrite::Allow));
  }
}

TEST(ImageFile, PointersOfGitLfsAreNamed) {
  const TemporaryDirectory dir;
  const std::string path = dir / "pointer.png";
  std::ofstream(path) << "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
  for (const auto& read : {+[](const std::string& file) { readImage(file); },
                           +[](const std::string& file) { readDepthPng(file); }}) {
    try {
      read(path);
      FAIL();
    } catch (const IoError& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find("git lfs pull")) << error.what();
    }
  }
}

TEST(ImageFile, ScalesSixteenBitsToEight) {
  const TemporaryDirectory dir;
  DepthImage depth;
  depth.width = 3;
  depth.height = 1;
  depth.values = {0, 32896, 65535};
  writeDepthPng(dir / "deep.png", depth);
  const Image image = readImage(dir / "deep.png");
  EXPECT_EQ(image.channels, 1);
  EXPECT_EQ(image.pixels, (std::vector<std::uint8_t>{0, 128, 255}));
}

TEST(ImageFile, ReadsJpegByContentNotByName) {
  const TemporaryDirectory dir;
  const Image color = gradient(48, 33, 3);
  write(dir / "color.png", jpegBytes(color, TJSAMP_444));
  const Image back = readImage(dir / "color.png");
  ASSERT_EQ(back.width, 48);
  ASSERT_EQ(back.height, 33);
  ASSERT_EQ(back.channels, 3);
  double error = 0.0;
  for (std::size_t i = 0; i < color.pixels.size(); ++i)
    error += std::abs(int{color.pixels[i]} - int{back.pixels[i]});
  EXPECT_LT(error / static_cast<double>(color.pixels.size()), 4.0);

  write(dir / "gray.jpg", jpegBytes(gradient(16, 16, 1), TJSAMP_GRAY));
  EXPECT_EQ(readImage(dir / "gray.jpg").channels, 1);
  EXPECT_EQ(readImage(dir / "gray.jpg").pixels.size(), 256u);
}

TEST(ImageFile, RefusesImagesCutShortAnywhere) {
  const TemporaryDirectory dir;
  writeImage(dir / "whole.png", gradient(64, 48, 3));
  const std::vector<std::uint8_t> png = readWholeFile(dir / "whole.png");
  const std::vector<std::uint8_t> jpeg = jpegBytes(gradient(64, 48, 3), TJSAMP_420);
  for (const double fraction : {0.02, 0.1, 0.3, 0.5, 0.9, 0.99}) {
    std::vector<std::uint8_t> part = png;
    part.resize(static_cast<std::size_t>(fraction * static_cast<double>(png.size())));
    write(dir / "cut.png", part);
    EXPECT_FALSE(refusal(dir / "cut.png").empty()) << fraction;
    part = jpeg;
    part.resize(static_cast<std::size_t>(fraction * static_cast<double>(jpeg.size())));
    write(dir / "cut.jpg", part);
    EXPECT_FALSE(refusal(dir / "cut.jpg").empty()) << fraction;
  }
}

TEST(ImageFile, ReadsPgmAndPpm) {
  const TemporaryDirectory dir;
  writeFileAtomically(dir / "gray.pgm", std::string("P5\n# a note 7\n3 2\n255\n") + "abcdef");
  const Image gray = readImage(dir / "gray.pgm");
  EXPECT_EQ(gray.width, 3);
  EXPECT_EQ(gray.height, 2);
  EXPECT_EQ(gray.channels, 1);
  EXPECT_EQ(gray.pixels, (std::vector<std::uint8_t>{'a', 'b', 'c', 'd', 'e', 'f'}));
  EXPECT_EQ(readImageSize(dir / "gray.pgm").width, 3);
  writeFileAtomically(dir / "colour.ppm", std::string("P6 1 2 51 ") + "\x01\x02\x03\x33\x33\x33");
  const Image colour = readImage(dir / "colour.ppm");
  EXPECT_EQ(colour.channels, 3);
  EXPECT_EQ(colour.pixels, (std::vector<std::uint8_t>{5, 10, 15, 255, 255, 255}));
  for (const char* bad : {"P5 3 2 255 abcde", "P5 3 2", "P5 0 2 255 ", "P5 3 2 65535 abcdefabcdef",
                          "P5 99999999999 2 255 a", "P5 3 2 255"}) {
    writeFileAtomically(dir / "bad.pgm", std::string(bad), Overwrite::Allow);
    EXPECT_NE(refusal(dir / "bad.pgm").find("PGM"), std::string::npos) << bad;
  }
}

TEST(ImageFile, RefusesADamagedPng) {
  const TemporaryDirectory dir;
  writeImage(dir / "whole.png", gradient(64, 48, 1));
  std::vector<std::uint8_t> png = readWholeFile(dir / "whole.png");
  png[png.size() / 2] ^= 0x5Au;
  write(dir / "damaged.png", png);
  EXPECT_NE(refusal(dir / "damaged.png").find("PNG"), std::string::npos);
}

TEST(ImageFile, RefusesWhatIsNoImage) {
  const TemporaryDirectory dir;
  writeFileAtomically(dir / "text.png", "no image at all");
  writeFileAtomically(dir / "empty.png", "");
  EXPECT_NE(refusal(dir / "text.png").find("is no PNG, JPEG, PGM or PPM"), std::string::npos);
  EXPECT_NE(refusal(dir / "empty.png").find("is no PNG, JPEG, PGM or PPM"), std::string::npos);
  refusal(dir / "missing.png");
  refusal(dir.path());
}

TEST(ImageFile, RefusesASmallFileThatClaimsAHugeImage) {
  const TemporaryDirectory dir;
  std::vector<std::uint8_t> jpeg = jpegBytes(gradient(16, 16, 1), TJSAMP_GRAY);
  // The size stands in the frame header, FF C0, behind its length and precision.
  for (std::size_t i = 0; i + 9 < jpeg.size(); ++i) {
    if (jpeg[i] != 0xFF || jpeg[i + 1] != 0xC0) continue;
    jpeg[i + 5] = jpeg[i + 7] = 0x3F;
    jpeg[i + 6] = jpeg[i + 8] = 0xF0;
  }
  write(dir / "huge.jpg", jpeg);
  EXPECT_NE(refusal(dir / "huge.jpg").find("cut short"), std::string::npos);
  for (std::size_t i = 0; i + 9 < jpeg.size(); ++i) {
    if (jpeg[i] == 0xFF && jpeg[i + 1] == 0xC0) jpeg[i + 5] = 0x80;
  }
  write(dir / "larger.jpg", jpeg);
  EXPECT_NE(refusal(dir / "larger.jpg").find("16384"), std::string::npos);
}

TEST(ImageFile, RefusesToWriteAnImageWhosePixelsDisagreeWithItsSize) {
  const TemporaryDirectory dir;
  Image image = gradient(4, 4, 3);
  image.pixels.pop_back();
  EXPECT_THROW(writeImage(dir / "a.png", image), InputError);
  EXPECT_THROW(writeImage(dir / "a.png", Image()), InputError);
  image = gradient(4, 4, 1);
  image.channels = 2;
  EXPECT_THROW(writeImage(dir / "a.png", image), InputError);
}

TEST(ImageFile, GrayIsTheLuminance) {
  Image image;
  image.width = 4;
  image.height = 1;
  image.channels = 3;
  image.pixels = {255, 255, 255, 255, 0, 0, 0, 255, 0, 0, 0, 255};
  EXPECT_EQ(toGray(image).pixels, (std::vector<std::uint8_t>{255, 76, 150, 29}));
  EXPECT_EQ(toGray(image).channels, 1);
  const Image gray = gradient(5, 5, 1);
  EXPECT_EQ(toGray(gray).pixels, gray.pixels);
  EXPECT_TRUE(toGray(Image()).empty());
}

TEST(ImageFile, ScaledPixelsAreMeansOfWhatTheyCover) {
  const Image image{4, 2, 1, {10, 30, 50, 70, 20, 40, 60, 80}};
  EXPECT_EQ(scaledTo(image, 2, 1).pixels, (std::vector<std::uint8_t>{25, 65}));
  EXPECT_EQ(scaledTo(image, 4, 2).pixels, image.pixels);
  // A third pixel covers half of the second and all of the third and so on.
  EXPECT_EQ(scaledTo({3, 1, 1, {0, 90, 240}}, 2, 1).pixels, (std::vector<std::uint8_t>{30, 190}));
  EXPECT_EQ(scaledTo({2, 1, 1, {0, 200}}, 4, 2).pixels,
            (std::vector<std::uint8_t>{0, 0, 200, 200, 0, 0, 200, 200}));
  const Image colour{2, 1, 3, {10, 20, 30, 30, 40, 50}};
  EXPECT_EQ(scaledTo(colour, 1, 1).pixels, (std::vector<std::uint8_t>{20, 30, 40}));
  EXPECT_THROW(scaledTo(Image(), 2, 2), InputError);
  EXPECT_THROW(scaledTo(image, 0, 2), InputError);
}

TEST(ImageFile, AnImageWithOtherPixelsThanItsSizeSaysIsRefused) {
  const Image few{40, 20, 3, {10, 20, 30}};
  EXPECT_THROW(scaledTo(few, 2, 2), InputError);
  EXPECT_THROW(toGray(few), InputError);
}

DepthImage ramp(std::uint32_t width, std::uint32_t height) {
  DepthImage image;
  image.width = width;
  image.height = height;
  for (std::uint32_t i = 0; i < width * height; ++i)
    image.values.push_back(static_cast<std::uint16_t>(i * 257 % 65536));
  return image;
}

std::string bytesOf(const std::string& path) {
  const auto bytes = readWholeFile(path);
  return {bytes.begin(), bytes.end()};
}

TEST(DepthImage, WritesWhatItReads) {
  const TemporaryDirectory dir;
  const DepthImage image = ramp(31, 17);
  writeDepthPng(dir / "d.png", image);
  const DepthImage back = readDepthPng(dir / "d.png");
  EXPECT_EQ(back.width, 31u);
  EXPECT_EQ(back.height, 17u);
  EXPECT_EQ(back.values, image.values);
  EXPECT_THROW(writeDepthPng(dir / "d.png", image), IoError);
}

TEST(DepthImage, RefusesWhatIsNoDepth) {
  const TemporaryDirectory dir;
  writeImage(dir / "c.png", {1, 1, 3, {0, 0, 0}});
  writeFileAtomically(dir / "text.png", "no image");
  writeFileAtomically(dir / "empty.png", "");
  for (const char* name : {"c.png", "text.png", "empty.png", "missing.png", "."}) {
    try {
      readDepthPng(dir / name);
      ADD_FAILURE() << name;
    } catch (const IoError& error) {
      EXPECT_EQ(error.path(), dir / name);
    }
  }
  EXPECT_THROW(writeDepthPng(dir / "d.png", DepthImage()), InputError);
  DepthImage lying = ramp(2, 2);
  lying.width = 3;
  EXPECT_THROW(writeDepthPng(dir / "d.png", lying), InputError);
}

TEST(DepthImage, SurvivesTruncationAndDamage) {
  const TemporaryDirectory dir;
  writeDepthPng(dir / "d.png", ramp(9, 7));
  const std::string sound = bytesOf(dir / "d.png");
  for (std::size_t size = 0; size + 12 < sound.size(); ++size) {
    std::ofstream(dir / "cut.png", std::ios::binary) << sound.substr(0, size);
    EXPECT_THROW(readDepthPng(dir / "cut.png"), IoError) << size;
  }
  for (std::size_t bit = 0; bit < 8 * sound.size(); bit += 3) {
    std::string damaged = sound;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    std::ofstream(dir / "bit.png", std::ios::binary) << damaged;
    try {
      EXPECT_EQ(readDepthPng(dir / "bit.png").values.size(), 63u) << bit;
    } catch (const IoError&) {
    }
  }
}

TEST(DepthProjector, FollowsThePinholeModel) {
  PinholeCamera camera{2.0, 4.0, 1.0, 0.5, 3, 2};
  DepthImage image;
  image.width = 3;
  image.height = 2;
  image.values = {1000, 2000, 3000, 65535, 65534, 4000};
  CloudData cloud;
  cloud.colors = {1};
  DepthProjector(camera, 1000.0).project(image, cloud);
  EXPECT_EQ(cloud.width, 3u);
  EXPECT_EQ(cloud.height, 2u);
  EXPECT_TRUE(cloud.colors.empty());
  const auto expect_point = [&](std::size_t i, double x, double y, double z) {
    EXPECT_NEAR(cloud.xyz[3 * i], x, 1e-5);
    EXPECT_NEAR(cloud.xyz[3 * i + 1], y, 1e-5);
    EXPECT_NEAR(cloud.xyz[3 * i + 2], z, 1e-5);
  };
  expect_point(0, -0.5, -0.125, 1.0);
  expect_point(1, 0.0, -0.25, 2.0);
  expect_point(2, 1.5, -0.375, 3.0);
  for (std::size_t c = 9; c < 12; ++c) EXPECT_TRUE(std::isnan(cloud.xyz[c]));
  expect_point(4, 0.0, 65.534 / 8, 65.534);
  expect_point(5, 2.0, 0.5, 4.0);
}

TEST(DepthProjector, DistancesAlongRaysEndOnASphere) {
  const PinholeCamera camera{50.0, 40.0, 30.0, 20.5, 64, 48};
  const std::vector<float> values(64 * 48, 2.5f);
  CloudData cloud;
  DepthProjector(camera, 1.0, true).project(values.data(), cloud);
  for (const int i : {0, 63, 1000, 64 * 48 - 1}) {
    const Eigen::Map<const Eigen::Vector3f> p(&cloud.xyz[3 * static_cast<std::size_t>(i)]);
    const Vector3 ray = camera.rayOf(i % 64, i / 64);
    EXPECT_NEAR(p.norm(), 2.5f, 1e-5) << i;
    EXPECT_NEAR(p.cast<double>().cross(ray).norm(), 0.0, 1e-5) << i;
  }
}

TEST(DepthProjector, FloatsAreProjectedLikeCounts) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  PinholeCamera camera{500.0, 400.0, 1.0, 0.5, 3, 2};
  const DepthImage image{3, 2, {1000, 0, 3000, 0, 65535, 0}};
  const std::vector<float> floats = {1000.0f, 0.0f, 3000.0f, test::kNanFloat, kInfinity, -5.0f};
  CloudData from_counts, from_floats;
  const DepthProjector projector(camera, 1000.0);
  projector.project(image, from_counts);
  projector.project(floats.data(), from_floats);
  EXPECT_EQ(3u, from_floats.width);
  EXPECT_EQ(2u, from_floats.height);
  ASSERT_EQ(from_counts.xyz.size(), from_floats.xyz.size());
  for (std::size_t i = 0; i < from_counts.xyz.size(); ++i) {
    EXPECT_TRUE(from_counts.xyz[i] == from_floats.xyz[i] ||
                (std::isnan(from_counts.xyz[i]) && std::isnan(from_floats.xyz[i])))
        << i;
  }
  EXPECT_FLOAT_EQ(1.0f, from_floats.xyz[2]);
}

TEST(DepthProjector, RefusesOtherSizesAndBadCameras) {
  PinholeCamera camera;
  CloudData cloud;
  EXPECT_THROW(DepthProjector(camera, 1000.0), ParameterError);
  camera.width = camera.height = 2;
  EXPECT_THROW(DepthProjector(camera, 1000.0), ParameterError);
  camera.fx = camera.fy = 1.0;
  EXPECT_THROW(DepthProjector(camera, 0.0), ParameterError);
  EXPECT_THROW(DepthProjector(camera, std::nan("")), ParameterError);
  EXPECT_THROW(DepthProjector(camera, 1000.0).project(ramp(3, 2), cloud), InputError);
}

}  // namespace
}  // namespace planar_mapping::io
