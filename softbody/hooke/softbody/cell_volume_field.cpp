#include <hooke/softbody/cell_volume_field.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace hooke::softbody {

namespace {

constexpr int kWide = 16;  // cells that are worked on together, so that the compiler makes vector code

using Rows = std::array<Index, 4>;  // of points beside a row of cells: (y, z), (y+1, z), (y, z+1), (y+1, z+1)

// Three vectors a cell, by vector and component.
template <class S>
struct Threes {
  S at[3][3][kWide];
};

// The mean edges along x, y and z of `count` cells.
template <class S>
void take_edges(const Points<S>& x, const Rows& rows, int count, Threes<S>& out) {
  for (int k = 0; k < 3; ++k) {
    const S* p = x.col(k).data();
    const S *r0 = p + rows[0], *r1 = p + rows[1], *r2 = p + rows[2], *r3 = p + rows[3];
    for (int i = 0; i < count; ++i) {
      const S d0 = r0[i + 1] - r0[i], d1 = r1[i + 1] - r1[i], d2 = r2[i + 1] - r2[i], d3 = r3[i + 1] - r3[i];
      const S low0 = r1[i] - r0[i], low1 = r3[i] - r2[i], high0 = r1[i + 1] - r0[i + 1], high1 = r3[i + 1] - r2[i + 1];
      const S back0 = r2[i] - r0[i], back1 = r3[i] - r1[i], front0 = r2[i + 1] - r0[i + 1],
              front1 = r3[i + 1] - r1[i + 1];
      out.at[0][k][i] = S(0.25) * ((d0 + d1) + (d2 + d3));
      out.at[1][k][i] = S(0.25) * ((low0 + low1) + (high0 + high1));
      out.at[2][k][i] = S(0.25) * ((back0 + back1) + (front0 + front1));
    }
  }
}

// out[v] = one[v + 1] × two[v + 2]: the derivatives of a · (b × c) by a, b and c where both are the edges.
template <class S>
void cross(const Threes<S>& one, const Threes<S>& two, int count, Threes<S>& out) {
  for (int v = 0; v < 3; ++v)
    for (int k = 0; k < 3; ++k) {
      const S *a1 = one.at[(v + 1) % 3][(k + 1) % 3], *a2 = one.at[(v + 1) % 3][(k + 2) % 3];
      const S *b1 = two.at[(v + 2) % 3][(k + 1) % 3], *b2 = two.at[(v + 2) % 3][(k + 2) % 3];
      S* to = out.at[v][k];
      for (int i = 0; i < count; ++i) to[i] = a1[i] * b2[i] - a2[i] * b1[i];
    }
}

template <class S>
void dot(const Threes<S>& one, const Threes<S>& two, int v, int count, S* out) {
  for (int i = 0; i < count; ++i)
    out[i] = one.at[v][0][i] * two.at[v][0][i] + one.at[v][1][i] * two.at[v][1][i] + one.at[v][2][i] * two.at[v][2][i];
}

// to += what `scale` times the derivatives by the mean edges is at each corner.
template <class S>
void spread(const Threes<S>& faces, const S* scale, const Rows& rows, int count, Points<S>& to) {
  for (int k = 0; k < 3; ++k) {
    S along[kWide], up[kWide], out[kWide];
    for (int i = 0; i < count; ++i) {
      const S s = S(0.25) * scale[i];
      along[i] = s * faces.at[0][k][i], up[i] = s * faces.at[1][k][i], out[i] = s * faces.at[2][k][i];
    }
    S* p = to.col(k).data();
    for (std::size_t row = 0; row < 4; ++row) {
      S* r = p + rows[row];
      S side[kWide];
      for (int i = 0; i < count; ++i) side[i] = (row & 1 ? up[i] : -up[i]) + (row & 2 ? out[i] : -out[i]);
      for (int i = 0; i < count; ++i) r[i] += side[i] - along[i];
      for (int i = 0; i < count; ++i) r[i + 1] += side[i] + along[i];
    }
  }
}

}  // namespace

template <class S>
template <class Work>
void CellVolumeField<S>::each_row(const Work& work) const {
  const Index nx = points_[0], ny = points_[1];
  Index cell = 0;
  for (Index z = 0; z + 1 < points_[2]; ++z)
    for (Index y = 0; y + 1 < ny; ++y)
      for (Index x = 0; x + 1 < nx; x += kWide) {
        const Index at = (z * ny + y) * nx + x, count = std::min<Index>(kWide, nx - 1 - x);
        work(Rows{at, at + nx, at + nx * ny, at + nx * ny + nx}, int(count), cell);
        cell += count;
      }
}

