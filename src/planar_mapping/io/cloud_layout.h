// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/io/input_file.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {

// The readers are ours rather than pcl_io's: that library is linked against VTK in distribution
// packages (start-up time and a display stack on the mapping path), and it allocates what a header
// announces before looking at the file. Robots meet cut-off and damaged files.

/// The type of a number as PCD says it in TYPE and SIZE.
struct ScalarType {
  char kind = 'F';  ///< F = float, I = signed, U = unsigned
  std::uint8_t size = 4;

  bool isFloat() const { return kind == 'F'; }
  bool operator==(const ScalarType& o) const { return kind == o.kind && size == o.size; }
};

/// The bytes of a number, whatever its type.
std::uint64_t loadBits(const std::uint8_t* bytes, std::size_t size, bool big_endian);

/// A field of a record: a PCD field or a scalar property of a PLY vertex.
struct CloudField {
  std::string name;
  ScalarType type;
  std::uint64_t count = 1;   ///< values in it
  std::uint64_t offset = 0;  ///< bytes before it in the record
  std::uint64_t word = 0;    ///< values before it in the record
};

/// What the header of a file says.
struct CloudHeader {
  CloudFormat format = CloudFormat::None;
  std::string encoding;  ///< as CloudFileInfo has it
  std::uint64_t width = 0;
  std::uint64_t height = 1;
  std::vector<CloudField> fields;
  Pose T_world_sensor = Pose::Identity();
  std::uint64_t data_position = 0;  ///< where in the file the points begin

  bool isAscii() const { return encoding == "ascii"; }
};

// Each reads up to the first point. \throws IoError
CloudHeader readPcdHeader(InputFile& file, LineReader& lines);
CloudHeader readPlyHeader(InputFile& file, LineReader& lines);

/// A header has about a line a field, and comments.
constexpr std::size_t kMaxHeaderLines = 10000;
/// Longest line of text among the points, bytes: fields of many values.
constexpr std::size_t kLongestDataLine = std::size_t{1} << 24;

/// Turns records into the channels of a CloudData.
class CloudFiller {
 public:
  /// Chooses the fields that are used. \throws IoError if x, y or z is missing, twice or no float,
  /// or if a record gets absurdly large
  CloudFiller(const std::string& path, const std::vector<CloudField>& fields,
              const CloudChannels& channels);

  std::size_t recordSize() const { return record_size_; }

  /// \throws IoError unless 1 <= width * height <= 2^31 - 1 and as many records as that fit into
  /// \p bytes_left
  void checkSize(const CloudHeader& header, std::uint64_t bytes_left) const;
  /// A cloud with memory for the points, after checkSize().
  CloudData allocate(const CloudHeader& header, std::uint64_t bytes_left) const;

  /// All of the first field, then all of the second, ...: the order inside binary_compressed.
  void fillTransposed(CloudData& cloud, const std::uint8_t* data) const;
  /// All records, a line each; blank lines are skipped.
  void fillLines(CloudData& cloud, LineReader& lines) const;
  /// All records from the present position of the file on, read in blocks.
  void fillFromFile(CloudData& cloud, InputFile& file, bool big_endian) const;

 private:
  enum class Target { X, Y, Z, PackedColor, Red, Green, Blue, Label, Intensity };
  struct Column {
    Target target;
    CloudField field;
  };

  void addColumn(const CloudField& field, const CloudChannels& channels);
  void fillColumn(CloudData& cloud, const Column& column, const std::uint8_t* data,
                  std::size_t stride, std::size_t first, std::size_t count, bool big_endian) const;
  void store(CloudData& cloud, const Column& column, std::size_t point, double value) const;
  void parseWord(CloudData& cloud, const Column& column, std::size_t point, std::string_view word,
                 std::size_t line) const;
  bool isDouble(const Column& column) const;
  std::ptrdiff_t countOf(Target target) const;

  std::string path_;
  std::vector<Column> columns_;  ///< in the order of the fields
  std::size_t record_size_ = 0;
  std::size_t words_ = 0;
};

}  // namespace planar_mapping::io
