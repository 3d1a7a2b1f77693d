// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping {

/// Turns the images of a pair with lens distortion and any mutual pose into a rectified pair: no
/// distortion, rows of both images the same, right camera on the x axis of the left one.
///
/// The left camera of the rectified pair is the given one turned about its centre; pixels are
/// chosen so that no border stays black. Both tables of 4 + 2 bytes a pixel are made once. Const
/// functions may be called from several threads at once.
class PLANAR_MAPPING_EXPORT Rectifier {
 public:
  /// \throws InputError if the calibration is of no unrectified pair, or the right camera is not
  ///         to the right of the left one (swapped, or mounted one above the other)
  explicit Rectifier(const io::Calibration& calibration);
  ~Rectifier();
  Rectifier(Rectifier&& other) noexcept;
  Rectifier& operator=(Rectifier&& other) noexcept;

  /// Of the rectified pair.
  const io::Calibration& calibration() const { return rectified_; }
  /// Maps points of the given left camera into the rectified one: a rotation.
  const Matrix3& rotation() const { return rotation_; }

  /// \throws InputError if an image has another size than the calibration
  io::Image rectifyLeft(const io::Image& image) const;
  io::Image rectifyRight(const io::Image& image) const;

 private:
  struct Maps;
  io::Image rectify(const io::Image& image, bool left) const;

  io::Calibration rectified_;
  Matrix3 rotation_ = Matrix3::Identity();
  std::unique_ptr<Maps> maps_;
};

/// [ours] Median row offset of features matched in both images of a rectified pair, pixels. More
/// than one tells that the pair is not rectified, or by another calibration. Offsets beyond 6 % of
/// the height are not found.
/// \return nothing where fewer than 60 features agree, or fewer than 0.6 of those that match
/// \throws InputError if the images are empty or of different sizes
PLANAR_MAPPING_EXPORT std::optional<double> rowsApart(const io::Image& left, const io::Image& right,
                                                      const io::Calibration& calibration);

}  // namespace planar_mapping
