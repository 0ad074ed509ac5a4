#include <hooke/softbody/cloth.hpp>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

namespace hooke::softbody {

namespace {

void check(const ClothMaterial& m) {
  const auto require = [](bool holds, const char* name, const char* rule, double value) {
    if (!holds || !std::isfinite(value))
      throw std::invalid_argument(std::string("cloth material: ") + name + " must " + rule + ", got " +
                                  std::to_string(value));
  };
  require(m.density > 0, "density", "be positive", m.density);
  require(m.stretch >= 0, "stretch", "not be negative", m.stretch);
  require(m.shear >= 0, "shear", "not be negative", m.shear);
  require(m.bend >= 0, "bend", "not be negative", m.bend);
  require(m.damping_ratio.stretch >= 0, "damping_ratio.stretch", "not be negative", m.damping_ratio.stretch);
  require(m.damping_ratio.shear >= 0, "damping_ratio.shear", "not be negative", m.damping_ratio.shear);
  require(m.damping_ratio.bend >= 0, "damping_ratio.bend", "not be negative", m.damping_ratio.bend);
}

// Adds springs with the damping of their family.
class Weaver {
 public:
  Weaver(const ClothMaterial& material, const Values<double>& masses) : material_(material), masses_(masses) {}

  void join(int a, int b, double stiffness, Family family) {
    if (stiffness <= 0) return;
    const DampingRatios& ratios = material_.damping_ratio;
    const double ratio = family == Family::Stretch ? ratios.stretch
                         : family == Family::Shear ? ratios.shear
                                                   : ratios.bend;
    network_.springs.push_back(
        {a, b, stiffness, damping_of_ratio(ratio, stiffness, masses_[a], masses_[b]), Spring::kFromStart, family});
  }
  std::shared_ptr<const SpringNetwork> finish() { return std::make_shared<const SpringNetwork>(std::move(network_)); }

 private:
  const ClothMaterial& material_;
  const Values<double>& masses_;
  SpringNetwork network_;
};

}  // namespace

Cloth cloth_from_grid(double width, double height, int columns, int rows, const Vec3& right, const Vec3& down,
                      const ClothMaterial& material) {
  check(material);
  if (!(width > 0 && height > 0) || !std::isfinite(width) || !std::isfinite(height))
    throw std::invalid_argument("cloth: size must be positive, got " + std::to_string(width) + " x " +
                                std::to_string(height) + " m");
  if (columns < 2 || rows < 2)
    throw std::invalid_argument("cloth: a grid needs at least 2 x 2 points, got " + std::to_string(columns) + " x " +
                                std::to_string(rows));
  if (!right.allFinite() || !down.allFinite() || !(right.normalized().cross(down.normalized()).norm() > 1e-6))
    throw std::invalid_argument("cloth: right and down must be two different directions");
  const double dx = width / (columns - 1), dy = height / (rows - 1);
  const Vec3 r = right.normalized(), d = down.normalized();

  Cloth cloth;
  cloth.positions.resize(Index(rows) * columns, 3);
  cloth.masses.resize(Index(rows) * columns);
  const auto index = [&](int row, int column) { return row * columns + column; };
  const auto share = [](int i, int count) { return i == 0 || i == count - 1 ? 0.5 : 1.0; };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Vec3 x = (double(column) / (columns - 1) - 0.5) * width * r + double(row) / (rows - 1) * height * d;
      cloth.positions.row(index(row, column)) = x.transpose().array();
      cloth.masses[index(row, column)] = material.density * dx * dy * share(row, rows) * share(column, columns);
    }

