// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Defines the setter of one field of the parameter struct of a class: the field is changed in a
/// copy, which setParams() takes if it is valid as a whole.
#define PLANAR_MAPPING_SETTER(Class, name, type, field) \
  void Class::name(type value) {                        \
    auto changed = getParams();                         \
    changed.field = value;                              \
    setParams(changed);                                 \
  }

/// The same for a class template over PointT.
#define PLANAR_MAPPING_PARAMETER_SETTER(Class, name, type, field) \
  template <typename PointT>                                      \
  PLANAR_MAPPING_SETTER(Class<PointT>, name, type, field)
