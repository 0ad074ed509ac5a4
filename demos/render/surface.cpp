#include <render/surface.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

namespace hooke::render {

namespace {

constexpr float kNoHem = 1e3f;
constexpr double kHemSwell = 1.5;  // a hem is cloth folded over: thicker than the sheet

std::uint64_t edge_key(int a, int b) { return (std::uint64_t(std::uint32_t(a)) << 32) | std::uint32_t(b); }

Vec3 unit_or(const Vec3& v, const Vec3& otherwise) {
  const double length = v.norm();
  return length > 1e-300 ? Vec3(v / length) : otherwise;
}

void add_angle_weighted_normals(const std::vector<Triangle>& triangles, const std::vector<Vec3>& position,
                                std::vector<Vec3>& normal) {
  normal.assign(position.size(), Vec3::Zero());
  for (const Triangle& t : triangles) {
    const Vec3 &a = position[t[0]], &b = position[t[1]], &c = position[t[2]];
    const Vec3 cross = (b - a).cross(c - a);
    const double area2 = cross.norm();
    if (!(area2 > 1e-300)) continue;
    const Vec3 n = cross / area2;
    normal[t[0]] += std::atan2(area2, (b - a).dot(c - a)) * n;
    normal[t[1]] += std::atan2(area2, (c - b).dot(a - b)) * n;
    normal[t[2]] += std::atan2(area2, (a - c).dot(b - c)) * n;
  }
  for (Vec3& n : normal) n = unit_or(n, Vec3::UnitY());
}

}  // namespace

Surface::Surface(const Model& model)
    : given_(model.mesh->triangles),
      given_count_(model.mesh->vertices.rows()),
      thickness_(model.thickness),
      subdivisions_(model.subdivisions),
      rounded_(model.material.kind == Material::Kind::Jelly) {
  for (std::size_t i = 0; i < given_.size(); ++i)
    for (int corner : given_[i])
      if (corner < 0 || corner >= given_count_)
        throw std::invalid_argument("triangle " + std::to_string(i) + " names vertex " + std::to_string(corner) +
                                    " of " + std::to_string(given_count_));
  if (model.uv) {
    if (model.uv->rows() != given_count_)
      throw std::invalid_argument("uv must have one row a vertex (" + std::to_string(given_count_) + "), got " +
                                  std::to_string(model.uv->rows()));
    given_uv_ = *model.uv;
    for (Index i = 0; i < given_count_; ++i) uv_.emplace_back(given_uv_(i, 0), given_uv_(i, 1));
  }
  sheet_ = given_;
  position_.resize(static_cast<std::size_t>(given_count_));
  for (int level = 0; level < subdivisions_; ++level) subdivide();
  find_border();
  hem_.assign(position_.size(), kNoHem);
  if (thickness_ > 0) measure_hem();
  index_sheets();
  index_coarse();
}

bool Surface::fits(const Model& model) const {
  const bool same_uv =
      model.uv ? given_uv_.rows() == model.uv->rows() && (given_uv_ == *model.uv).all() : given_uv_.rows() == 0;
  return same_uv && model.mesh->vertices.rows() == given_count_ && model.thickness == thickness_ &&
         model.subdivisions == subdivisions_ && (model.material.kind == Material::Kind::Jelly) == rounded_ &&
         model.mesh->triangles == given_;
}

// Splits every edge; where the new vertices go is decided in update().
void Surface::subdivide() {
  std::unordered_map<std::uint64_t, int> middle_of;
  std::vector<Edge> edges;
  const int first = static_cast<int>(position_.size());
  const auto middle = [&](int a, int b, int opposite) {
    const auto [place, is_new] =
        middle_of.try_emplace(edge_key(std::min(a, b), std::max(a, b)), first + static_cast<int>(edges.size()));
    if (is_new) {
      edges.push_back({a, b, opposite});
      if (!uv_.empty()) uv_.push_back(0.5 * (uv_[a] + uv_[b]));
    }
    if (!is_new) edges[static_cast<std::size_t>(place->second - first)].right = opposite;
    return place->second;
  };
  std::vector<Triangle> finer;
  finer.reserve(4 * sheet_.size());
  for (const auto& [a, b, c] : sheet_) {
    const int ab = middle(a, b, c), bc = middle(b, c, a), ca = middle(c, a, b);
    finer.push_back({a, ab, ca});
    finer.push_back({ab, b, bc});
    finer.push_back({ca, bc, c});
    finer.push_back({ab, bc, ca});
  }
  position_.resize(position_.size() + edges.size());
  midpoints_.push_back(std::move(edges));
  level_triangles_.push_back(std::exchange(sheet_, std::move(finer)));
}

void Surface::find_border() {
  border_slot_.assign(position_.size(), -1);
  if (!(thickness_ > 0)) return;
  std::unordered_map<std::uint64_t, int> uses;
  for (const Triangle& t : sheet_)
    for (int k = 0; k < 3; ++k) ++uses[edge_key(std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3]))];
  for (const Triangle& t : sheet_)
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (uses[edge_key(std::min(a, b), std::max(a, b))] != 1) continue;
      border_.push_back({a, b});
      for (int v : {a, b})
        if (border_slot_[v] < 0) {
          border_slot_[v] = static_cast<int>(border_vertices_.size());
          border_vertices_.push_back(v);
        }
    }
}