  Weaver weaver(material, cloth.masses);
  const double diagonal = (dx * dx + dy * dy) / (2 * dx * dy);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int here = index(row, column);
      const bool has_right = column + 1 < columns, has_down = row + 1 < rows;
      if (has_right)
        weaver.join(here, index(row, column + 1), material.stretch * dy / dx * share(row, rows), Family::Stretch);
      if (has_down)
        weaver.join(here, index(row + 1, column), material.stretch * dx / dy * share(column, columns), Family::Stretch);
      if (has_right && has_down) {
        weaver.join(here, index(row + 1, column + 1), material.shear * diagonal, Family::Shear);
        weaver.join(index(row, column + 1), index(row + 1, column), material.shear * diagonal, Family::Shear);
        cloth.triangles.push_back({here, index(row + 1, column), index(row, column + 1)});
        cloth.triangles.push_back({index(row, column + 1), index(row + 1, column), index(row + 1, column + 1)});
      }
      if (column + 2 < columns)
        weaver.join(here, index(row, column + 2), material.bend * dy / (2 * dx) * share(row, rows), Family::Bend);
      if (row + 2 < rows)
        weaver.join(here, index(row + 2, column), material.bend * dx / (2 * dy) * share(column, columns), Family::Bend);
    }
  cloth.network = weaver.finish();
  return cloth;
}

Cloth cloth_from_mesh(const TriangleMesh& mesh, const ClothMaterial& material) {
  check(material);
  struct Edge {
    std::vector<int> triangles;
  };
  const Index n = mesh.vertices.rows();
  if (!mesh.vertices.allFinite()) throw std::invalid_argument("cloth: mesh vertices must be finite");
  Cloth cloth;
  cloth.positions = mesh.vertices;
  cloth.triangles = mesh.triangles;
  cloth.masses = Values<double>::Zero(n);
  const auto at = [&](int i) -> Vec3 { return mesh.vertices.row(i).matrix().transpose(); };
  const auto length2 = [&](int a, int b) { return (at(b) - at(a)).squaredNorm(); };

  std::vector<double> area;
  std::map<std::pair<int, int>, Edge> edges;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    for (const int corner : t)
      if (corner < 0 || corner >= n)
        throw std::invalid_argument("cloth: triangle " + std::to_string(i) + " uses vertex " + std::to_string(corner) +
                                    " of " + std::to_string(n));
    area.push_back(0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).norm());
    if (!(area.back() > 0)) throw std::invalid_argument("cloth: triangle " + std::to_string(i) + " has no area");
    for (int c = 0; c < 3; ++c) {
      cloth.masses[t[std::size_t(c)]] += material.density * area.back() / 3;
      const int a = t[std::size_t(c)], b = t[std::size_t((c + 1) % 3)];
      edges[std::minmax(a, b)].triangles.push_back(int(i));
    }
  }
  for (Index i = 0; i < n; ++i)
    if (cloth.masses[i] == 0)
      throw std::invalid_argument("cloth: vertex " + std::to_string(i) + " is in no triangle, so it has no mass");

  const auto opposite = [&](int triangle, int a, int b) {
    for (const int corner : mesh.triangles[std::size_t(triangle)])
      if (corner != a && corner != b) return corner;
    return a;
  };
  Weaver weaver(material, cloth.masses);
  for (const auto& [ends, edge] : edges) {
    const auto [a, b] = ends;
    if (edge.triangles.size() > 2)
      throw std::invalid_argument("cloth: the edge between vertices " + std::to_string(a) + " and " +
                                  std::to_string(b) + " has " + std::to_string(edge.triangles.size()) + " triangles");
    double around = 0;
    bool longest = edge.triangles.size() == 2;
    for (const int t : edge.triangles) {
      around += area[std::size_t(t)];
      const int c = opposite(t, a, b);
      longest = longest && length2(a, b) > length2(a, c) * (1 + 1e-9) && length2(a, b) > length2(b, c) * (1 + 1e-9);
    }
    const Family family = longest ? Family::Shear : Family::Stretch;
    weaver.join(a, b, (longest ? material.shear : material.stretch) * around / length2(a, b), family);
    if (edge.triangles.size() < 2) continue;
    const int c = opposite(edge.triangles[0], a, b), d = opposite(edge.triangles[1], a, b);
    if (c == d) continue;
    weaver.join(c, d, (longest ? material.shear : material.bend) * around / length2(c, d),
                longest ? Family::Shear : Family::Bend);
  }
  cloth.network = weaver.finish();
  return cloth;
}

}  // namespace hooke::softbody
