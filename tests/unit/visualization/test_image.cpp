// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/image.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

class PngFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("planar_mapping_image_" + std::to_string(::getpid()) +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  fs::path folder_;
};

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

TEST_F(PngFile, ReadsBackWhatWasWritten) {
  writePng(pattern(), path("a.png"), false);
  const Image back = readPng(path("a.png"));
  EXPECT_EQ(back.width, 7);
  EXPECT_EQ(back.height, 5);
  EXPECT_EQ(back.rgb, pattern().rgb);
  EXPECT_EQ(files(), 1u) << "no temporary file stays";
}

TEST_F(PngFile, IsTheSameForTheSamePicture) {
  EXPECT_EQ(encodePng(pattern()), encodePng(pattern()));
}

TEST_F(PngFile, IsNotOverwrittenUnlessAskedTo) {
  writePng(pattern(), path("a.png"), false);
  EXPECT_THROW(writePng(Image(3, 3, {}), path("a.png"), false), IoError);
  EXPECT_EQ(readPng(path("a.png")).width, 7);
  writePng(Image(3, 3, {}), path("a.png"), true);
  EXPECT_EQ(readPng(path("a.png")).width, 3);
}

TEST_F(PngFile, CannotBeWrittenIntoNothing) {
  EXPECT_THROW(writePng(pattern(), path("no/such/a.png"), false), IoError);
  EXPECT_THROW(writePng(pattern(), folder_.string(), true), IoError);
  EXPECT_EQ(files(), 0u);
}

TEST_F(PngFile, FailsCleanlyOnAFullDisk) {
  if (::access("/dev/full", W_OK) != 0) GTEST_SKIP() << "no /dev/full";
  EXPECT_THROW(writePng(pattern(), "/dev/full", false), IoError);
}

TEST_F(PngFile, RefusesWhatIsNoPicture) {
  EXPECT_THROW(readPng(path("missing.png")), IoError);
  EXPECT_THROW(readPng(folder_.string()), IoError);
  std::ofstream(path("empty.png"));
  EXPECT_THROW(readPng(path("empty.png")), IoError);
  std::ofstream(path("text.png")) << "not a picture at all, not by a long way";
  EXPECT_THROW(readPng(path("text.png")), IoError);
}

TEST_F(PngFile, RefusesATruncatedPicture) {
  const std::vector<std::uint8_t> bytes = encodePng(pattern());
  for (const std::size_t size : {std::size_t{8}, std::size_t{30}, bytes.size() / 2}) {
    std::ofstream(path("cut.png"), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(size));
    EXPECT_THROW(readPng(path("cut.png")), IoError) << size;
  }
}

}  // namespace
}  // namespace planar_mapping
