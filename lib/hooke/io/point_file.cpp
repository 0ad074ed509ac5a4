#include <hooke/io/point_file.hpp>

#include <hooke/io/bytes.hpp>
#include <hooke/io/output_file.hpp>

#include <stdexcept>
#include <string>

namespace hooke::io {

namespace {

void check(const char* name, const PointTable& points) {
  const Index n = points.positions.rows();
  const auto fits = [&](Index count, const char* column) {
    if (count != 0 && count != n)
      throw std::invalid_argument(std::string(name) + ": " + column + " must be one a point, " + std::to_string(n) +
                                  ", or none, got " + std::to_string(count));
  };
  fits(points.velocities.rows(), "velocities");
  fits(Index(points.ids.size()), "ids");
  fits(points.ages.size(), "ages");
  fits(points.radii.size(), "radii");
}

}  // namespace

void write_ply_points(const std::filesystem::path& path, const PointTable& points) {
  check("write_ply_points", points);
  const bool moving = points.velocities.rows() > 0, named = !points.ids.empty();
  const bool aged = points.ages.size() > 0, sized = points.radii.size() > 0;
  Bytes bytes;
  bytes.add("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.positions.rows()) +
            "\nproperty float x\nproperty float y\nproperty float z\n" +
            (moving ? "property float vx\nproperty float vy\nproperty float vz\n" : "") +
            (named ? "property uint id\n" : "") + (aged ? "property float age\n" : "") +
            (sized ? "property float radius\n" : "") + "end_header\n");
  for (Index i = 0; i < points.positions.rows(); ++i) {
    for (int k = 0; k < 3; ++k) bytes.add(float(points.positions(i, k)));
    for (int k = 0; moving && k < 3; ++k) bytes.add(float(points.velocities(i, k)));
    if (named) bytes.add(points.ids[std::size_t(i)]);
    if (aged) bytes.add(float(points.ages[i]));
    if (sized) bytes.add(float(points.radii[i]));
  }
  OutputFile file(path);
  file.write_bytes(bytes);
  file.commit();
}

void write_csv_points(const std::filesystem::path& path, const PointTable& points) {
  check("write_csv_points", points);
  const bool moving = points.velocities.rows() > 0, named = !points.ids.empty();
  const bool aged = points.ages.size() > 0, sized = points.radii.size() > 0;
  OutputFile file(path);
  file.write(std::string("index,x,y,z") + (moving ? ",vx,vy,vz" : "") + (named ? ",id" : "") + (aged ? ",age" : "") +
             (sized ? ",radius" : "") + "\n");
  for (Index i = 0; i < points.positions.rows(); ++i) {
    std::string line = std::to_string(i);
    for (int k = 0; k < 3; ++k) line += "," + text_of(points.positions(i, k));
    for (int k = 0; moving && k < 3; ++k) line += "," + text_of(points.velocities(i, k));
    if (named) line += "," + std::to_string(points.ids[std::size_t(i)]);
    if (aged) line += "," + text_of(points.ages[i]);
    if (sized) line += "," + text_of(points.radii[i]);
    file.write(line + "\n");
  }
  file.commit();
}

std::filesystem::path frame_name(const std::filesystem::path& folder, std::string_view name, std::int64_t frame,
                                 std::string_view extension) {
  std::string number = std::to_string(frame);
  number.insert(0, number.size() < 4 ? 4 - number.size() : 0, '0');
  return folder / (std::string(name) + "." + number + std::string(extension));
}

}  // namespace hooke::io
