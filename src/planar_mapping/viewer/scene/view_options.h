// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/viewer/scene/colors.h"

namespace planar_mapping {

/// Where the picture is taken from. Front looks along +y of the map, right along -x, and so on;
/// all but Iso and FirstPerson are parallel projections (to scale).
enum class CameraPreset { Iso, Top, Front, Back, Left, Right, FirstPerson };

PLANAR_MAPPING_EXPORT const char* toString(CameraPreset preset);
/// \throws ParameterError listing the words there are
PLANAR_MAPPING_EXPORT CameraPreset cameraPresetFromString(const std::string& word);

/// [ours] Which planar cuboids are left out so that one can look into a room.
enum class Cutaway {
  None,     ///< none
  Ceiling,  ///< those that face down: a ceiling seen from inside
  Seen,     ///< those that face away from the viewer: a surface shows from the side it was seen
            ///< from, as in a doll's house
};

PLANAR_MAPPING_EXPORT const char* toString(Cutaway cutaway);
/// \throws ParameterError listing the words there are
PLANAR_MAPPING_EXPORT Cutaway cutawayFromString(const std::string& word);

/// What is drawn.
struct PLANAR_MAPPING_EXPORT Layers {
  bool occupied = true;
  bool unknown = false;
  bool trajectory = true;
  bool cloud = true;
  bool edges = true;
  bool axes = true;
  bool ground_grid = true;
  bool legend = true;

  /// The layers named in a comma-separated list, and no other; "all" and "none" are lists too.
  /// \throws ParameterError naming the word that is no layer
  static Layers fromString(const std::string& list);
};

/// How content is drawn; shared by snapshots and the window. Lengths in metres.
struct PLANAR_MAPPING_EXPORT ViewOptions {
  ColorBy color = ColorBy::Plane;
  Layers show;
  CameraPreset camera = CameraPreset::Iso;
  std::optional<Vector3> camera_position;  ///< overrides the preset's
  std::optional<Vector3> focal_point;      ///< overrides the preset's
  std::optional<Vector3> view_up;          ///< overrides the preset's
  double zoom = 1.0;                       ///< 2 shows half as much, in (0, 1000]
  Cutaway cutaway = Cutaway::Seen;
  std::optional<double> clip_above;  ///< hide what lies entirely above this height along up
  std::optional<Color> background;   ///< one colour; absent = a light gradient
  double point_size = 2.0;           ///< overlay points, pixels, in [1, 50]
  int width = 1280;                  ///< pixels, in [16, 16384]
  int height = 720;                  ///< pixels, in [16, 16384]; the product at most 2^26

  /// \throws ParameterError
  void validate() const;
  /// "1280x720" into width and height. \throws ParameterError
  void setSize(const std::string& text);
};

}  // namespace planar_mapping
