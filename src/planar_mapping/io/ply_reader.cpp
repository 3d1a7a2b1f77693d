// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <optional>

#include "planar_mapping/io/cloud_layout.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {
namespace {

constexpr std::size_t kLongestHeaderLine = std::size_t{1} << 16;
constexpr std::size_t kLongestDataLine = std::size_t{1} << 24;
constexpr std::size_t kMaxHeaderLines = 10000;

struct Property {
  bool is_list = false;
  ScalarType count_type{'U', 1};
  CloudField field;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  bool hasList() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const Property& p) { return p.is_list; });
  }
};

struct PlyHeader {
  std::string encoding;
  std::vector<Element> elements;
  std::size_t vertex = 0;  ///< index of the vertex element
  std::uint64_t data_position = 0;
};

std::optional<ScalarType> scalarType(std::string_view name) {
  struct Name {
    const char* name;
    ScalarType type;
  };
  static constexpr Name kNames[] = {
      {"char", {'I', 1}},  {"int8", {'I', 1}},    {"uchar", {'U', 1}},  {"uint8", {'U', 1}},
      {"short", {'I', 2}}, {"int16", {'I', 2}},   {"ushort", {'U', 2}}, {"uint16", {'U', 2}},
      {"int", {'I', 4}},   {"int32", {'I', 4}},   {"uint", {'U', 4}},   {"uint32", {'U', 4}},
      {"float", {'F', 4}}, {"float32", {'F', 4}}, {"double", {'F', 8}}, {"float64", {'F', 8}},
  };
  for (const Name& known : kNames)
    if (name == known.name) return known.type;
  return std::nullopt;
}

class HeaderReader {
 public:
  HeaderReader(const std::string& path, LineReader& lines) : path_(path), lines_(lines) {}

  PlyHeader read() {
    PlyHeader header;
    std::string_view line;
    if (!lines_.next(line) || takeWord(line) != "ply") fail("is no PLY file");
    while (lines_.next(line)) {
      if (lines_.number() > kMaxHeaderLines) fail("has no end of its header");
      const std::vector<std::string_view> words = splitWords(line);
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") {
        header.data_position = lines_.position();
        finish(header);
        return header;
      }
      if (words[0] == "format") {
        readFormat(words, header);
      } else if (words[0] == "element") {
        readElement(words, header);
      } else if (words[0] == "property") {
        readProperty(words, header);
      } else {
        failAtLine(quoted(words[0]) + " does not belong into the header of a PLY file");
      }
    }
    fail("ends before end_header: cut short");
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const { throw IoError(path_, problem); }
  [[noreturn]] void failAtLine(const std::string& problem) const {
    fail("line " + std::to_string(lines_.number()) + ": " + problem);
  }

  void readFormat(const std::vector<std::string_view>& words, PlyHeader& header) const {
    if (words.size() != 3 || words[2] != "1.0" ||
        (words[1] != "ascii" && words[1] != "binary_little_endian" &&
         words[1] != "binary_big_endian"))
      failAtLine("format must be ascii, binary_little_endian or binary_big_endian, version 1.0");
    header.encoding = words[1] == "binary_little_endian" ? "binary" : std::string(words[1]);
  }

  void readElement(const std::vector<std::string_view>& words, PlyHeader& header) const {
    Element element;
    if (words.size() != 3 || !parseNumber(words[2], element.count))
      failAtLine("an element needs a name and a number");
    element.name = std::string(words[1]);
    header.elements.push_back(element);
  }

  void readProperty(const std::vector<std::string_view>& words, PlyHeader& header) const {
    if (header.elements.empty()) failAtLine("a property without an element");
    Property property;
    property.is_list = words.size() == 5 && words[1] == "list";
    if (!property.is_list && words.size() != 3) failAtLine("a property needs a type and a name");
    const std::optional<ScalarType> type = scalarType(words[words.size() - 2]);
    const std::optional<ScalarType> count_type =
        property.is_list ? scalarType(words[2]) : std::optional(ScalarType{'U', 1});
    if (!type || !count_type) failAtLine("unknown type of a property");
    if (count_type->isFloat()) failAtLine("the length of a list must be of an integer type");
    property.field.name = std::string(words.back());
    property.field.type = *type;
    property.count_type = *count_type;
    header.elements.back().properties.push_back(property);
  }

