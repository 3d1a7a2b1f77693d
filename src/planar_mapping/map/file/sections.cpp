// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/map/file/map_record.h"
#include "planar_mapping/map/file/parameter_text.h"
#include "planar_mapping/map/store/belief.h"

namespace planar_mapping::detail {
namespace {

// The limits of a file, checked when it is written and when it is read.
constexpr double kFarthest = 1e18;                           ///< of a coordinate, metres
constexpr std::int32_t kFarthestAnchor = kLatticeLimit / 2;  ///< tiles or blocks
constexpr double kUnitTolerance = 1e-3;  ///< of the lengths of directions and quaternions

void require(Columns& columns, bool holds, const char* problem) {
  if (!holds) columns.fail(problem);
}
bool isNear(const Vector3& v) {
  return v.cwiseAbs().maxCoeff() < kFarthest;  // false for NaN
}
bool isUnit(double squared_length) {
  return std::abs(squared_length - 1.0) < kUnitTolerance;
}

template <typename Items, typename Get>
void vectorColumns(Columns& columns, Items& items, Get&& get) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    columns.column(items, [&](auto& item) -> double& { return get(item)[k]; });
  }
}

void codeParams(Columns& columns, MapRecord& record) {
  std::string text = parameterText(record.params, record.is_finished);
  columns.text(text);
  if (columns.isReading()) record.params = parametersOf(text);
}

/// What a cuboid has beside its lengths.
struct CuboidRow {
  std::uint32_t orientation = 0;
  std::int32_t plane_id = -1;
  float probability = 1.0f;
};

/// A length as a whole number of steps, signs folded (0, -1, 1, -2, ... as 1, 2, 3, 4, ...); 0
/// where that does not give the very same.
std::uint32_t foldedSteps(double length, double unit) {
  const double steps = std::round(length / unit);
  if (!(std::abs(steps) < 1e9) || steps * unit != length) return 0;
  const auto whole = static_cast<std::int32_t>(steps);
  return 1 + (whole >= 0 ? 2 * static_cast<std::uint32_t>(whole)
                         : 2 * static_cast<std::uint32_t>(-whole) - 1);
}
double unfolded(std::uint32_t folded, double unit) {
  const std::uint32_t rest = folded - 1;
  const double steps = rest % 2 == 0 ? rest / 2.0 : -(rest / 2 + 1.0);
  return steps * unit;
}

double& lengthOf(Cuboid& cuboid, std::size_t k) {
  return k < 3 ? cuboid.center[static_cast<Eigen::Index>(k)]
               : cuboid.size[static_cast<Eigen::Index>(k) - 3];
}

