#include <hooke/vdb/capsule_skin.hpp>
#include <human/skinning.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numeric>

namespace hooke::human {
namespace {

using Quat = Eigen::Quaterniond;

// Sharp labels, then heat flow over the surface: weights become smooth across `width` and
// never jump from one limb to another through the air.
Eigen::ArrayXXd diffuse(const TriangleMesh& mesh, Eigen::ArrayXXd weights, double voxel_size, double width) {
  const Index vertices = weights.cols();
  std::vector<std::array<int, 2>> edges;
  edges.reserve(mesh.triangles.size() * 3);
  Values<double> degree = Values<double>::Zero(vertices);
  for (const Triangle& t : mesh.triangles)
    for (std::size_t e = 0; e < 3; ++e) {
      edges.push_back({t[e], t[(e + 1) % 3]});  // every edge comes once from either side
      degree[t[e]] += 1;
    }
  // One step spreads by about half an edge: σ = edge/2 √steps.
  const int steps = static_cast<int>(std::ceil(std::pow(2 * width / voxel_size, 2)));
  Eigen::ArrayXXd sum(weights.rows(), vertices);
  for (int step = 0; step < steps; ++step) {
    sum.setZero();
    for (const auto& [from, to] : edges) sum.col(from) += weights.col(to);
    for (Index v = 0; v < vertices; ++v) weights.col(v) = 0.5 * (weights.col(v) + sum.col(v) / degree[v]);
  }
  return weights;
}

}  // namespace

DualQuaternion motion_between(const io::JointFrame& from, const io::JointFrame& to) {
  const Quat turn = to.rotation * from.rotation.conjugate();
  const Vec3 shift = to.position - turn * from.position;
  DualQuaternion result;
  result.real = turn.coeffs();
  result.dual = 0.5 * (Quat(0, shift.x(), shift.y(), shift.z()) * turn).coeffs();
  return result;
}

Vec3 blend(const Influence& influence, std::span<const DualQuaternion> motions, const Vec3& point) {
  Eigen::Vector4d real = Eigen::Vector4d::Zero();
  Eigen::Vector4d dual = Eigen::Vector4d::Zero();
  const Eigen::Vector4d& first = motions[static_cast<std::size_t>(influence.joints[0])].real;
  for (std::size_t k = 0; k < 4; ++k) {
    if (influence.weights[k] == 0) continue;
    const DualQuaternion& m = motions[static_cast<std::size_t>(influence.joints[k])];
    const double w = first.dot(m.real) < 0 ? -influence.weights[k] : influence.weights[k];
    real += w * m.real;
    dual += w * m.dual;
  }
  const double scale = 1 / real.norm();
  real *= scale;
  dual *= scale;
  const Vec3 r = real.head<3>();
  const Vec3 d = dual.head<3>();
  return point + 2 * r.cross(r.cross(point) + real.w() * point) + 2 * (real.w() * d - dual.w() * r + r.cross(d));
}

Skinning::Skinning(const Body& body, const io::LocalPose& bind_pose, const SkinSettings& settings)
    : settings_(settings), bind_frames_(static_cast<std::size_t>(body.motion.joint_count())) {
  io::global_pose(body.motion, bind_pose, bind_frames_);
  std::vector<Capsule> capsules(body.capsules.size());
  place_capsules(body.capsules, bind_frames_, capsules);
  std::vector<Capsule> flesh(body.flesh.size());
  place_capsules(body.flesh, bind_frames_, flesh);
  mesh_ = vdb::skin_capsules(flesh, settings.voxel_size, settings.blend_radius);
  smooth(capsules);
  find_weights(body, capsules);
  find_neighbours(capsules);
}

// Taubin's smoothing: shrink and inflate in turns, so that steps between capsules go and the
// volume stays. Less on thin parts, where a step is as long as the finger is thick.
void Skinning::smooth(std::span<const Capsule> capsules) {
  const Index vertices = mesh_.vertices.rows();
  Values<double> strength(vertices);
  for (Index v = 0; v < vertices; ++v) {
    const Vec3 x = mesh_.vertices.row(v).matrix();
    const auto nearest = std::min_element(capsules.begin(), capsules.end(), [&](const Capsule& a, const Capsule& b) {
      return signed_distance(a, x) < signed_distance(b, x);
    });
    strength[v] = std::clamp((nearest->radius - 0.014) / 0.018, 0.05, 1.0);
  }
  Points<double> sum(vertices, 3);
  Values<double> degree = Values<double>::Zero(vertices);
  for (const Triangle& t : mesh_.triangles)
    for (const int v : t) degree[v] += 1;
  const int last = 2 * settings_.smoothing;  // plain passes follow: they take single dents away
  for (int pass = 0; pass < last + std::min(settings_.smoothing, 4); ++pass) {
    sum.setZero();
    for (const Triangle& t : mesh_.triangles)
      for (std::size_t e = 0; e < 3; ++e) sum.row(t[e]) += mesh_.vertices.row(t[(e + 1) % 3]);
    const double factor = pass >= last ? 0.5 : pass % 2 == 0 ? 0.7 : -0.72;
    mesh_.vertices += (sum.colwise() / degree - mesh_.vertices).colwise() * (factor * strength);
  }
}

void Skinning::find_weights(const Body& body, std::span<const Capsule> capsules) {
  std::vector<int> joints;  // those that carry capsules
  for (const BoneCapsule& c : body.capsules) joints.push_back(c.joint);
  std::sort(joints.begin(), joints.end());
  joints.erase(std::unique(joints.begin(), joints.end()), joints.end());

  const Index vertices = mesh_.vertices.rows();
  Eigen::ArrayXXd weights = Eigen::ArrayXXd::Zero(static_cast<Index>(joints.size()), vertices);
  for (Index v = 0; v < vertices; ++v) {
    const Vec3 x = mesh_.vertices.row(v).matrix();
    double nearest = 1e300;
    int owner = 0;
    for (std::size_t c = 0; c < capsules.size(); ++c) {
      const double d = signed_distance(capsules[c], x);
      if (d < nearest) {
        nearest = d;
        owner = body.capsules[c].joint;
      }
    }
    weights(std::lower_bound(joints.begin(), joints.end(), owner) - joints.begin(), v) = 1;
  }
  weights = diffuse(mesh_, std::move(weights), settings_.voxel_size, settings_.weight_width);

  influences_.resize(static_cast<std::size_t>(vertices));
  std::vector<int> order(joints.size());
  for (Index v = 0; v < vertices; ++v) {
    std::iota(order.begin(), order.end(), 0);
    std::partial_sort(order.begin(), order.begin() + 5, order.end(),
                      [&](int a, int b) { return weights(a, v) > weights(b, v); });
    // Less the fifth, so that a joint enters and leaves the four at weight zero.
    const double cut = weights(order[4], v);
    Influence& influence = influences_[static_cast<std::size_t>(v)];
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += weights(order[k], v) - cut;
    for (std::size_t k = 0; k < 4; ++k) {
      influence.joints[k] = joints[static_cast<std::size_t>(order[k])];
      influence.weights[k] = (weights(order[k], v) - cut) / sum;
    }
  }
}

void Skinning::find_neighbours(std::span<const Capsule> capsules) {
  constexpr double neighbourhood = 0.04;  // [m]
  near_start_.assign(1, 0);
  for (Index v = 0; v < mesh_.vertices.rows(); ++v) {
    const Vec3 x = mesh_.vertices.row(v).matrix();
    for (std::size_t c = 0; c < capsules.size(); ++c)
      if (signed_distance(capsules[c], x) < neighbourhood) near_.push_back(static_cast<int>(c));
    near_start_.push_back(static_cast<int>(near_.size()));
  }
}

void Skinning::deform(std::span<const io::JointFrame> frames, std::span<const Capsule> capsules,
                      Points<double>& out) const {
  thread_local std::vector<DualQuaternion> motions;
  motions.resize(frames.size());
  for (std::size_t j = 0; j < frames.size(); ++j) motions[j] = motion_between(bind_frames_[j], frames[j]);
  if (out.rows() != mesh_.vertices.rows()) out.resize(mesh_.vertices.rows(), 3);
  const double soft = 0.6 * settings_.clearance;  // from here on vertices are drawn back
  for (Index v = 0; v < mesh_.vertices.rows(); ++v) {
    const auto at = static_cast<std::size_t>(v);
    Vec3 x = blend(influences_[at], motions, mesh_.vertices.row(v).matrix().transpose());
    for (int round = 0; round < 2; ++round) {
      double distance = 1e300;
      Vec3 nearest = x;
      for (int n = near_start_[at]; n < near_start_[at + 1]; ++n) {
        const Capsule& c = capsules[static_cast<std::size_t>(near_[static_cast<std::size_t>(n)])];
        const Vec3 p = nearest_on_segment(c.a, c.b, x);
        const double d = (x - p).norm() - c.radius;
        if (d < distance) {
          distance = d;
          nearest = p;
        }
      }
      if (!(distance > soft)) break;
      const double room = settings_.clearance - soft;
      const double wanted = soft + room * (1 - std::exp(-(distance - soft) / room));
      x -= (distance - wanted) * (x - nearest).normalized();
      if (distance < 2 * settings_.clearance) break;
    }
    out.row(v) = x.array().transpose();
  }
}

double Skinning::greatest_distance(const Points<double>& vertices, std::span<const Capsule> capsules,
                                   double floor) const {
  double greatest = floor;
  for (Index v = 0; v < vertices.rows(); ++v) {
    const auto at = static_cast<std::size_t>(v);
    const Vec3 x = vertices.row(v).matrix();
    double distance = 1e300;
    for (int n = near_start_[at]; n < near_start_[at + 1] && distance > greatest; ++n)
      distance = std::min(distance,
                          signed_distance(capsules[static_cast<std::size_t>(near_[static_cast<std::size_t>(n)])], x));
    for (std::size_t c = 0; c < capsules.size() && distance > greatest; ++c)
      distance = std::min(distance, signed_distance(capsules[c], x));
    greatest = std::max(greatest, distance);
  }
  return greatest;
}

}  // namespace hooke::human
