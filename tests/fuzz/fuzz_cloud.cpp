// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A cloud file after a byte that says how it is called and what is read of it.
#include "fuzz.h"
#include "planar_mapping/io/cloud_file.h"

using namespace planar_mapping;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const bool is_scan = input.flag();
  const std::string path = fuzz::write(is_scan ? "c.bin" : "c.pcd", input.rest());
  io::CloudData cloud;
  if (!fuzz::succeeds([&] { cloud = io::readCloudFile(path); })) return 0;
  const std::size_t points = std::size_t{cloud.width} * cloud.height;
  const auto fits = [&](std::size_t channel) { return channel == 0 || channel == points; };
  fuzz::require(cloud.xyz.size() == 3 * points, "as many points as width and height say");
  fuzz::require(
      fits(cloud.colors.size()) && fits(cloud.labels.size()) && fits(cloud.intensities.size()),
      "channels as long as the cloud");
  const io::CloudFileInfo info = io::readCloudFileInfo(path);
  fuzz::require(info.width == cloud.width && info.height == cloud.height,
                "the header says how many points there are");

  const std::string copy = fuzz::folder() + "/copy.pcd";
  io::writePcd(copy, cloud, io::Overwrite::Allow);
  const io::CloudData again = io::readCloudFile(copy);
  const auto same = [](float a, float b) { return a == b || (a != a && b != b); };
  fuzz::require(
      std::equal(cloud.xyz.begin(), cloud.xyz.end(), again.xyz.begin(), again.xyz.end(), same) &&
          cloud.colors == again.colors && cloud.labels == again.labels,
      "a cloud that is written is read as the same");
  return 0;
}