void codeCuboids(Columns& columns, MapRecord& record) {
  const double unit = 0.25 * record.params.approximation.resolution;
  const std::size_t n = record.cuboids.size();
  std::vector<CuboidRow> rows(n);
  std::vector<std::uint32_t> steps(6 * n);  // all centres x, then y, ..., sizes n
  std::vector<std::array<double, 4>> orientations;
  std::vector<double> others;
  std::map<std::array<double, 4>, std::uint32_t> known;
  for (std::size_t i = 0; i < n; ++i) {
    Cuboid& cuboid = record.cuboids[i];
    const auto& q = cuboid.orientation.coeffs();
    const auto [place, is_new] = known.try_emplace({q[0], q[1], q[2], q[3]},
                                                   static_cast<std::uint32_t>(orientations.size()));
    if (is_new) orientations.push_back(place->first);
    rows[i] = {place->second, cuboid.plane_id, cuboid.probability};
    for (std::size_t k = 0; k < 6; ++k) {
      const double length = lengthOf(cuboid, k);
      steps[k * n + i] = foldedSteps(length, unit);
      if (steps[k * n + i] == 0) others.push_back(length);
    }
  }
  columns.size(orientations, 32);
  for (std::size_t k = 0; k < 4; ++k) {
    columns.column(orientations, [k](auto& q) -> double& { return q[k]; });
  }
  columns.size(rows, 32);
  columns.column(rows, [](CuboidRow& row) -> std::uint32_t& { return row.orientation; });
  columns.column(rows, [](CuboidRow& row) -> std::int32_t& { return row.plane_id; });
  if (!record.is_finished) {
    columns.column(rows, [](CuboidRow& row) -> float& { return row.probability; });
  }
  steps.resize(6 * rows.size());
  columns.column(steps);
  columns.size(others, 8);
  columns.column(others);

  record.cuboids.resize(rows.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const CuboidRow& row = rows[i];
    Cuboid& cuboid = record.cuboids[i];
    require(columns, row.orientation < orientations.size(), "names an orientation it has not");
    const std::array<double, 4>& q = orientations[row.orientation];
    cuboid.orientation = Quaternion(q[3], q[0], q[1], q[2]);
    cuboid.plane_id = row.plane_id;
    cuboid.probability = row.probability;
    for (std::size_t k = 0; k < 6; ++k) {
      const std::uint32_t folded = steps[k * rows.size() + i];
      require(columns, folded != 0 || next < others.size(), "has too few lengths");
      lengthOf(cuboid, k) = folded == 0 ? others[next++] : unfolded(folded, unit);
    }
    require(columns, isNear(cuboid.center) && isNear(cuboid.size), "has a cuboid out of reach");
    require(columns, cuboid.size.minCoeff() >= 0.0, "has a cuboid of negative size");
    require(columns, isUnit(cuboid.orientation.squaredNorm()), "has a quaternion not of length 1");
    require(columns, row.plane_id >= -1, "has a cuboid on an unknown plane");
    require(columns, row.probability >= 0.0f && row.probability <= 1.0f,
            "has a probability that is none");
  }
  require(columns, next == others.size(), "has too many lengths");
}

/// What moments are made of.
struct MomentsRow {
  double weight = 0.0;
  Vector3 mean = Vector3::Zero();
  Matrix3 scatter = Matrix3::Zero();  ///< of which the upper half is stored
};

void codePlanes(Columns& columns, MapRecord& record) {
  columns.value(record.next_plane_id);
  std::vector<PlaneRecord>& planes = record.planes;
  columns.size(planes, 172);
  columns.column(planes, [](PlaneRecord& p) -> std::int32_t& { return p.id; });
  columns.column(planes, [](PlaneRecord& p) -> std::uint32_t& { return p.frames; });
  vectorColumns(columns, planes, [](PlaneRecord& p) -> Vector3& { return p.frame.n; });
  vectorColumns(columns, planes, [](PlaneRecord& p) -> Vector3& { return p.frame.u; });
  vectorColumns(columns, planes, [](PlaneRecord& p) -> Vector3& { return p.frame.origin; });
  std::vector<MomentsRow> moments(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const PlaneMoments& m = planes[i].moments;
    moments[i] = {m.weight(), m.mean(), m.scatter()};
  }
  columns.column(moments, [](MomentsRow& m) -> double& { return m.weight; });
  vectorColumns(columns, moments, [](MomentsRow& m) -> Vector3& { return m.mean; });
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = i; j < 3; ++j) {
      columns.column(moments, [=](MomentsRow& m) -> double& { return m.scatter(i, j); });
    }
  }
  for (std::size_t k = 0; k < 2; ++k) {
    columns.column(planes, [k](PlaneRecord& p) -> std::int32_t& { return p.anchor[k]; });
  }
  columns.column(planes, [](PlaneRecord& p) -> std::uint32_t& { return p.regions; });

  std::int32_t last_id = -1;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    PlaneRecord& p = planes[i];
    const MomentsRow& m = moments[i];
    require(columns, p.id > last_id && p.id < record.next_plane_id, "has planes out of order");
    last_id = p.id;
    const PlaneFrame& f = p.frame;
    require(columns,
            isUnit(f.n.squaredNorm()) && isUnit(f.u.squaredNorm()) &&
                std::abs(f.n.dot(f.u)) < kUnitTolerance,
            "has a plane whose axes are not at right angles");
    require(columns, isNear(f.origin) && isNear(m.mean), "has a plane out of reach");
    require(columns, m.weight >= 0.0 && std::isfinite(m.weight), "has a plane without a weight");
    require(columns, m.scatter.allFinite(), "has a number that is none");
    for (const std::int32_t a : p.anchor) {
      require(columns, std::abs(std::int64_t{a}) <= kFarthestAnchor, "has a patch out of reach");
    }
    if (!columns.isReading()) continue;
    p.frame.v = f.n.cross(f.u);
    const Matrix3 scatter = m.scatter.selfadjointView<Eigen::Upper>();
    p.moments = PlaneMoments::fromSums(m.weight, Vector3::Zero(), scatter, m.mean);
  }
}

