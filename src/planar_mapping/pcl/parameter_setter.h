// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Defines the setter of one field of the params_ of a class: the field is changed in a copy, which
/// is taken if it is valid as a whole.
#define PLANAR_MAPPING_SETTER(Class, name, type, field) \
  void Class::name(type value) {                        \
    auto changed = params_;                             \
    changed.field = value;                              \
    changed.validate();                                 \
    params_ = changed;                                  \
  }

/// The same for a class template over PointT.
#define PLANAR_MAPPING_TEMPLATE_SETTER(Class, name, type, field) \
  template <typename PointT>                                     \
  PLANAR_MAPPING_SETTER(Class<PointT>, name, type, field)

/// For a class template over PointT whose engine takes its parameters by setParams().
#define PLANAR_MAPPING_PARAMETER_SETTER(Class, name, type, field) \
  template <typename PointT>                                      \
  void Class<PointT>::name(type value) {                          \
    auto changed = getParams();                                   \
    changed.field = value;                                        \
    setParams(changed);                                           \
  }
