#include <hooke/io/mesh_cache.hpp>

#include <hooke/error.hpp>
#include <hooke/io/bytes.hpp>
#include <hooke/io/output_file.hpp>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

namespace hooke::io {

namespace {

class Sequence final : public MeshCache {
 public:
  using Writer = void (*)(const std::filesystem::path&, const Points<double>&, const std::vector<Triangle>&);
  Sequence(const std::filesystem::path& folder, std::string_view name, std::string extension, Writer writer,
           std::vector<Triangle> triangles)
      : folder_(folder),
        name_(name),
        extension_(std::move(extension)),
        writer_(writer),
        triangles_(std::move(triangles)) {}

  void add(const Points<double>& vertices) override {
    if (count_ == 0) size_ = vertices.rows();
    if (vertices.rows() != size_) throw std::invalid_argument("MeshCache: the number of vertices has changed");
    std::string number = std::to_string(count_);
    number.insert(0, number.size() < 4 ? 4 - number.size() : 0, '0');
    writer_(folder_ / (name_ + "." + number + extension_), vertices, triangles_);
    ++count_;
  }
  void resume(Index count, Index size) override { count_ = count, size_ = size; }
  void sync() override {}
  void finish() override {}

 private:
  std::filesystem::path folder_;
  std::string name_, extension_;
  Writer writer_;
  std::vector<Triangle> triangles_;
  Index size_ = 0, count_ = 0;
};

// Header: "POINTCACHE2\0", version 1, points, start frame, sample rate, samples; then x y z of
// every point, sample after sample.
class PointCache final : public MeshCache {
 public:
  static constexpr std::int64_t kCountAt = 28, kHeader = 32, kPoint = 12;  // bytes

  PointCache(const std::filesystem::path& folder, std::string_view name, std::vector<Triangle> triangles)
      : path_(folder / (std::string(name) + ".pc2")),
        mesh_path_(folder / (std::string(name) + ".obj")),
        triangles_(std::move(triangles)) {}

  void add(const Points<double>& vertices) override {
    if (!file_) begin(vertices);
    if (vertices.rows() != size_) throw std::invalid_argument("MeshCache: the number of vertices has changed");
    Bytes sample, count;
    sample.add(vertices);
    file_->write_bytes(sample);
    file_->flush();
    count.add(std::uint32_t(++count_));
    file_->rewrite(kCountAt, count);
    file_->flush();
  }
  void resume(Index count, Index size) override {
    if (count == 0) return;
    size_ = size;
    count_ = std::uint32_t(count);
    file_.emplace(path_, OutputFile::Leftover::Keep, kHeader + count * size * kPoint);
    Bytes bytes;
    bytes.add(count_);
    file_->rewrite(kCountAt, bytes);
  }
  void sync() override {
    if (file_) file_->sync();
  }
  void finish() override {
    if (file_) file_->commit();
    file_.reset();
  }

 private:
  void begin(const Points<double>& vertices) {
    write_obj(mesh_path_, vertices, triangles_);
    size_ = vertices.rows();
    Bytes header;
    header.add(std::string_view("POINTCACHE2\0", 12));
    header.add(std::uint32_t(1));
    header.add(std::uint32_t(size_));
    header.add(0.0f);
    header.add(1.0f);
    header.add(std::uint32_t(0));
    file_.emplace(path_, OutputFile::Leftover::Keep);
    file_->write_bytes(header);
  }

  std::filesystem::path path_, mesh_path_;
  std::vector<Triangle> triangles_;
  std::optional<OutputFile> file_;
  Index size_ = 0;
  std::uint32_t count_ = 0;
};

}  // namespace

void write_obj(const std::filesystem::path& path, const Points<double>& vertices,
               const std::vector<Triangle>& triangles) {
  OutputFile file(path);
  for (Index i = 0; i < vertices.rows(); ++i) {
    file.write("v");
    for (int k = 0; k < 3; ++k) {
      file.write(" ");
      file.write(vertices(i, k));
    }
    file.write("\n");
  }
  for (const Triangle& t : triangles)
    file.write("f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) +
               "\n");
  file.commit();
}

void write_ply(const std::filesystem::path& path, const Points<double>& vertices,
               const std::vector<Triangle>& triangles) {
  Bytes bytes;
  bytes.add("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices.rows()) +
            "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(triangles.size()) +
            "\nproperty list uchar int vertex_indices\nend_header\n");
  bytes.add(vertices);
  for (const Triangle& triangle : triangles) {
    bytes.add(std::uint8_t(3));
    for (const int corner : triangle) bytes.add(std::uint32_t(corner));
  }
  OutputFile file(path);
  file.write_bytes(bytes);
  file.commit();
}

CacheFormat cache_format_named(std::string_view name) {
  if (name == "obj") return CacheFormat::Obj;
  if (name == "ply") return CacheFormat::Ply;
  if (name == "pc2") return CacheFormat::Pc2;
  throw Error("there is no cache format \"" + std::string(name) + "\"; there are obj, ply, pc2");
}

std::unique_ptr<MeshCache> make_mesh_cache(CacheFormat format, const std::filesystem::path& folder,
                                           std::string_view name, std::vector<Triangle> triangles) {
  switch (format) {
    case CacheFormat::Obj:
      return std::make_unique<Sequence>(folder, name, ".obj", write_obj, std::move(triangles));
    case CacheFormat::Ply:
      return std::make_unique<Sequence>(folder, name, ".ply", write_ply, std::move(triangles));
    case CacheFormat::Pc2:
      return std::make_unique<PointCache>(folder, name, std::move(triangles));
  }
  throw std::invalid_argument("make_mesh_cache: no such format");
}

}  // namespace hooke::io