void codeCells(Columns& columns, MapRecord& record) {
  record.tiles.code(columns);
  std::uint64_t regions = 0;
  for (const PlaneRecord& plane : record.planes) regions += plane.regions;
  require(columns, regions == record.tiles.regions(), "has not the regions that its planes name");
  for (std::int32_t* a : {&record.anchor.x, &record.anchor.y, &record.anchor.z}) {
    columns.value(*a);
    require(columns, std::abs(std::int64_t{*a}) <= kFarthestAnchor, "has regions out of reach");
  }
  record.blocks.code(columns);
  columns.size(record.region_frames, 4);
  columns.column(record.region_frames);
}

void codeBeliefs(Columns& columns, MapRecord& record) {
  columns.size(record.beliefs, 1);
  const std::uint64_t of_blocks = record.blocks.occupied();
  require(columns, record.beliefs.size() == record.tiles.occupied() + of_blocks,
          "has not one belief for each cell");
  columns.column(record.beliefs);
  for (const std::uint8_t belief : record.beliefs) {
    require(columns, belief > 0 && belief <= kCertain, "gives a cell a belief that is none");
  }
  if (record.params.approximation.profile == Profile::Compact) {
    columns.size(record.octants, 1);
    require(columns, record.octants.size() == of_blocks, "has not the octants of each cell");
    columns.column(record.octants);
    return;
  }
  columns.size(record.means, 3);
  require(columns, record.means.size() == of_blocks, "has not the mean of each cell");
  for (std::size_t k = 0; k < 3; ++k) {
    columns.column(record.means, [k](CellBlock::Mean& m) -> std::uint8_t& { return m[k]; });
  }
}

void codeSpace(Columns& columns, MapRecord& record) {
  record.space.code(columns);
}

void codePoses(Columns& columns, MapRecord& record) {
  std::vector<FramePose>& poses = record.trajectory;
  columns.size(poses, 64);
  columns.column(poses, [](FramePose& p) -> double& { return p.timestamp; });
  vectorColumns(columns, poses, [](FramePose& p) -> Vector3& { return p.position; });
  for (Eigen::Index k = 0; k < 4; ++k) {
    columns.column(poses, [k](FramePose& p) -> double& { return p.orientation.coeffs()[k]; });
  }
  for (const FramePose& p : poses) {
    require(columns, std::isfinite(p.timestamp), "has a time that is none");
    require(columns, isNear(p.position), "has a pose out of reach");
    require(columns, isUnit(p.orientation.squaredNorm()), "has a quaternion not of length 1");
  }
}

