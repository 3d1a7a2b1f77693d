// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A data-set folder: for each file a byte for its name, two for its size, and its content.
#include "fuzz.h"
#include "planar_mapping/io/layouts/sequence.h"

using namespace planar_mapping;

namespace {

constexpr const char* kNames[] = {
#include "layout_names.inc"
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::filesystem::path folder = fuzz::folder() + "/data";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  for (int i = 0; i < 12 && input.left() > 0; ++i) {
    const std::string name = kNames[input.below(std::size(kNames))];
    std::filesystem::create_directories((folder / name).parent_path());
    fuzz::write("data/" + name, input.text(input.number<std::uint16_t>()));
  }
  fuzz::succeeds([&] {
    const io::Sequence sequence({folder.string()});
    fuzz::require(!sequence.layout().empty(), "a layout has a name");
    for (std::size_t i = 0; i < std::min<std::size_t>(sequence.size(), 3); ++i) {
      fuzz::require(sequence.describe(i).index == i && !sequence.files(i).empty(),
                    "each frame has its files");
      fuzz::succeeds([&] {
        const io::Frame frame = sequence.read(i);
        fuzz::require(!frame.T_world_sensor || frame.T_world_sensor->matrix().allFinite(),
                      "poses are finite");
        fuzz::require(!frame.camera || (frame.camera->fx > 0.0 && frame.camera->fy > 0.0),
                      "cameras have focal lengths");
      });
    }
  });
  return 0;
}