// Shortest way to the border along edges, in the cloth as cut: exact where the border is
// straight and the grid runs across it, close enough for a line of stitches elsewhere.
void Surface::measure_hem() {
  if (uv_.empty()) return;
  std::vector<std::vector<int>> neighbours(position_.size());
  for (const Triangle& t : sheet_)
    for (int k = 0; k < 3; ++k) {
      neighbours[t[k]].push_back(t[(k + 1) % 3]);
      neighbours[t[(k + 1) % 3]].push_back(t[k]);
    }
  using Entry = std::pair<float, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  for (int v : border_vertices_) front.emplace(hem_[v] = 0, v);
  while (!front.empty()) {
    const auto [distance, v] = front.top();
    front.pop();
    if (distance > hem_[v]) continue;
    for (int w : neighbours[v]) {
      const float through = distance + static_cast<float>((uv_[v] - uv_[w]).norm());
      if (through < hem_[w]) front.emplace(hem_[w] = through, w);
    }
  }
}

// Vertices: the outer sheet, then (with thickness) the inner sheet, then two for each
// border vertex: the hem's outermost line, and its inner edge in the outside's colour.
void Surface::index_sheets() {
  const auto n = static_cast<std::uint32_t>(position_.size());
  for (const Triangle& t : sheet_)
    for (int corner : t) indices_.push_back(static_cast<std::uint32_t>(corner));
  drawn_.resize(n);
  if (thickness_ > 0) {
    for (const auto& [a, b, c] : sheet_)
      for (int corner : {a, c, b}) indices_.push_back(n + static_cast<std::uint32_t>(corner));
    for (const auto& [a, b, left, right] : border_) {
      const std::uint32_t ea = 2 * n + 2 * border_slot_[a], eb = 2 * n + 2 * border_slot_[b];
      const std::uint32_t top_a = a, top_b = b, low_a = ea + 1, low_b = eb + 1;
      for (std::uint32_t i : {top_b, top_a, ea, top_b, ea, eb, eb, ea, low_a, eb, low_a, low_b}) indices_.push_back(i);
    }
    drawn_.resize(2 * n + 2 * border_vertices_.size());
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    SurfaceVertex vertex{};
    if (!uv_.empty()) {
      vertex.uv[0] = static_cast<float>(uv_[i].x());
      vertex.uv[1] = static_cast<float>(uv_[i].y());
    }
    vertex.hem = hem_[i];
    drawn_[i] = vertex;
    if (!(thickness_ > 0)) continue;
    vertex.side = 1;
    drawn_[n + i] = vertex;
    if (border_slot_[i] < 0) continue;
    vertex.side = 0;
    drawn_[2 * n + 2 * border_slot_[i]] = drawn_[2 * n + 2 * border_slot_[i] + 1] = vertex;
  }
}

// Halves the given mesh until it has few triangles by merging each vertex with one free
// neighbour. Only connectivity is used, so the result moves with the mesh; what it loses
// in shape is about an edge length, far below what light from all around resolves.
void Surface::index_coarse() {
  constexpr std::size_t kEnough = 8000;
  std::vector<Triangle> triangles = given_;
  std::vector<int> merged(static_cast<std::size_t>(given_count_));
  for (int round = 0; round < 4 && triangles.size() > kEnough; ++round) {
    std::fill(merged.begin(), merged.end(), -1);
    for (const Triangle& t : triangles)
      for (int k = 0; k < 3; ++k) {
        const int a = t[k], b = t[(k + 1) % 3];
        if (merged[a] < 0 && merged[b] < 0) merged[a] = merged[b] = std::min(a, b);
      }
    std::vector<Triangle> fewer;
    for (Triangle t : triangles) {
      for (int& corner : t)
        if (merged[corner] >= 0) corner = merged[corner];
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) fewer.push_back(t);
    }
    triangles = std::move(fewer);
  }
  for (const Triangle& t : triangles)
    for (int corner : t) indices_.push_back(static_cast<std::uint32_t>(corner));
  coarse_count_ = 3 * triangles.size();
}

void Surface::update(const Points<double>& vertices) {
  for (Index i = 0; i < given_count_; ++i) {
    if (!vertices.row(i).allFinite())
      throw std::invalid_argument("vertex " + std::to_string(i) + " has a coordinate that is not finite");
    position_[static_cast<std::size_t>(i)] = vertices.row(i).matrix().transpose();
  }
  // New vertices lie where a cubic through both ends, perpendicular to both normals, has
  // its middle (PN triangles, Vlachos et al. 2001); given vertices stay where they are.
  auto place = static_cast<std::size_t>(given_count_);
  std::vector<Vec3> coarse;
  for (std::size_t level = 0; level < midpoints_.size(); ++level) {
    coarse.assign(position_.begin(), position_.begin() + static_cast<std::ptrdiff_t>(place));
    if (rounded_) {
      round_off(level, coarse);
      place += midpoints_[level].size();
      continue;
    }
    add_angle_weighted_normals(level_triangles_[level], coarse, normal_);
    for (const auto& [a, b, left, right] : midpoints_[level]) {
      const Vec3 &pa = coarse[a], &pb = coarse[b], &na = normal_[a], &nb = normal_[b];
      position_[place++] = 0.5 * (pa + pb) - 0.125 * ((pb - pa).dot(na) * na + (pa - pb).dot(nb) * nb);
    }
  }
  lower_ = upper_ = position_.empty() ? Vec3(0, 0, 0) : position_.front();
  for (const Vec3& p : position_) {
    lower_ = lower_.cwiseMin(p);
    upper_ = upper_.cwiseMax(p);
  }
  add_angle_weighted_normals(sheet_, position_, normal_);
  write_sheets();
}

