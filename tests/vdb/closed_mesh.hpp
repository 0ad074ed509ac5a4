// What a closed, outward oriented triangle mesh must fulfil; used by tests of skins.
#pragma once

#include <hooke/types.hpp>

#include <Eigen/Geometry>

#include <map>
#include <utility>
#include <vector>

namespace hooke::test {

/// Number of edges that are not in exactly two triangles with opposite directions.
inline int open_edges(const std::vector<Triangle>& triangles) {
  std::map<std::pair<int, int>, int> directed;
  for (const Triangle& t : triangles)
    for (std::size_t e = 0; e < 3; ++e) ++directed[{t[e], t[(e + 1) % 3]}];
  int open = 0;
  for (const auto& [edge, count] : directed) {
    const auto back = directed.find({edge.second, edge.first});
    if (count != 1 || back == directed.end() || back->second != 1) ++open;
  }
  return open;
}

/// [m³], positive when triangles are counter-clockwise from outside.
inline double volume(const Points<double>& vertices, const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const Triangle& t : triangles) {
    const Vec3 a = vertices.row(t[0]).matrix();
    const Vec3 b = vertices.row(t[1]).matrix();
    const Vec3 c = vertices.row(t[2]).matrix();
    sum += a.dot(b.cross(c)) / 6;
  }
  return sum;
}

}  // namespace hooke::test
