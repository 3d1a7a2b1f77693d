// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/atlas/atlas_store.h"
#include "planar_mapping/atlas/sqlite_file.h"

namespace planar_mapping::detail {

/// The map of a submap as a file has it.
using MapBytes = std::function<std::vector<std::uint8_t>(const Submap&)>;
/// Of Submap::map. \throws InputError if there is none
std::vector<std::uint8_t> serialized(const Submap& submap);

/// Adds sessions, submaps, keyframes and links. \throws InputError as AtlasStore::append()
void insertRows(SqliteFile& file, const AtlasData& part, const MapBytes& bytes_of = serialized);
/// Poses, components, states and residuals. \throws InputError as AtlasStore::update()
void updateRows(SqliteFile& file, const AtlasData& solved);
/// \throws InputError that says what is wrong with a row, or with what rows refer to
AtlasData readRows(SqliteFile& file, int threads, AtlasContent content);
/// \throws InputError that names the submap
std::shared_ptr<const PlanarMap> mapOf(const BlobView& bytes, std::int64_t submap, int threads);

}  // namespace planar_mapping::detail