// One step of Loop's subdivision (1987), which moves the given vertices too: edges become round, about a
// triangle wide, and flat faces stay flat. Warren's weights.
void Surface::round_off(std::size_t level, const std::vector<Vec3>& coarse) {
  std::vector<Vec3> sum(coarse.size(), Vec3::Zero()), along_border(coarse.size(), Vec3::Zero());
  std::vector<int> count(coarse.size(), 0);
  std::vector<bool> border(coarse.size(), false);
  std::size_t place = coarse.size();
  for (const Edge& e : midpoints_[level]) {
    const auto a = static_cast<std::size_t>(e.a), b = static_cast<std::size_t>(e.b);
    const Vec3 &pa = coarse[a], &pb = coarse[b];
    sum[a] += pb, sum[b] += pa;
    ++count[a], ++count[b];
    if (e.right < 0) {
      border[a] = border[b] = true;
      along_border[a] += pb, along_border[b] += pa;
      position_[place++] = 0.5 * (pa + pb);
    } else {
      position_[place++] = 0.375 * (pa + pb) + 0.125 * (coarse[static_cast<std::size_t>(e.left)] +
                                                        coarse[static_cast<std::size_t>(e.right)]);
    }
  }
  for (std::size_t i = 0; i < coarse.size(); ++i) {
    if (count[i] == 0) continue;
    const double share = count[i] > 3 ? 3.0 / 8 / count[i] : 3.0 / 16;
    position_[i] = border[i] ? Vec3(0.75 * coarse[i] + 0.125 * along_border[i])
                             : Vec3((1 - count[i] * share) * coarse[i] + share * sum[i]);
  }
}

void Surface::set_cover(const Values<float>* values, float otherwise) {
  const std::size_t n = position_.size();
  std::vector<float> cover(n, otherwise);
  if (values) {
    if (values->rows() != given_count_)
      throw std::invalid_argument("cover must have one row a vertex (" + std::to_string(given_count_) + "), got " +
                                  std::to_string(values->rows()));
    for (Index i = 0; i < given_count_; ++i) {
      if (!((*values)(i) >= 0 && (*values)(i) <= 1))
        throw std::invalid_argument("cover[" + std::to_string(i) + "] must be in [0, 1], got " +
                                    std::to_string((*values)(i)));
      cover[static_cast<std::size_t>(i)] = (*values)(i);
    }
    auto place = static_cast<std::size_t>(given_count_);
    for (const auto& level : midpoints_)
      for (const auto& [a, b, left, right] : level) cover[place++] = 0.5f * (cover[a] + cover[b]);
  }
  for (std::size_t i = 0; i < n; ++i) drawn_[i].side = cover[i];
}

void Surface::write_sheets() {
  const auto set = [](SurfaceVertex& vertex, const Vec3& position, const Vec3& normal) {
    for (int k = 0; k < 3; ++k) {
      vertex.position[k] = static_cast<float>(position[k]);
      vertex.normal[k] = static_cast<float>(normal[k]);
    }
  };
  const std::size_t n = position_.size();
  const double half = 0.5 * thickness_;
  for (std::size_t i = 0; i < n; ++i) {
    const double offset = border_slot_[i] >= 0 ? kHemSwell * half : half;
    set(drawn_[i], position_[i] + offset * normal_[i], normal_[i]);
    if (thickness_ > 0) set(drawn_[n + i], position_[i] - offset * normal_[i], -normal_[i]);
  }
  if (!(thickness_ > 0)) return;

  std::vector<Vec3> outward(border_vertices_.size(), Vec3::Zero());
  for (const auto& [a, b, left, right] : border_) {
    const Vec3 along = position_[b] - position_[a];
    for (int v : {a, b}) outward[border_slot_[v]] += unit_or(along.cross(normal_[v]), Vec3::Zero());
  }
  for (std::size_t slot = 0; slot < border_vertices_.size(); ++slot) {
    const int v = border_vertices_[slot];
    const Vec3 out = unit_or(outward[slot], normal_[v]);
    set(drawn_[2 * n + 2 * slot], position_[v] + kHemSwell * half * out, out);
    set(drawn_[2 * n + 2 * slot + 1], position_[v] - kHemSwell * half * normal_[v], -normal_[v]);
  }
}

}  // namespace hooke::render
