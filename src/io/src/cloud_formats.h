// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "input_file.h"
#include "planar_mapping/io/cloud_file.h"

namespace planar_mapping {
namespace io {

// The readers are ours rather than pcl_io's: that library is linked against VTK in distribution
// packages (start-up time and a display stack on the mapping path), and it allocates what a header
// announces before looking at the file. Robots meet cut-off and damaged files.

CloudData readPcd(const std::string& path, const CloudChannels& channels);
CloudFileInfo readPcdInfo(const std::string& path);
CloudData readPly(const std::string& path, const CloudChannels& channels);
CloudFileInfo readPlyInfo(const std::string& path);
/// By its ending, size and first points: there is no header.
bool isVelodyne(InputFile& file);
CloudData readVelodyne(const std::string& path, const CloudChannels& channels);
CloudFileInfo readVelodyneInfo(const std::string& path);

}  // namespace io
}  // namespace planar_mapping
