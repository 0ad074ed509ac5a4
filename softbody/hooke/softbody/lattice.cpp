#include <hooke/softbody/lattice.hpp>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>
#include <string>

namespace hooke::softbody {

namespace {

using Count = std::array<int, 3>;

void require(bool holds, const char* name, const char* rule, double value) {
  if (!holds || !std::isfinite(value))
    throw std::invalid_argument(std::string("lattice material: ") + name + " must " + rule + ", got " +
                                std::to_string(value));
}

template <class T>
std::string text(const T& three) {
  return std::to_string(three[0]) + " x " + std::to_string(three[1]) + " x " + std::to_string(three[2]);
}

void check(const Vec3& size, const Count& points, const Mat3& turn) {
  if (!((size.array() > 0).all() && size.allFinite()))
    throw std::invalid_argument("lattice: size must be positive, got " + text(size) + " m");
  if (points[0] < 2 || points[1] < 2 || points[2] < 2)
    throw std::invalid_argument("lattice: needs at least 2 x 2 x 2 points, got " + text(points));
  if (!((turn * turn.transpose() - Mat3::Identity()).norm() < 1e-6) || !(turn.determinant() > 0))
    throw std::invalid_argument("lattice: turn must be a rotation");
}

Vec3 cell_of(const Vec3& size, const Count& points) {
  return {size[0] / (points[0] - 1), size[1] / (points[1] - 1), size[2] / (points[2] - 1)};
}

// How many of the two cells beside it along an axis a point has, as a share.
double share(int i, int count) { return i == 0 || i == count - 1 ? 0.5 : 1.0; }

class Box {
 public:
  explicit Box(const Count& points) : points_(points) {}

  int index(const Count& at) const { return (at[2] * points_[1] + at[1]) * points_[0] + at[0]; }
  bool holds(const Count& at) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (at[k] < 0 || at[k] >= points_[k]) return false;
    return true;
  }

  template <class Work>
  void each(const Work& work) const {
    for (int z = 0; z < points_[2]; ++z)
      for (int y = 0; y < points_[1]; ++y)
        for (int x = 0; x < points_[0]; ++x) work(Count{x, y, z});
  }

  Points<double> positions(const Vec3& size, const Mat3& turn) const {
    const Index n = Index(points_[0]) * points_[1] * points_[2];
    Points<double> out(n, 3);
    each([&](const Count& at) {
      Vec3 place;
      for (int k = 0; k < 3; ++k)
        place[k] = (double(at[std::size_t(k)]) / (points_[std::size_t(k)] - 1) - 0.5) * size[k];
      out.row(index(at)) = (turn * place).transpose().array();
    });
    return out;
  }

