// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/io/atomic_file.h"

namespace planar_mapping {

enum class AtlasAccess { Read, Write };

/// How much of a file is read.
enum class AtlasContent {
  All,
  WithoutMaps,  ///< Submap::map is null
  Outline,      ///< and of keyframes only numbers, frame, source, time, pose and camera
};

/// What becomes of the session that was begun last when another one is added.
enum class Append { ToAll, InPlaceOfLastSession };

/// A file of an atlas, *.atlas: a SQLite database (docs/atlas_format.md).
///
/// What append() or update() wrote is there after a crash at any moment, and of what one of them
/// had not finished nothing is. The one that opened the file for writing has it alone until it is
/// gone; any number may read at the same time. One object belongs to one thread at a time.
///
/// All functions throw IoError with the path where the file is missing, no atlas, of another
/// version, damaged, cut short, read-only, open in another run, or the disk is full; then the file
/// is as it was before the call.
class PLANAR_MAPPING_EXPORT AtlasStore {
 public:
  /// A new file without content, open for writing.
  /// \throws io::FileExistsError if it exists and \p overwrite is Refuse
  static AtlasStore create(const std::string& path,
                           io::Overwrite overwrite = io::Overwrite::Refuse);
  /// A file that exists.
  static AtlasStore open(const std::string& path, AtlasAccess access = AtlasAccess::Read);

  AtlasStore(AtlasStore&& other) noexcept;
  AtlasStore& operator=(AtlasStore&& other) noexcept;
  ~AtlasStore();

  /// All it holds. Every row is checked: sizes, finite numbers, rigid poses, maps, and that each
  /// number names something.
  /// \param threads  of the maps (PlanarMap::deserialize()); 0 = all cores
  AtlasData load(int threads = 1, AtlasContent content = AtlasContent::All);

  /// All it held when its last session began: neither the rows of that, nor what they moved.
  AtlasData loadWithoutLastSession(int threads = 1);
  /// Whether the last session was begun by append() and is not closed: it can be taken back.
  bool isLastSessionOpen();
  /// It is complete: from now on it cannot be taken back.
  void closeSession();

  /// The map of one submap. \throws InputError if there is none with this id
  std::shared_ptr<const PlanarMap> map(std::int64_t submap, int threads = 1);

  /// Adds the sessions, submaps, keyframes and links of \p part, in one transaction: usually one
  /// submap with its keyframes and the links that were found with it. What they refer to is in
  /// \p part or in the file.
  /// \param solved  what update() is called with in the same transaction
  /// \param how     InPlaceOfLastSession: that one, which is open, is taken back in the same
  ///                transaction
  /// \throws InputError if something has a number that is taken, refers to nothing, is not finite
  ///         or has sizes that disagree
  void append(const AtlasData& part, const AtlasData& solved = {}, Append how = Append::ToAll);

  /// As append(), but no session is opened, and maps are copied as they are from another file,
  /// which has the submaps of \p part under numbers that are lower by \p offset. \throws InputError
  /// as append(), or if the other file has no such map
  void appendWithMapsOf(AtlasStore& other, std::int64_t offset, const AtlasData& part);

  /// Writes what solving changes of the submaps and links in \p solved, in one transaction: poses,
  /// components, states and residuals.
  /// \throws InputError if the file has no such submap or link, or something is not finite
  void update(const AtlasData& solved);

  const std::string& path() const;

 private:
  struct Impl;
  explicit AtlasStore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Writes an atlas, whole or not at all. The same data give the same bytes, with one version of
/// SQLite; a file that grew by append() has the same rows, in pages of another order.
/// \throws io::FileExistsError; IoError; InputError as AtlasStore::append()
PLANAR_MAPPING_EXPORT void saveAtlas(const AtlasData& data, const std::string& path,
                                     io::Overwrite overwrite = io::Overwrite::Refuse);

/// AtlasStore::load() of a file. \throws IoError
PLANAR_MAPPING_EXPORT AtlasData loadAtlas(const std::string& path, int threads = 1,
                                          AtlasContent content = AtlasContent::All);

}  // namespace planar_mapping
