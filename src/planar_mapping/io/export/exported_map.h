// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/geometry/turning.h"
#include "planar_mapping/io/export/map_export.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {

// How other programs write what a Cuboid holds. Nothing else converts angles, quaternions, lengths,
// colours or the order of corners.

/// A number of a binary format, all of which are little endian, as are the processors we know.
template <typename Number>
void appendBytes(std::string& out, Number value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline void appendFloats(std::string& out, const Vector3& v) {
  for (int i = 0; i < 3; ++i) appendBytes(out, static_cast<float>(v[i]));
}

/// Parts in [0, 255], as on a screen (sRGB).
struct Colour {
  int red, green, blue;
  double alpha = 1.0;  ///< below 1: unknown space
};
/// Hues a golden angle apart, so that neighbours in number differ; gray without a plane.
Colour colourOf(const Cuboid& cuboid);

/// "plane_7", "no_plane" or "unknown": what meshes and materials are named after.
std::string groupOf(const Cuboid& cuboid);

/// Angles about the fixed x, y and z axes, in this order, radians (URDF, SDFormat).
Vector3 rollPitchYaw(const Quaternion& q);

/// kCuboidFaces as triangles.
constexpr int kTriangles[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},
                                   {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                   {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};

/// Parts in [0, 1].
inline NumberList rgbaOf(const Colour& c) {
  return {4, " ", {c.red / 255.0, c.green / 255.0, c.blue / 255.0, c.alpha}};
}

/// What a format is written from.
struct ExportedMap {
  std::vector<Cuboid> cuboids;  ///< occupied, then unknown if asked for
  std::vector<Cuboid> free;     ///< seen free; only for formats that say so
  Vector3 up = Vector3::UnitZ();
  Vector3 origin = Vector3::Zero();  ///< PlanarMapParams::origin
  std::vector<Cuboid> unknown;       ///< only for pages
  PlanSource plan;                   ///< only for plans and pages
  double resolution = 0.1;
  std::size_t frames = 0;
  ExportOptions options;
  mutable std::vector<std::string> notes;  ///< of plans: what a user should know

  double cell() const { return options.cell > 0.0 ? options.cell : resolution; }
};

/// What a format needs to know of space.
enum class Space {
  AsAsked,  ///< unknown cuboids if the options say so
  Free,     ///< what was seen free
  Plan,     ///< what plans are made of
  Page,     ///< cuboids, unknown space and what plans are made of
};
ExportedMap exportedOf(const PlanarMap& map, Space space, const ExportOptions& options);

/// What the files hold, in the order of exportedFiles().
using Contents = std::vector<std::string>;
// path is the one asked for. A plan has the same files for each of its storeys.
using Writer = Contents(const ExportedMap& map, const std::string& path);
Writer writeCsv, writeGlb, writeModelFolder, writeObj, writePage, writePly, writePoints, writeScene,
    writeSdf, writeStl, writeUrdf, writeVtp;
Writer writeDxf, writePgm, writeSvg;  ///< plans
Writer writeOctree;                   ///< .bt, .ot

/// The storey on which the path ends. \param plans  of planar_mapping::plansOf()
const Plan& storeyOfPath(const ExportedMap& map, const std::vector<Plan>& plans);

/// "origin_m X Y Z" between two texts for a map that has an origin of its own, else nothing.
std::string originNote(const ExportedMap& map, const char* before, const char* after);

/// The name of a file without folder and extension, or of a folder.
std::string stemOf(const std::string& path);

}  // namespace planar_mapping::io
