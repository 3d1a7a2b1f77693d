// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

extern "C" {
/// PCL's tutorial loop: RANSAC with optimised coefficients, extract the inliers, go on with the
/// rest until \p rest_fraction of the points are left or a plane is too small. \param labels count
/// entries, plane of each point, -1 = none \param coefficients 4 per plane, room for max_planes
/// \return number of planes
int peerPclPlanes(const float* xyz, int count, float distance_threshold, float rest_fraction,
                  int min_inliers, int max_planes, int* labels, float* coefficients);
}
