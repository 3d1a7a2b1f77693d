// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <optional>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/cloud_layout.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {
namespace {

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
  HeaderReader(const std::string& path, LineReader& lines) : path_(path), lines_(lines) {
    std::string_view line;
    if (!lines_.next(line) || takeWord(line) != "ply") fail("is no PLY file");
    while (lines_.next(line)) {
      if (lines_.number() > kMaxHeaderLines) fail("has no end of its header");
      const Words words = splitWords(line);
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") {
        finish();
        return;
      }
      if (words[0] == "format") {
        readFormat(words);
      } else if (words[0] == "element") {
        readElement(words);
      } else if (words[0] == "property") {
        readProperty(words);
      } else {
        failAtLine(quoted(words[0]) + " does not belong into the header of a PLY file");
      }
    }
    fail("ends before end_header: cut short");
  }

  std::string encoding;
  std::vector<Element> elements;
  std::size_t vertex = 0;  ///< index of the vertex element

 private:
  [[noreturn]] void fail(const std::string& problem) const { throw IoError(path_, problem); }
  [[noreturn]] void failAtLine(const std::string& problem) const {
    io::failAtLine(path_, lines_.number(), problem);
  }

  void readFormat(const Words& words) {
    if (words.size() != 3 || words[2] != "1.0" ||
        (words[1] != "ascii" && words[1] != "binary_little_endian" &&
         words[1] != "binary_big_endian"))
      failAtLine("format must be ascii, binary_little_endian or binary_big_endian, version 1.0");
    encoding = words[1] == "binary_little_endian" ? "binary" : std::string(words[1]);
  }

  void readElement(const Words& words) {
    Element element;
    if (words.size() != 3 || !parseNumber(words[2], element.count))
      failAtLine("an element needs a name and a number");
    element.name = std::string(words[1]);
    elements.push_back(element);
  }

  void readProperty(const Words& words) {
    if (elements.empty()) failAtLine("a property without an element");
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
    elements.back().properties.push_back(property);
  }

  void finish() {
    if (encoding.empty()) fail("has no format line");
    const auto found = std::find_if(elements.begin(), elements.end(),
                                    [](const Element& e) { return e.name == "vertex"; });
    if (found == elements.end()) fail("has no element 'vertex'");
    if (found->hasList()) fail("has lists among the properties of its vertices");
    vertex = static_cast<std::size_t>(found - elements.begin());
  }

  const std::string& path_;
  LineReader& lines_;
};

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

CloudHeader readPlyHeader(InputFile& file, LineReader& lines) {
  const HeaderReader reader(file.path(), lines);
  CloudHeader header;
  header.format = CloudFormat::Ply;
  header.encoding = reader.encoding;
  header.width = reader.elements[reader.vertex].count;
  for (const Property& property : reader.elements[reader.vertex].properties)
    header.fields.push_back(property.field);
  if (header.isAscii()) {
    lines.setLongestLine(kLongestDataLine);
    std::string_view line;
    for (std::size_t e = 0; e < reader.vertex; ++e)
      for (std::uint64_t i = 0; i < reader.elements[e].count; ++i)
        if (!lines.next(line)) throw IoError(file.path(), "is cut short");
    header.data_position = lines.position();
  } else {
    file.seek(lines.position());
    for (std::size_t e = 0; e < reader.vertex; ++e)
      skipElement(reader.elements[e], file, header.encoding == "binary_big_endian");
    header.data_position = file.position();
  }
  return header;
}

}  // namespace planar_mapping::io
