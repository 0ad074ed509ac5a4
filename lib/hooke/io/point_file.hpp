// Points without triangles, one file a frame: particles for other programs.
#pragma once

#include <hooke/types.hpp>

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace hooke::io {

/// Points and what is known of each. Columns other than positions may be empty: they are left out.
struct PointTable {
  Points<double> positions{0, 3};   ///< [m]
  Points<double> velocities{0, 3};  ///< [m/s]
  std::vector<std::uint32_t> ids;
  Values<double> ages;   ///< [s]
  Values<double> radii;  ///< [m]
};

/// Binary little-endian PLY: vertices with x y z, vx vy vz, id (uint), age, radius as float.
/// @throws std::invalid_argument where a column has another length; hooke::OutputError
void write_ply_points(const std::filesystem::path& path, const PointTable& points);

/// CSV: index,x,y,z and of vx,vy,vz,id,age,radius what is given, with 17 significant digits.
/// @throws std::invalid_argument where a column has another length; hooke::OutputError
void write_csv_points(const std::filesystem::path& path, const PointTable& points);

/// FOLDER/NAME.0012EXTENSION, the name of a frame's file.
std::filesystem::path frame_name(const std::filesystem::path& folder, std::string_view name, std::int64_t frame,
                                 std::string_view extension);

}  // namespace hooke::io
