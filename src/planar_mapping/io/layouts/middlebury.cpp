// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <map>

#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/text_lines.h"

// Middlebury 2014 and later: im0.png, im1.png and calib.txt (cam0, cam1, doffs, baseline in mm).
namespace planar_mapping::io::layouts {

bool hasMiddlebury(const std::string& folder) {
  return exists(joined(folder, "im0.png")) || exists(joined(folder, "im1.png"));
}

Description readMiddlebury(const std::string& folder, const SequenceOptions& options) {
  Description description("Middlebury", SequenceKind::Stereo);
  for (const char* name : {"im0.png", "im1.png"}) {
    if (!exists(joined(folder, name)))
      throw IoError(joined(folder, name), "no such file; Middlebury has a pair im0.png, im1.png");
  }
  description.frames.push_back({joined(folder, "im0.png"), joined(folder, "im1.png"), {}, {}});
  if (!options.calibration_file.empty()) return description;

  const std::string path = joined(folder, "calib.txt");
  std::map<std::string, std::vector<double>> values;
  forEachLine(path, "=[];", [&](const Words& words, std::size_t line) {
    std::vector<double> numbers(words.size() - 1);
    finiteNumbers(words, 1, numbers.data(), numbers.size(), path, line);
    values[std::string(words[0])] = numbers;
  });
  const auto get = [&](const char* key, std::size_t count) {
    const auto found = values.find(key);
    if (found == values.end() || found->second.size() != count)
      throw IoError(path, std::string("has no line '") + key + "=' with " + std::to_string(count) +
                              " numbers");
    return found->second;
  };
  const std::vector<double> cam0 = get("cam0", 9);
  const std::vector<double> cam1 = get("cam1", 9);
  const double baseline_m = get("baseline", 1)[0] / 1000.0;
  if (!(cam0[0] > 0.0 && cam0[4] > 0.0 && baseline_m > 0.0))
    throw IoError(path, "focal lengths and baseline must be > 0");
  const Image size = readImageSize(description.frames.front().file);
  const auto requireSame = [&](const char* key, int pixels) {
    const auto found = values.find(key);
    if (found == values.end() || found->second == std::vector<double>{double(pixels)}) return;
    throw IoError(path, "is for images of another size: " + std::string(key) + " is not the " +
                            std::to_string(pixels) + " pixels of the images");
  };
  requireSame("width", size.width);
  requireSame("height", size.height);
  Calibration calibration;
  calibration.camera = {cam0[0], cam0[4], cam0[2], cam0[5], size.width, size.height};
  calibration.baseline = baseline_m;
  calibration.cx_right = cam1[2];
  description.calibration = calibration;
  return description;
}

}  // namespace planar_mapping::io::layouts
