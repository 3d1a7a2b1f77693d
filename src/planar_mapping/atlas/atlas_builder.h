// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/atlas/place_finder.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/localization/localizer.h"
#include "planar_mapping/map/joined_map.h"

namespace planar_mapping {

/// When a submap is closed and the next one begun; whichever comes first.
struct PLANAR_MAPPING_EXPORT SubmapParams {
  int frames = 20;     ///< it has as many, >= 1
  double path = 10.0;  ///< the sensor's path in it is as long, metres, > 0

  /// \throws ParameterError
  void validate() const;
};

/// Cuts a session into submaps while it is mapped, recognises places, and keeps the poses of the
/// submaps in agreement with the links that are found.
///
/// Poses of frames are in the frame of their track and may drift: a loop moves submaps, not frames.
/// A track is a part of the session without a gap; nothing but a loop can join two of them. One
/// thread at a time.
class PLANAR_MAPPING_EXPORT AtlasBuilder {
 public:
  /// \param map      of each submap
  /// \param session  its id is given here
  /// \param known    earlier sessions, which this one may find itself in; empty = none
  /// \throws ParameterError; InputError if maps of earlier sessions do not fit: requireFits()
  AtlasBuilder(const SubmapParams& params, const PlanarMapParams& map, AtlasSession session,
               AtlasData known = {});

  /// The map that the next frame is to be inserted into.
  /// \param track  of the frame; another one than that of the frame before closes the open submap
  PlanarMap& mapForNext(std::size_t track = 0);

  /// A frame that was inserted into mapForNext().
  struct Seen {
    std::size_t frame = 0;  ///< number in its input
    std::string source;     ///< file it came from
    double timestamp = 0.0;
    Pose T_track_sensor = Pose::Identity();
    /// What this and later poses of the track are farther off than those before, in the frame of
    /// the sensor; see Matrix6. Absent = poses are given.
    std::optional<Matrix6> drift;
    std::optional<JoinedSubmap> joined;  ///< a track that lies in this one, and ends
    const io::Image* gray = nullptr;     ///< null = places are recognised by the cloud alone
    PointsView cloud;                    ///< with an image organized, of its size
    FeatureCamera camera;
    bool is_scan = false;  ///< a cloud without an image is of a scanner, which looks all around
  };
  /// What became known by a frame.
  struct Update {
    std::vector<Link> links;          ///< loops that were found, solved
    std::vector<std::int64_t> moved;  ///< submaps
  };
  Update add(const Seen& seen);

  /// The next frame begins a submap, whatever the parameters say.
  void closeSubmap() { is_closed_ = true; }

  /// All submaps that links join with the first of this session, as one map. Valid until the next
  /// call of mapForNext().
  /// \throws InputError if an earlier session has another vertical (PlanarMap::merge())
  const PlanarMap& map();
  using Trajectory = std::vector<std::pair<double, Pose>>;  ///< time stamps, T_world_sensor
  /// Frames of this session by component, that of the first one first; each in the order of maps.
  std::vector<std::pair<std::int64_t, Trajectory>> trajectories() const;
  /// Everything so far, the open submap included.
  const AtlasData& data() const { return data_; }

  /// What a store lacks: \p added is new, \p solved has other poses, components and states than
  /// before (AtlasStore::append()).
  using Write = std::function<void(const AtlasData& added, const AtlasData& solved)>;
  /// Gives closed submaps that no earlier call gave to \p write, which may throw: then they are
  /// given again.
  /// \param least_frames  nothing is given as long as the closed submaps have fewer
  /// \return whether there was a submap to give
  bool store(const Write& write, std::size_t least_frames = 0);
  /// Nothing follows: the open submap is closed, and map() has each one exactly where the links put
  /// it. Until then one that moved by less than half a cell stays.
  void finish();
  std::size_t memoryBytes() const;  ///< of the closed submaps of this session

 private:
  /// The part of a track that lies in its last submap.
  struct Track {
    std::int64_t submap = 0;
    std::optional<Pose> last_frame;   ///< T_track_sensor
    Matrix6 drift = Matrix6::Zero();  ///< since the submap began, in the frames of the sensor
  };
  void begin(std::size_t track);
  void updateJoined();
  std::vector<Link> findLoops(const Seen& seen);
  void linkTrack(const JoinedSubmap& joined);

  SubmapParams params_;
  PlanarMapParams map_params_;
  AtlasData data_;
  std::int64_t session_ = 0;
  std::shared_ptr<PlanarMap> open_;  ///< of the last of the submaps
  PlaceFinder places_;
  JoinedMap joined_;
  bool is_joined_ = false;  ///< joined_ holds the open submap as it is
  std::map<std::size_t, Track> tracks_;
  std::size_t open_track_ = 0;
  std::optional<Pose> last_keyframe_;  ///< T_track_sensor, of the open submap
  bool is_over_ = false;
  bool is_closed_ = false;    ///< the open submap takes no more frames
  bool is_entering_ = false;  ///< the last link leads into the open submap, whose first frame comes
  double path_ = 0.0;         ///< in the open submap, metres
  std::size_t closed_bytes_ = 0;
  std::size_t earlier_ = 0;  ///< submaps of earlier sessions
  std::size_t stored_ = 0;   ///< submaps that a store has
};

}  // namespace planar_mapping
