// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/plane.h"

namespace planar_mapping::evaluation {

enum class Shape {
  Box,       ///< size: full lengths
  Cylinder,  ///< axis along local z; size: diameter, diameter, length
  Sphere     ///< size: diameter three times
};

enum class Pattern { Plain, Speckles, Planks, Tiles, Bricks };

struct Material {
  std::uint32_t color = 0x808080;  ///< 0xRRGGBB
  Pattern pattern = Pattern::Speckles;
  /// How well stereo finds its way on it, in [0, 1]; at 0 it is of one colour, and leaves holes.
  double texture = 1.0;
  /// Fraction of the square metres of a flat face that have a poster on them, in [0, 1].
  double posters = 0.0;
  /// Brightness of the lamp's reflection, in units of the colour: it lies where a mirror shows the
  /// lamp, so that two cameras see it behind the surface.
  double gloss = 0.0;
};

/// A solid of the scene. A box has faces 0 to 5: -x, +x, -y, +y, -z, +z of its own axes; a
/// cylinder 4 and 5 for its ends and 6 for its side; a sphere 6.
struct SceneObject {
  std::string name;
  Shape shape = Shape::Box;
  Pose T_world_object = Pose::Identity();
  Vector3 size = Vector3::Ones();  ///< metres
  Material material;
  int first_frame = 0;                               ///< in which it is there
  int last_frame = std::numeric_limits<int>::max();  ///< in which it is there

  bool isThere(int frame) const { return first_frame <= frame && frame <= last_frame; }
};

constexpr int kCurvedFace = 6;

/// A world of solids whose surface is known exactly, and a path to look at it from.
/// World frame, z up, metres, ground z = 0.
struct PLANAR_MAPPING_EXPORT Scene {
  std::string name;
  std::vector<SceneObject> objects;
  std::vector<Pose> path;                                 ///< T_world_camera, camera optical frame
  double camera_height = 0.0;                             ///< above the ground, metres
  Vector3 light = Vector3(0.35, -0.5, 0.8).normalized();  ///< towards it, unit length
  /// A lamp in place of that light: nearer surfaces are brighter, and objects throw shadows.
  std::optional<Vector3> lamp;

  /// Turns objects, path and light about the world's z axis (radians), so that walls no longer
  /// lie along the axes a grid would favour.
  void rotate(double yaw);
};

/// Planes of the flat faces of a scene; coplanar faces that look the same way share one.
struct ScenePlanes {
  std::vector<Plane> planes;  ///< world frame, normals point out of the solid
  /// Index into planes of face f of object i; -1 where curved.
  std::vector<std::vector<int>> plane_of_face;
};

PLANAR_MAPPING_EXPORT ScenePlanes planesOf(const Scene& scene);

enum class Path {
  Forward,   ///< from the beginning of the scene to its end; room: once around
  Return,    ///< there, a turn on the spot, and back; room: twice around
  Back,      ///< there, and back out of it without a turn; room: twice around
  Standing,  ///< every frame from the first place
};

struct PLANAR_MAPPING_EXPORT SceneParams {
  std::string scene = "room";
  int frames = 12;  ///< >= 1
  Path path = Path::Forward;
  /// Metres between frames, >= 0; the path ends early, or stands still at its end. 0 = the frames
  /// are spread over the whole path.
  double step = 0.0;
  double length = 0.0;  ///< of the corridor, metres, [8, 1000]; 0 = the hand-made one of 16 m
  int floors = 3;       ///< of the building, [1, 20]
  int rooms = 8;        ///< on each floor of the building, [2, 200]
  int walk = 0;         ///< through the building: each number is another way through the same rooms
  /// Adds what does not stay: a person who leaves, and a door that opens; people who walk through
  /// the building.
  bool moving = false;
  std::uint64_t seed = Random::kDefaultSeed;  ///< of the layout of "white" and of the building

  /// \throws ParameterError; InputError for an unknown name
  void validate() const;
};

/// Names makeScene() knows: "room", "corridor", "outdoor", "rooms", "white", "building".
PLANAR_MAPPING_EXPORT const std::vector<std::string>& sceneNames();

/// Builds a scene with its path.
/// - room: 6 x 4.8 m, furnished, camera 1.25 m above the floor turning once around;
/// - corridor: doors, niches, side rooms and boxes, camera at 0.37 m (the paper, IV);
/// - outdoor: 30 x 10 m between walls, steps, trunks, columns and pillars, camera at 0.37 m; a
///   carton and a bicycle stand are moved half way;
/// - rooms: two rooms side by side whose outer walls are one plane each, a doorway between them,
///   camera at 0.37 m;
/// - white: a closed room whose walls and ceiling are of one colour, with base boards, pictures, a
///   door, a lamp, shadows and a glossy cabinet, all placed by the seed; camera at 1 m turning once
///   around;
/// - building: storeys of furnished rooms on both sides of a hall, stairs at its end; camera at
///   1.2 m, from room to room, 0.15 m a frame unless there is a step.
/// \throws as SceneParams::validate()
PLANAR_MAPPING_EXPORT Scene makeScene(const SceneParams& params);
/// The same with \p frames along the usual path.
PLANAR_MAPPING_EXPORT Scene makeScene(const std::string& name, int frames);

}  // namespace planar_mapping::evaluation