  // Springs from every point in the 13 directions that go forward in index order.
  // stiffness(step, at): of the spring from `at`.
  template <class Stiffness>
  std::shared_ptr<const SpringNetwork> join(const Values<double>& masses, double damping_ratio,
                                            const Stiffness& stiffness) const {
    SpringNetwork network;
    for (int direction = 14; direction < 27; ++direction) {
      const Count step{direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
      const int axes = std::abs(step[0]) + std::abs(step[1]) + std::abs(step[2]);
      const Family family = axes == 1 ? Family::Stretch : axes == 2 ? Family::Shear : Family::Bend;
      each([&](const Count& at) {
        const Count to{at[0] + step[0], at[1] + step[1], at[2] + step[2]};
        if (!holds(to)) return;
        const double k = stiffness(step, at);
        const int a = index(at), b = index(to);
        if (k > 0)
          network.springs.push_back(
              {a, b, k, damping_of_ratio(damping_ratio, k, masses[a], masses[b]), Spring::kFromStart, family});
      });
    }
    return std::make_shared<const SpringNetwork>(std::move(network));
  }

  // The six faces. Their diagonals go one way, so that almost all points have six neighbours: alternating ones
  // would show as bumps wherever the surface is subdivided.
  std::vector<Triangle> surface() const {
    std::vector<Triangle> triangles;
    for (std::size_t normal = 0; normal < 3; ++normal) {
      const std::size_t u = (normal + 1) % 3, v = (normal + 2) % 3;
      for (const bool far : {false, true}) {
        Count at{};
        at[normal] = far ? points_[normal] - 1 : 0;
        for (at[v] = 0; at[v] + 1 < points_[v]; ++at[v])
          for (at[u] = 0; at[u] + 1 < points_[u]; ++at[u]) {
            const auto corner = [&](int du, int dv) {
              Count c = at;
              c[u] += du, c[v] += dv;
              return index(c);
            };
            int ring[4] = {corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
            if (!far) std::swap(ring[1], ring[3]);
            triangles.push_back({ring[0], ring[1], ring[2]});
            triangles.push_back({ring[0], ring[2], ring[3]});
          }
      }
    }
    return triangles;
  }

 private:
  Count points_;
};

}  // namespace

Lattice lattice_from_box(const Vec3& size, const Count& points, const LatticeMaterial& m, const Mat3& turn) {
  check(size, points, turn);
  require(m.density > 0, "density", "be positive", m.density);
  require(m.young > 0, "young", "be positive", m.young);
  require(m.poisson_ratio >= 0.25 && m.poisson_ratio < 0.5, "poisson_ratio",
          "be at least 0.25, which springs alone have, and below 0.5", m.poisson_ratio);
  require(m.damping_ratio >= 0, "damping_ratio", "not be negative", m.damping_ratio);
  const Vec3 d = cell_of(size, points);
  const double volume = d.prod(), shear = m.young / (2 * (1 + m.poisson_ratio));
  Vec3 edge;
  for (int k = 0; k < 3; ++k) edge[k] = shear * volume * (4 / (d[k] * d[k]) - d.array().square().inverse().sum());
  // Rounding makes a little of what is exactly none.
  if (edge.minCoeff() < -1e-9 * edge.cwiseAbs().maxCoeff())
    throw std::invalid_argument("lattice: cells must be nearly cubes, got " + text(d) +
                                " m; change points so that size / (points - 1) is about the same on all sides");

  const Box box(points);
  Lattice lattice;
  lattice.points = points;
  lattice.positions = box.positions(size, turn);
  lattice.masses.resize(lattice.positions.rows());
  box.each([&](const Count& at) {
    double mass = m.density * volume;
    for (std::size_t k = 0; k < 3; ++k) mass *= share(at[k], points[k]);
    lattice.masses[box.index(at)] = mass;
  });
  lattice.network = box.join(lattice.masses, m.damping_ratio, [&](const Count& step, const Count& at) {
    double shared = 1, squares = 0, product = 1;
    int along = -1, axes = 0;
    for (int k = 0; k < 3; ++k) {
      const std::size_t axis = std::size_t(k);
      if (step[axis] == 0) {
        shared *= share(at[axis], points[axis]);
        continue;
      }
      ++axes, along = k;
      squares += d[k] * d[k];
      product *= d[k] * d[k];
    }
    if (axes == 3) return 0.0;
    return shared * (axes == 1 ? edge[along] : shear * volume * squares / (2 * product));
  });
  lattice.triangles = box.surface();
  lattice.cell_stiffness = m.young / (3 * (1 - 2 * m.poisson_ratio)) - shear * 5 / 3;
  if (m.poisson_ratio == 0.25) lattice.cell_stiffness = 0;
  return lattice;
}

Lattice lattice_from_box(const Vec3& size, const Count& points, const FixedLatticeMaterial& m, const Mat3& turn) {
  check(size, points, turn);
  require(m.mass > 0, "mass", "be positive", m.mass);
  require(m.stiffness >= 0, "stiffness", "not be negative", m.stiffness);
  require(m.damping_ratio >= 0, "damping_ratio", "not be negative", m.damping_ratio);
  const Box box(points);
  Lattice lattice;
  lattice.points = points;
  lattice.positions = box.positions(size, turn);
  lattice.masses = Values<double>::Constant(lattice.positions.rows(), m.mass / double(lattice.positions.rows()));
  lattice.network = box.join(lattice.masses, m.damping_ratio, [&](const Count&, const Count&) { return m.stiffness; });
  lattice.triangles = box.surface();
  return lattice;
}

}  // namespace hooke::softbody
