// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/map_file.h"

#include <cstdint>
#include <vector>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace io {

void saveMap(const PlanarMap& map, const std::string& path, Overwrite overwrite) {
  const std::vector<std::uint8_t> bytes = map.serialize();
  AtomicFile file(path, overwrite);
  file.write(bytes.data(), bytes.size());
  // What cannot be read back must not replace what can.
  if (file.readBack() != bytes) {
    throw IoError(path, "what was read back is not what was written; is the disk faulty?");
  }
  PlanarMap::deserialize(bytes.data(), bytes.size());
  file.commit();
}

PlanarMap loadMap(const std::string& path) {
  const std::vector<std::uint8_t> bytes = readWholeFile(path);
  try {
    return PlanarMap::deserialize(bytes.data(), bytes.size());
  } catch (const IoError&) {
    throw;
  } catch (const Error& error) {
    throw IoError(path, error.what());
  }
}

}  // namespace io
}  // namespace planar_mapping