template <class S>
CellVolumeField<S>::CellVolumeField(double stiffness, const std::array<int, 3>& points, const Points<S>& start)
    : stiffness_(S(stiffness)), points_(points) {
  if (!(stiffness >= 0) || !std::isfinite(stiffness))
    throw std::invalid_argument("cell volume: stiffness must not be negative, got " + std::to_string(stiffness) +
                                " Pa");
  if (std::min({points[0], points[1], points[2]}) < 2 || Index(points[0]) * points[1] * points[2] != start.rows())
    throw std::invalid_argument("cell volume: needs at least 2 x 2 x 2 points, as many as there are, got " +
                                std::to_string(points[0]) + " x " + std::to_string(points[1]) + " x " +
                                std::to_string(points[2]) + " of " + std::to_string(start.rows()));
  for (const double volume : volumes(start)) start_.push_back(S(volume));
  for (std::size_t i = 0; i < start_.size(); ++i)
    if (!(start_[i] > 0))
      throw std::invalid_argument("cell volume: cell " + std::to_string(i) + " has the volume " +
                                  std::to_string(start_[i]) + " m3");
}

template <class S>
std::vector<double> CellVolumeField<S>::volumes(const Points<S>& x) const {
  std::vector<double> out;
  each_row([&](const Rows& rows, int count, Index) {
    Threes<S> edges, faces;
    S volume[kWide];
    take_edges(x, rows, count, edges);
    cross(edges, edges, count, faces);
    dot(edges, faces, 0, count, volume);
    out.insert(out.end(), volume, volume + count);
  });
  return out;
}

template <class S>
void CellVolumeField<S>::add_force(const Points<S>& x, const Points<S>&, double, Points<S>& f) const {
  add_forces(x, nullptr, f);
}

template <class S>
void CellVolumeField<S>::add_fine_force(const Points<S>& x, const Points<S>& low, const Points<S>&, double,
                                        Points<S>& f) const {
  add_forces(x, &low, f);
}

template <class S>
void CellVolumeField<S>::add_forces(const Points<S>& x, const Points<S>* low, Points<S>& f) const {
  each_row([&](const Rows& rows, int count, Index cell) {
    Threes<S> edges, faces;
    S pressure[kWide];
    take_edges(x, rows, count, edges);
    if (low) {
      take_edges(*low, rows, count, faces);
      for (int v = 0; v < 3; ++v)
        for (int k = 0; k < 3; ++k)
          for (int i = 0; i < count; ++i) edges.at[v][k][i] += faces.at[v][k][i];
    }
    cross(edges, edges, count, faces);
    dot(edges, faces, 0, count, pressure);
    const S* start = start_.data() + cell;
    for (int i = 0; i < count; ++i) pressure[i] = stiffness_ * (start[i] - pressure[i]) / start[i];
    spread(faces, pressure, rows, count, f);
  });
}

template <class S>
void CellVolumeField<S>::add_stiffness_times(const Points<S>& x, const Points<S>& d, bool safe, Points<S>& out) const {
  each_row([&](const Rows& rows, int count, Index cell) {
    Threes<S> edges, faces, changes;
    S volume[kWide], change[kWide], part[kWide];
    take_edges(x, rows, count, edges);
    take_edges(d, rows, count, changes);
    cross(edges, edges, count, faces);
    dot(edges, faces, 0, count, volume);
    dot(changes, faces, 0, count, change);
    for (int v = 1; v < 3; ++v) {
      dot(changes, faces, v, count, part);
      for (int i = 0; i < count; ++i) change[i] += part[i];
    }
    const S* start = start_.data() + cell;
    for (int i = 0; i < count; ++i) change[i] *= stiffness_ / start[i];
    spread(faces, change, rows, count, out);
    if (safe) return;
    Threes<S> turns;
    for (int i = 0; i < count; ++i) volume[i] = stiffness_ * (volume[i] - start[i]) / start[i];
    cross(changes, edges, count, turns);
    spread(turns, volume, rows, count, out);
    cross(edges, changes, count, turns);
    spread(turns, volume, rows, count, out);
  });
}

template <class S>
double CellVolumeField<S>::potential_energy(const Points<S>& x) const {
  const std::vector<double> volume = volumes(x);
  double sum = 0;
  for (std::size_t i = 0; i < volume.size(); ++i) {
    const double start = double(start_[i]);
    sum += (volume[i] - start) * (volume[i] - start) / start;
  }
  return 0.5 * double(stiffness_) * sum;
}

