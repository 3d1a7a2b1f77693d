// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Symbols are hidden by default; what callers need is marked with this macro.
#if defined(_WIN32)
#define PLANAR_MAPPING_EXPORT
#else
#define PLANAR_MAPPING_EXPORT __attribute__((visibility("default")))
#endif
