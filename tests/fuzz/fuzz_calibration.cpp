// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A calib.yaml.
#include "fuzz.h"
#include "planar_mapping/io/calibration.h"

using namespace planar_mapping;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = fuzz::write("calib.yaml", fuzz::Input(data, size).rest());
  std::string text;
  if (!fuzz::succeeds([&] { text = io::toYaml(io::readCalibration(path)); })) return 0;
  fuzz::require(io::toYaml(io::readCalibration(fuzz::write("again.yaml", text))) == text,
                "a calibration that is written is read as the same");
  return 0;
}