template <class S>
typename ForceField<S>::Rates CellVolumeField<S>::rate_bounds(const Points<S>& x, const Points<S>&,
                                                              const Values<S>& inverse_mass) const {
  // By cell: the derivatives of V by the mean edges, times √(κ/V₀) / 4, and |pressure| × the longest mean edge,
  // which no eigenvalue of the turning's part exceeds.
  faces_.clear();
  each_row([&](const Rows& rows, int count, Index cell) {
    Threes<S> edges, faces;
    take_edges(x, rows, count, edges);
    cross(edges, edges, count, faces);
    for (int i = 0; i < count; ++i) {
      const double start = double(start_[std::size_t(cell) + std::size_t(i)]);
      Mat3 edge, face;
      for (int v = 0; v < 3; ++v)
        for (int k = 0; k < 3; ++k) edge(k, v) = double(edges.at[v][k][i]), face(k, v) = double(faces.at[v][k][i]);
      Eigen::Matrix<double, 3, 4> kept;
      kept.leftCols<3>() = 0.25 * std::sqrt(double(stiffness_) / start) * face;
      kept.col(3).setConstant(std::abs(double(stiffness_) * (edge.col(0).dot(face.col(0)) / start - 1)) *
                              edge.colwise().norm().maxCoeff());
      faces_.push_back(kept);
    }
  });
  const int nx = points_[0], ny = points_[1], nz = points_[2];
  const auto gradient = [&](int cell, int corner) {
    const auto& face = faces_[std::size_t(cell)];
    return Vec3((corner & 1 ? 1 : -1) * face.col(0) + (corner & 2 ? 1 : -1) * face.col(1) +
                (corner & 4 ? 1 : -1) * face.col(2));
  };
  sums_.setZero(x.rows());
  rows_.assign(faces_.size(), 0);
  double turning = 0;
  for (int z = 0; z + 1 < nz; ++z)
    for (int y = 0; y + 1 < ny; ++y)
      for (int i = 0; i + 1 < nx; ++i) {
        const int cell = (z * (ny - 1) + y) * (nx - 1) + i;
        double with[27] = {};  // by neighbour; those before it have been there
        for (int corner = 0; corner < 8; ++corner) {
          const int px = i + (corner & 1), py = y + (corner >> 1 & 1), pz = z + (corner >> 2);
          const Index point = (Index(pz) * ny + py) * nx + px;
          sums_[point] += faces_[std::size_t(cell)](0, 3);
          const Vec3 g = double(inverse_mass[point]) * gradient(cell, corner);
          for (int other = 0; other < 8; ++other) {  // as which corner the neighbour has the point
            const int cx = px - (other & 1), cy = py - (other >> 1 & 1), cz = pz - (other >> 2);
            if (cx < 0 || cy < 0 || cz < 0 || cx + 1 >= nx || cy + 1 >= ny || cz + 1 >= nz) continue;
            const int neighbour = (cz * (ny - 1) + cy) * (nx - 1) + cx;
            if (neighbour < cell) continue;
            with[(cz - z + 1) * 9 + (cy - y + 1) * 3 + cx - i + 1] += g.dot(gradient(neighbour, other));
          }
        }
        rows_[std::size_t(cell)] += std::abs(with[13]);
        for (int k = 14; k < 27; ++k) {
          if (with[k] == 0) continue;
          const int neighbour = cell + ((k / 9 - 1) * (ny - 1) + k / 3 % 3 - 1) * (nx - 1) + k % 3 - 1;
          rows_[std::size_t(cell)] += std::abs(with[k]);
          rows_[std::size_t(neighbour)] += std::abs(with[k]);
        }
      }
  const double most = *std::max_element(rows_.begin(), rows_.end());
  for (Index i = 0; i < x.rows(); ++i) turning = std::max(turning, double(inverse_mass[i]) * sums_[i]);
  return {most + turning, 0};
}

template <class S>
void CellVolumeField<S>::describe(Blueprint& out) const {
  CheckpointWriter data;
  for (const int count : points_) data.add(count);
  for (const S volume : start_) data.add(double(volume));
  out.add("cell volume stiffness", double(stiffness_));
  out.add_sum("cell volumes", data);
}

template class CellVolumeField<float>;
template class CellVolumeField<double>;

}  // namespace hooke::softbody
