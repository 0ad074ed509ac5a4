#include <hooke/io/mesh_file.hpp>

#include <hooke/error.hpp>

#include <tiny_obj_loader.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace hooke::io {

namespace {

constexpr std::size_t kLargestFile = std::size_t(1) << 30;

std::string read_text(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw Error(path.string() + ": is a folder, not a file");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(path.string() + ": cannot open: " + std::strerror(errno));
  std::ostringstream text;
  text << file.rdbuf();
  if (file.bad()) throw Error(path.string() + ": cannot read: " + std::strerror(errno));
  if (text.view().size() > kLargestFile) throw Error(path.string() + ": larger than 1 GiB");
  return std::move(text).str();
}

bool blank(char c) { return c == ' ' || c == '\t'; }

std::string_view next_word(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && blank(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !blank(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

// What the loader passes over silently: numbers that are none, short lines, indices out of range.
class Check {
 public:
  Check(const std::filesystem::path& path, std::string_view text) : path_(path), text_(text) {}

  /// Returns the coordinates of all vertices, correctly rounded, which the loader's are not.
  std::vector<double> run() {
    if (text_.find('\0') != std::string_view::npos)
      throw Error(path_.string() + ": not an OBJ file: it has bytes of 0");
    std::string_view rest = text_;
    while (!rest.empty()) {
      ++line_;
      const std::size_t end = rest.find('\n');
      std::string_view line = rest.substr(0, end);
      rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      if (!line.empty() && line.back() == '\\') fail("lines that go on with a backslash are not understood");
      const std::string_view key = next_word(line);
      if (key == "v") vertex(line);
      if (key == "f") face(line);
    }
    if (count() == 0) throw Error(path_.string() + ": not an OBJ file, or one without vertices (lines \"v x y z\")");
    if (faces_ == 0) throw Error(path_.string() + ": has no faces (lines \"f a b c\")");
    return std::move(coordinates_);
  }

 private:
  [[noreturn]] void fail(const std::string& rule) const {
    throw Error(path_.string() + ": line " + std::to_string(line_) + ": " + rule);
  }

  void vertex(std::string_view line) {
    for (int k = 0; k < 3; ++k) {
      std::string_view word = next_word(line);
      if (word.empty()) fail("a vertex needs three coordinates, got " + std::to_string(k) + "; is the file cut off?");
      if (word.front() == '+') word.remove_prefix(1);
      double value = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
        fail("a coordinate must be a finite number, got \"" + std::string(word.substr(0, 40)) + "\"");
      coordinates_.push_back(value);
    }
  }

  void face(std::string_view line) {
    int corners = 0;
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line), ++corners) {
      Index index = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
      if (error != std::errc() || (end != word.data() + word.size() && *end != '/'))
        fail("a corner of a face must be a vertex index, got \"" + std::string(word.substr(0, 40)) + "\"");
      const Index vertex = index < 0 ? count() + index + 1 : index;
      if (vertex < 1 || vertex > count())
        fail("vertex index " + std::to_string(index) + " is not one of the " + std::to_string(count()) +
             " vertices before it");
    }
    if (corners < 3)
      fail("a face needs at least three corners, got " + std::to_string(corners) + "; is the file cut off?");
    ++faces_;
  }

  Index count() const { return Index(coordinates_.size() / 3); }

  const std::filesystem::path& path_;
  std::string_view text_;
  std::vector<double> coordinates_;
  Index line_ = 0, faces_ = 0;
};

}  // namespace

TriangleMesh read_obj(const std::filesystem::path& path) {
  const std::string text = read_text(path);
  const std::vector<double> coordinates = Check(path, text).run();
  const Index count = Index(coordinates.size() / 3);

  tinyobj::attrib_t attributes;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warning, error;
  std::istringstream stream(text);
  if (!tinyobj::LoadObj(&attributes, &shapes, &materials, &warning, &error, &stream))
    throw Error(path.string() + ": " + (error.empty() ? "not an OBJ file" : error.substr(0, error.find('\n'))));
  if (Index(attributes.vertices.size()) != 3 * count)
    throw Error(path.string() + ": " + std::to_string(attributes.vertices.size() / 3) +
                " vertices were understood of " + std::to_string(count));

  TriangleMesh mesh;
  mesh.vertices.resize(count, 3);
  for (Index i = 0; i < count; ++i)
    for (int k = 0; k < 3; ++k) mesh.vertices(i, k) = coordinates[std::size_t(3 * i + k)];
  for (const tinyobj::shape_t& shape : shapes)
    for (std::size_t i = 0; i + 2 < shape.mesh.indices.size(); i += 3) {
      Triangle triangle{};
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[k] = shape.mesh.indices[i + k].vertex_index;
        if (triangle[k] < 0 || triangle[k] >= count)
          throw Error(path.string() + ": a face uses vertex " + std::to_string(triangle[k]) + " of " +
                      std::to_string(count));
      }
      mesh.triangles.push_back(triangle);
    }
  if (mesh.triangles.empty()) throw Error(path.string() + ": has no faces that are triangles or polygons");
  return mesh;
}

}  // namespace hooke::io
