#include <hooke/vdb/volume_file.hpp>

#include <hooke/error.hpp>
#include <hooke/vdb/grids.hpp>

#include <openvdb/io/Stream.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace hooke::vdb {

namespace {

// The grids of a file. The stream is ours: OpenVDB's File goes on at the end of a file that was cut off, with
// whatever numbers are in memory.
class Source {
 public:
  explicit Source(const std::filesystem::path& path) : path_(path) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) throw Error(path.string() + ": is a folder, not a file");
    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw Error(path.string() + ": cannot open: " + std::strerror(errno));
    char magic[4] = {};
    stream.read(magic, sizeof magic);
    if (std::memcmp(magic, " BDV", 4) != 0) throw Error(path.string() + ": is not an OpenVDB file");
    openvdb::initialize();
    guarded([&] {
      stream.seekg(0);
      stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
      grids_ = *openvdb::io::Stream(stream, /*delayLoad=*/false).getGrids();
    });
  }

  template <class Grid>
  typename Grid::Ptr read(const std::string& wanted, const char* kind) {
    std::vector<std::string> names;
    for (const auto& grid : grids_) {
      names.push_back(grid->getName());
      if (!wanted.empty() ? grid->getName() != wanted : !grid->isType<Grid>()) continue;
      name_ = grid->getName();
      if (!grid->isType<Grid>()) fail(std::string("must be ") + kind + ", got values of the type " + grid->valueType());
      const auto out = openvdb::gridPtrCast<Grid>(grid);
      check_transform(*out);
      return out;
    }
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
    throw Error(path_.string() + ": has no grid " +
                (wanted.empty() ? std::string("that is ") + kind : "\"" + wanted + "\"") +
                "; there are: " + (list.empty() ? "none" : list));
  }

  [[noreturn]] void fail(const std::string& rule) const {
    throw Error(path_.string() + (name_.empty() ? "" : ": grid \"" + name_ + "\"") + ": " + rule);
  }

  template <class Work>
  void guarded(const Work& work) const {
    try {
      work();
    } catch (const Error&) {
      throw;
    } catch (const std::exception& error) {
      fail(std::string("damaged or cut off: ") + error.what());
    }
  }

 private:
  void check_transform(const openvdb::GridBase& grid) const {
    const openvdb::math::Transform& transform = grid.transform();
    bool good = transform.isLinear();
    if (good) {
      const openvdb::Mat4R m = transform.baseMap()->getAffineMap()->getMat4();
      const double voxel = m(0, 0);
      good = voxel > 0 && std::isfinite(voxel);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) good = good && std::abs(m(i, j) - (i == j ? voxel : 0)) <= 1e-6 * voxel;
      for (int j = 0; j < 3; ++j) good = good && std::isfinite(m(3, j));
    }
    if (!good) fail("voxels must be cubes along the axes");
  }

  std::filesystem::path path_;
  openvdb::GridPtrVec grids_;
  std::string name_;
};

}  // namespace

std::shared_ptr<const DistanceGrid> read_level_set(const std::filesystem::path& path, const std::string& grid) {
  Source source(path);
  const auto level_set = source.read<openvdb::FloatGrid>(grid, "a level set of floats");
  if (level_set->getGridClass() == openvdb::GRID_FOG_VOLUME) source.fail("must be a level set, got a fog volume");
  if (!(level_set->background() > 0) || !std::isfinite(level_set->background()))
    source.fail("must be a level set: its background must be positive, got " + std::to_string(level_set->background()));
  try {
    return std::make_shared<const DistanceGrid>(densify(*level_set, 2, "a level set"));
  } catch (const std::invalid_argument& error) {
    source.fail(error.what());
  }
}

void write_level_set(const std::filesystem::path& path, const DistanceGrid& distances, const std::string& grid) {
  const auto out = narrow_band(distances);
  out->setName(grid);
  write_grids(path, {out});
}

VelocityGrid read_velocity_field(const std::filesystem::path& path, const std::string& grid) {
  Source source(path);
  const auto field = source.read<openvdb::Vec3SGrid>(grid, "a grid of float vectors");
  openvdb::CoordBBox box = field->evalActiveVoxelBoundingBox();
  if (box.empty()) source.fail("has no active voxels");
  box.expand(1);
  try {
    std::vector<VelocityGrid::Sample> values;
    values.reserve(count_voxels(box, "a velocity field"));
    const bool staggered = field->getGridClass() == openvdb::GRID_STAGGERED;
    const float scale = field->isInWorldSpace() ? 1.0f : float(field->voxelSize()[0]);
    auto accessor = field->getConstAccessor();
    for (int z = box.min().z(); z <= box.max().z(); ++z)
      for (int y = box.min().y(); y <= box.max().y(); ++y)
        for (int x = box.min().x(); x <= box.max().x(); ++x) {
          openvdb::Vec3s v = accessor.getValue({x, y, z});
          if (staggered)
            v = 0.5f * (v + openvdb::Vec3s(accessor.getValue({x + 1, y, z}).x(), accessor.getValue({x, y + 1, z}).y(),
                                           accessor.getValue({x, y, z + 1}).z()));
          values.emplace_back(scale * v.x(), scale * v.y(), scale * v.z());
        }
    const auto dim = box.dim();
    const openvdb::Vec3d lower = field->indexToWorld(box.min());
    return VelocityGrid({lower.x(), lower.y(), lower.z()}, field->voxelSize()[0], {dim.x(), dim.y(), dim.z()},
                        std::move(values));
  } catch (const std::invalid_argument& error) {
    source.fail(error.what());
  }
}

}  // namespace hooke::vdb