  void finish(PlyHeader& header) const {
    if (header.encoding.empty()) fail("has no format line");
    const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                     [](const Element& e) { return e.name == "vertex"; });
    if (vertex == header.elements.end()) fail("has no element 'vertex'");
    if (vertex->hasList()) fail("has lists among the properties of its vertices");
    header.vertex = static_cast<std::size_t>(vertex - header.elements.begin());
  }

  const std::string& path_;
  LineReader& lines_;
};

std::vector<CloudField> vertexFields(const std::string& path, const PlyHeader& header) {
  std::vector<CloudField> fields;
  for (const Property& property : header.elements[header.vertex].properties)
    fields.push_back(property.field);
  placeFields(path, fields);
  return fields;
}

/// Binary elements in front of the vertices.
void skipElement(const Element& element, InputFile& file, bool big_endian) {
  const auto advance = [&file](std::uint64_t bytes) {
    if (bytes > file.size() - file.position()) throw IoError(file.path(), "is cut short");
    file.seek(file.position() + bytes);
  };
  if (!element.hasList()) {
    std::uint64_t record = 0;
    for (const Property& property : element.properties) record += property.field.type.size;
    if (record > 0 && element.count > file.size() / record)
      throw IoError(file.path(), "is cut short");
    advance(element.count * record);
    return;
  }
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      std::uint64_t values = 1;
      if (property.is_list) {
        std::uint8_t bytes[8];
        file.readExactly(bytes, property.count_type.size);
        values = loadBits(bytes, property.count_type.size, big_endian);
        if (values > file.size()) throw IoError(file.path(), "is cut short");
      }
      advance(values * property.field.type.size);
    }
  }
}

}  // namespace

CloudData readPly(const std::string& path, const CloudChannels& channels) {
  InputFile file(path);
  LineReader lines(file, kLongestHeaderLine);
  const PlyHeader header = HeaderReader(path, lines).read();
  const CloudFiller filler(path, vertexFields(path, header), channels);
  const std::uint64_t count = header.elements[header.vertex].count;

  CloudData cloud;
  if (header.encoding == "ascii") {
    lines.setLongestLine(kLongestDataLine);
    std::string_view line;
    for (std::size_t e = 0; e < header.vertex; ++e)
      for (std::uint64_t i = 0; i < header.elements[e].count; ++i)
        if (!lines.next(line)) throw IoError(path, "is cut short");
    filler.allocate(cloud, count, 1, file.size() - lines.position(), true);
    filler.fillLines(cloud, lines);
    return cloud;
  }
  const bool big_endian = header.encoding == "binary_big_endian";
  file.seek(header.data_position);
  for (std::size_t e = 0; e < header.vertex; ++e) skipElement(header.elements[e], file, big_endian);
  filler.allocate(cloud, count, 1, file.size() - file.position(), false);
  filler.fillFromFile(cloud, file, big_endian);
  return cloud;
}

CloudFileInfo readPlyInfo(const std::string& path) {
  InputFile file(path);
  LineReader lines(file, kLongestHeaderLine);
  const PlyHeader header = HeaderReader(path, lines).read();
  CloudFileInfo info;
  info.format = CloudFormat::Ply;
  info.encoding = header.encoding;
  const std::vector<CloudField> fields = vertexFields(path, header);
  for (const CloudField& field : fields) info.fields.push_back(field.name);
  const std::uint64_t count = header.elements[header.vertex].count;
  CloudFiller(path, fields, CloudChannels::none())
      .checkSize(count, 1, file.size() - header.data_position, header.encoding == "ascii");
  info.width = static_cast<std::uint32_t>(count);
  info.height = 1;
  return info;
}

}  // namespace planar_mapping::io
