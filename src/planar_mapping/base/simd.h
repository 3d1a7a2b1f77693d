// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Put before a function whose plain loops should exist for AVX2 (and AVX-512) as well, chosen at
/// run time. Such functions take raw pointers and must not use Eigen: an Eigen inline compiled for
/// another instruction set could replace the portable one at link time.
/// Sanitizers run before ifunc resolvers can, so there only the portable clone exists.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define PLANAR_MAPPING_MULTIVERSION \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define PLANAR_MAPPING_MULTIVERSION
#endif

/// Put before what such functions call: each of their clones gets a copy of its own.
#define PLANAR_MAPPING_INLINE inline __attribute__((always_inline))
