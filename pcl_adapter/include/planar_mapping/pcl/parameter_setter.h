// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Defines the setter of one field of the parameter struct of a class template over PointT: the
/// field is changed in a copy, which setParams() takes if it is valid as a whole.
#define PLANAR_MAPPING_PARAMETER_SETTER(Class, name, type, field) \
  template <typename PointT>                                      \
  void Class<PointT>::name(type value) {                          \
    auto changed = getParams();                                   \
    changed.field = value;                                        \
    setParams(changed);                                           \
  }