void codeGround(Columns& columns, MapRecord& record) {
  std::vector<GroundPlace>& ground = record.ground;
  columns.size(ground, 12);
  for (std::size_t k = 0; k < 3; ++k)
    columns.column(ground, [k](GroundPlace& p) -> std::int16_t& { return p.cube[k]; });
  columns.column(ground, [](GroundPlace& p) -> std::uint16_t& { return p.points; });
  columns.column(ground, [](GroundPlace& p) -> std::uint32_t& { return p.steps; });
  const GroundPlace* before = nullptr;
  for (const GroundPlace& p : ground) {
    require(columns, before == nullptr || before->cube < p.cube, "has places out of order");
    before = &p;
    require(columns, p.points > 0 && p.steps <= 255U * p.points, "has a height out of its cube");
  }
}

bool hasGround(const MapRecord& record) {
  return !record.ground.empty();
}

struct Section {
  const char* name;  ///< at most kNameBytes
  void (*code)(Columns&, MapRecord&);
  bool is_in_finished;
  bool is_derived;  ///< from the others, unless the map is finished: not read
  /// Null if every map has it.
  bool (*is_there)(const MapRecord&) = nullptr;
};
constexpr std::size_t kNameBytes = 8;
/// In the order of the file; later ones need those before.
constexpr Section kSections[] = {
    {"PARAMS", codeParams, true, false}, {"CUBOIDS", codeCuboids, true, true},
    {"SPACE", codeSpace, true, false},   {"PLANES", codePlanes, false, false},
    {"CELLS", codeCells, false, false},  {"BELIEFS", codeBeliefs, false, false},
    {"POSES", codePoses, false, false},  {"GROUND", codeGround, false, false, hasGround},
};

struct Bytes {
  const std::uint8_t* data;
  std::size_t size;
};

/// The sections by their names.
std::map<std::string, Bytes> namedSections(const std::vector<std::uint8_t>& bytes) {
  std::map<std::string, Bytes> sections;
  for (std::size_t at = 0; at < bytes.size();) {
    if (bytes.size() - at < kNameBytes + 8) throw Error("the map ends within a section");
    const char* name = reinterpret_cast<const char*>(&bytes[at]);
    Columns head("sizes", &bytes[at + kNameBytes], 8);
    std::uint64_t size = 0;
    head.value(size);
    at += kNameBytes + 8;
    if (size > bytes.size() - at) throw Error("the map ends within a section");
    const std::string key(name, strnlen(name, kNameBytes));
    if (!sections.insert({key, {bytes.data() + at, static_cast<std::size_t>(size)}}).second) {
      throw Error("the map has two sections " + key);
    }
    at += static_cast<std::size_t>(size);
  }
  return sections;
}

}  // namespace

std::vector<std::uint8_t> sectionsOf(MapRecord record) {
  std::vector<std::uint8_t> bytes;
  for (const Section& section : kSections) {
    if (record.is_finished && !section.is_in_finished) continue;
    if (section.is_there != nullptr && !section.is_there(record)) continue;
    Columns columns(section.name);
    section.code(columns, record);
    Columns head("sizes");
    std::uint64_t size = columns.written().size();
    head.value(size);
    bytes.insert(bytes.end(), section.name, section.name + std::strlen(section.name));
    bytes.resize(bytes.size() + kNameBytes - std::strlen(section.name));
    bytes.insert(bytes.end(), head.written().begin(), head.written().end());
    bytes.insert(bytes.end(), columns.written().begin(), columns.written().end());
  }
  return bytes;
}

MapRecord recordOfSections(const std::vector<std::uint8_t>& bytes, bool is_finished) {
  const std::map<std::string, Bytes> sections = namedSections(bytes);
  MapRecord record;
  record.is_finished = is_finished;
  for (const Section& section : kSections) {
    if (is_finished ? !section.is_in_finished : section.is_derived) continue;
    const auto found = sections.find(section.name);
    if (found == sections.end() && section.is_there != nullptr) continue;
    if (found == sections.end()) {
      throw Error(std::string("the map has no section ") + section.name);
    }
    Columns columns(section.name, found->second.data, found->second.size);
    section.code(columns, record);
    columns.end();
  }
  return record;
}

}  // namespace planar_mapping::detail
