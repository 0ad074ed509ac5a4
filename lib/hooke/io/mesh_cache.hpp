// A moving mesh as files that other programs play: one sample a frame, the triangles always
// the same.
#pragma once

#include <hooke/types.hpp>

#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

namespace hooke::io {

/// Grows by one sample a frame. Wherever a run is cut off, what was added can be read.
class MeshCache {
 public:
  virtual ~MeshCache() = default;
  /// @param vertices [m], shape (n, 3), n as in the first call, else std::invalid_argument
  /// @throws hooke::OutputError
  virtual void add(const Points<double>& vertices) = 0;
  /// Goes on after the first `count` samples of `size` vertices that an earlier run added; to be called first.
  /// @throws hooke::Error where they are not there
  virtual void resume(Index count, Index size) = 0;
  /// Has everything added so far written to the disk.
  virtual void sync() = 0;
  /// Completes the files. add() must not be called any more.
  virtual void finish() = 0;
};

enum class CacheFormat {
  Obj,  ///< NAME.0000.obj, NAME.0001.obj, …: text
  Ply,  ///< NAME.0000.ply, NAME.0001.ply, …: binary little-endian, float
  Pc2   ///< NAME.pc2, points of all samples as float, beside NAME.obj, the first sample with its triangles
};

/// "obj", "ply" or "pc2". Throws hooke::Error that lists them.
CacheFormat cache_format_named(std::string_view name);

/// A cache in `folder` whose files begin with `name`. Triangles may be empty: points only.
std::unique_ptr<MeshCache> make_mesh_cache(CacheFormat format, const std::filesystem::path& folder,
                                           std::string_view name, std::vector<Triangle> triangles);

/// One mesh as an OBJ or binary PLY file. Throws hooke::OutputError.
void write_obj(const std::filesystem::path& path, const Points<double>& vertices,
               const std::vector<Triangle>& triangles);
void write_ply(const std::filesystem::path& path, const Points<double>& vertices,
               const std::vector<Triangle>& triangles);

}  // namespace hooke::io
