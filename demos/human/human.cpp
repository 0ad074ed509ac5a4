#include <hooke/error.hpp>
#include <human/clearance.hpp>
#include <human/footing.hpp>
#include <human/human.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

namespace hooke::human {
namespace {

using Quat = Eigen::Quaterniond;

constexpr double degree = std::numbers::pi / 180;
constexpr Stance rest_stance{.arms = 20 * degree, .elbows = 14 * degree, .legs = 0, .shoulder = 4 * degree};
constexpr Stance bind_stance{.arms = 48 * degree, .elbows = 10 * degree, .legs = 5 * degree, .shoulder = 0};

void require(bool holds, const std::string& rule, double value) {
  if (!holds) throw std::invalid_argument("Human: " + rule + ", got " + std::to_string(value));
}

double smootherstep(double u) { return u * u * u * (10 + u * (6 * u - 15)); }

// The rest stance with the arms raised until elbows, forearms and hands are clear of the trunk.
Stance clear_stance(const Body& body, double wanted) {
  const LimbGroups groups = limb_groups(body.capsules);
  std::vector<io::JointFrame> joints(static_cast<std::size_t>(body.motion.joint_count()));
  std::vector<Capsule> arm(groups.left_arm.size());
  std::vector<Capsule> trunk(groups.trunk.size());
  Stance stance = rest_stance;
  for (; wanted > 0 && stance.arms < 60 * degree; stance.arms += 0.5 * degree) {
    io::global_pose(body.motion, standing(body, stance), joints);
    place_capsules(groups.left_arm, joints, arm);
    place_capsules(groups.trunk, joints, trunk);
    if (nearest_pair(arm, trunk).gap > wanted) break;
  }
  return stance;
}

// Lowest point of the body in every frame.
std::vector<double> lowest_points(const Body& body, const io::Motion& motion) {
  std::vector<io::JointFrame> joints(static_cast<std::size_t>(motion.joint_count()));
  std::vector<Capsule> capsules(body.capsules.size());
  std::vector<double> lowest(static_cast<std::size_t>(motion.frame_count()));
  io::LocalPose pose;
  for (std::size_t f = 0; f < lowest.size(); ++f) {
    io::local_pose(motion, motion.first_time + static_cast<double>(f) / motion.frame_rate, pose);
    io::global_pose(motion, pose, joints);
    place_capsules(body.capsules, joints, capsules);
    lowest[f] = bottom(capsules);
  }
  return lowest;
}

// The lowest point while the body stands, carried over the leaps: there it is high or moves.
std::vector<double> floor_heights(const std::vector<double>& lowest, double frame_rate) {
  const std::size_t frames = lowest.size();
  std::vector<double> sorted = lowest;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<Index>(frames / 2), sorted.end());
  const double highest_floor = sorted[frames / 2] + 0.04;
  const double fast = 0.15;  // [m/s]
  std::vector<double> floor(frames, 0);
  std::optional<std::size_t> last;
  for (std::size_t f = 0; f < frames; ++f) {
    const double change = lowest[std::min(f + 1, frames - 1)] - lowest[f > 0 ? f - 1 : 0];
    if (lowest[f] > highest_floor || std::abs(change) * frame_rate / 2 > fast) continue;
    const std::size_t begin = last.value_or(0);
    const double from = lowest[last.value_or(f)];
    for (std::size_t g = begin; g <= f; ++g)
      floor[g] = from + (lowest[f] - from) * static_cast<double>(g - begin) /
                            static_cast<double>(std::max<std::size_t>(f - begin, 1));
    last = f;
  }
  for (std::size_t g = last.value_or(0); g < frames; ++g) floor[g] = lowest[last.value_or(0)];
  return floor;
}

// How far a body must be lifted that goes below the floor, a little before and after too.
std::vector<double> lifts(const std::vector<double>& lowest, double frame_rate) {
  const auto reach = static_cast<Index>(0.04 * frame_rate);
  std::vector<double> lift(lowest.size(), 0);
  for (std::size_t f = 0; f < lowest.size(); ++f)
    for (Index g = -reach; g <= reach; ++g) {
      const Index at = std::clamp<Index>(static_cast<Index>(f) + g, 0, static_cast<Index>(lowest.size()) - 1);
      lift[static_cast<std::size_t>(at)] = std::max(lift[static_cast<std::size_t>(at)], -0.001 - lowest[f]);
    }
  return lift;
}

void raise(io::Motion& motion, const std::vector<double>& heights, double cut_off) {
  io::Motion signal;  // filtered like the motion of one joint
  signal.names = {"height"};
  signal.frame_rate = motion.frame_rate;
  for (const double y : heights) signal.root_positions.emplace_back(0, y, 0);
  signal.rotations.assign(heights.size(), Quat::Identity());
  io::low_pass(signal, cut_off);
  for (std::size_t f = 0; f < heights.size(); ++f) motion.root_positions[f].y() += signal.root_positions[f].y();
}

}  // namespace

namespace {

// Room to evaluate a pose, one a thread.
struct Scratch {
  io::LocalPose pose;
  std::vector<io::JointFrame> frames;
  std::vector<Capsule> capsules;
  std::vector<DualQuaternion> motions;
};

Scratch& scratch(std::size_t joints, std::size_t capsules) {
  thread_local Scratch room;
  room.frames.resize(joints);
  room.capsules.resize(capsules);
  room.motions.resize(joints);
  return room;
}

}  // namespace

struct Human::Parts {
  HumanSettings settings;
  double freeze_time = 0;
  Body body;
  io::Motion shown;  // from rest to the frozen pose, not yet slowed down in the end
  std::optional<Skinning> skinning;

  double recording_time(double t) const;
  void pose(double t, std::span<io::JointFrame> out) const;
  io::LocalPose rest_pose() const;
  Index frame_at(double t) const;  // the first one not before t
  void make_shown();
  void keep_arms_clear();
  void stand_on_floor();
  void centre();
};

double Human::Parts::recording_time(double t) const {
  const double slowing = freeze_time - settings.settle;
  if (t <= slowing || settings.settle == 0) return settings.from + std::min(t, freeze_time);
  // Rate 1 - smoothstep(u), integrated.
  const double u = std::min((t - slowing) / settings.settle, 1.0);
  return settings.from + slowing + settings.settle * (u - u * u * u + u * u * u * u / 2);
}

void Human::Parts::pose(double t, std::span<io::JointFrame> out) const {
  io::LocalPose& local = scratch(out.size(), body.capsules.size()).pose;
  io::local_pose(shown, recording_time(t) - settings.from, local);
  io::global_pose(shown, local, out);
}

io::LocalPose Human::Parts::rest_pose() const {
  io::LocalPose begin;
  io::local_pose(body.motion, settings.from, begin);
  const Vec3 ahead = begin.rotations[0] * Vec3::UnitZ();
  io::LocalPose rest = standing(body, clear_stance(body, settings.limb_gap));
  rest.rotations[0] = Quat(Eigen::AngleAxisd(std::atan2(ahead.x(), ahead.z()), Vec3::UnitY())) * rest.rotations[0];
  rest.root.x() = begin.root.x();
  rest.root.z() = begin.root.z();
  return rest;
}

Index Human::Parts::frame_at(double t) const {
  return static_cast<Index>(std::ceil((t - shown.first_time) * shown.frame_rate - 1e-6));
}

// Frames of rest pose, blend and recording; beyond either end a few more, so that splines and
// filters know how it goes on. Playback slows down later, when a pose is asked for: whatever
// is corrected here comes to rest with it.
void Human::Parts::make_shown() {
  constexpr int margin = 30;
  const io::LocalPose rest = rest_pose();
  const double rate = 120;
  const double start = -(settings.hold + settings.blend_in);
  shown = body.motion;
  shown.frame_rate = rate;
  shown.first_time = std::floor(start * rate) / rate - margin / rate;
  shown.root_positions.clear();
  shown.rotations.clear();
  const double end = settings.until - settings.from;
  const int frames = static_cast<int>(std::ceil((end - shown.first_time) * rate)) + margin;
  io::LocalPose pose;
  for (int f = 0; f < frames; ++f) {
    const double t = shown.first_time + f / rate;
    const double w = smootherstep(std::clamp(1 + t / settings.blend_in, 0.0, 1.0));
    io::local_pose(body.motion, settings.from + t, pose);
    shown.root_positions.push_back(rest.root + w * (pose.root - rest.root));
    for (std::size_t j = 0; j < pose.rotations.size(); ++j) {
      Quat q = w < 1 ? rest.rotations[j].slerp(w, pose.rotations[j]) : pose.rotations[j];
      if (f > 0 && q.dot(shown.rotations[shown.rotations.size() - pose.rotations.size()]) < 0) q.coeffs() *= -1;
      shown.rotations.push_back(q);
    }
  }
}

void Human::Parts::keep_arms_clear() {
  if (settings.limb_gap == 0) return;
  constexpr double reach = 0.3;  // [s]
  human::keep_arms_clear(shown, body, settings.limb_gap, reach, frame_at(-settings.blend_in));
}

void Human::Parts::stand_on_floor() {
  std::vector<double> floor = floor_heights(lowest_points(body, shown), shown.frame_rate);
  for (double& y : floor) y = -y;
  raise(shown, floor, 5);
  for (int round = 0; round < 2; ++round) raise(shown, lifts(lowest_points(body, shown), shown.frame_rate), 6);
}

void Human::Parts::centre() {
  Vec3 low = Vec3::Constant(1e300);
  Vec3 high = -low;
  for (std::size_t f = 0; f < shown.root_positions.size(); ++f) {
    low = low.cwiseMin(shown.root_positions[f]);
    high = high.cwiseMax(shown.root_positions[f]);
  }
  const Vec3 middle = Vec3(1, 0, 1).cwiseProduct(low + high) / 2;
  for (Vec3& root : shown.root_positions) root -= middle;
}

Human::Human(const HumanSettings& settings) {
  require(settings.height > 0.1 && settings.height < 10, "height must be in (0.1, 10) m", settings.height);
  require(settings.until > settings.from, "until must come after from", settings.until);
  require(settings.settle >= 0 && settings.settle <= settings.until - settings.from,
          "settle must be in [0, until - from] s", settings.settle);
  require(settings.hold >= 0, "hold must not be negative", settings.hold);
  require(settings.blend_in > 0, "blend_in must be positive", settings.blend_in);
  require(settings.limb_gap >= 0 && settings.limb_gap < 0.1 * settings.height, "limb_gap must be in [0, height/10) m",
          settings.limb_gap);
  if (!std::filesystem::exists(settings.motion))
    throw Error("Human: there is no motion file " + settings.motion.string() +
                "; install the Debian package assimp-testmodels (apt-get install assimp-testmodels)");

  auto parts = std::make_shared<Parts>();
  parts->settings = settings;
  // Rounded, so that decimal settings give the decimal sum.
  parts->freeze_time = std::round((settings.until - settings.from + settings.settle / 2) * 1e9) / 1e9;
  parts->body = make_body(io::read_motion(settings.motion), settings.height);
  io::Motion& motion = parts->body.motion;
  require(settings.from - settings.blend_in >= motion.first_time, "the recording must have begun blend_in before from",
          settings.from);
  require(settings.until <= motion.last_time(), "until must lie within the recording", settings.until);
  io::low_pass(motion, settings.filter_hz);
  parts->make_shown();
  parts->stand_on_floor();
  if (settings.plant_feet) plant_feet(parts->shown, parts->frame_at(0));
  parts->keep_arms_clear();
  parts->centre();
  parts->skinning.emplace(parts->body, standing(parts->body, bind_stance), settings.skin);
  parts_ = std::move(parts);
}

double Human::start_time() const { return -(parts_->settings.hold + parts_->settings.blend_in); }

double Human::freeze_time() const { return parts_->freeze_time; }

double Human::recording_time(double t) const { return parts_->recording_time(t); }

Index Human::capsule_count() const { return static_cast<Index>(parts_->body.capsules.size()); }

const std::vector<BoneCapsule>& Human::bones() const { return parts_->body.capsules; }

const std::vector<std::string>& Human::joint_names() const { return parts_->body.motion.names; }

void Human::pose(double t, std::span<io::JointFrame> out) const {
  assert(out.size() == joint_names().size());
  parts_->pose(t, out);
}

void Human::capsules(double t, std::span<Capsule> out) const {
  auto& frames = scratch(joint_names().size(), out.size()).frames;
  parts_->pose(t, frames);
  place_capsules(parts_->body.capsules, frames, out);
}

const TriangleMesh& Human::skin() const { return parts_->skinning->mesh(); }

void Human::skin(double t, Points<double>& vertices) const {
  Scratch& room = scratch(joint_names().size(), parts_->body.capsules.size());
  parts_->pose(t, room.frames);
  place_capsules(parts_->body.capsules, room.frames, room.capsules);
  parts_->skinning->deform(room.frames, room.capsules, vertices);
}

double Human::skin_clearance(double t0, double t1, double rate) const {
  require(rate > 0, "rate must be positive", rate);
  std::vector<Capsule> now(parts_->body.capsules.size());
  Points<double> vertices;
  double greatest = -1;
  for (int i = 0; t0 + i / rate <= t1; ++i) {
    capsules(t0 + i / rate, now);
    skin(t0 + i / rate, vertices);
    greatest = parts_->skinning->greatest_distance(vertices, now, greatest);
  }
  return greatest;
}

Attachment Human::attach(const Points<double>& world_points, double t0) const {
  Attachment result = attach(world_points, t0, joint_names()[0]);
  Points<double> vertices;
  skin(t0, vertices);
  const auto& influences = parts_->skinning->influences();
  std::vector<double> weights(joint_names().size());
  for (Index p = 0; p < world_points.rows(); ++p) {
    const Values<double> squares = (vertices.rowwise() - world_points.row(p)).square().rowwise().sum();
    // The mean of the skin around the nearest vertex, so that neighbours get similar weights.
    constexpr double width2 = 0.02 * 0.02;  // [m²]
    const double nearest2 = squares.minCoeff();
    std::fill(weights.begin(), weights.end(), 0.0);
    for (Index v = 0; v < squares.size(); ++v) {
      if (squares[v] > nearest2 + 9 * width2) continue;
      const double w = std::exp((nearest2 - squares[v]) / (2 * width2));
      const Influence& influence = influences[static_cast<std::size_t>(v)];
      for (std::size_t k = 0; k < 4; ++k)
        weights[static_cast<std::size_t>(influence.joints[k])] += w * influence.weights[k];
    }
    Influence& to = result.influences[static_cast<std::size_t>(p)];
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto most = std::max_element(weights.begin(), weights.end());
      to.joints[k] = static_cast<int>(most - weights.begin());
      to.weights[k] = *most;
      sum += *most;
      *most = 0;
    }
    for (double& w : to.weights) w /= sum;
  }
  return result;
}

Attachment Human::attach(const Points<double>& world_points, double t0, const std::string& joint) const {
  const int found = parts_->body.motion.find(joint);
  if (found < 0) throw std::invalid_argument("Human::attach: there is no joint named " + joint);
  Attachment result;
  result.points = world_points;
  Influence rigid;
  rigid.joints.fill(found);
  result.influences.assign(static_cast<std::size_t>(world_points.rows()), rigid);
  result.bind_frames.resize(joint_names().size());
  parts_->pose(t0, result.bind_frames);
  return result;
}

void Human::attached(const Attachment& attachment, double t, Points<double>& out) const {
  Scratch& room = scratch(joint_names().size(), parts_->body.capsules.size());
  assert(attachment.bind_frames.size() == room.frames.size());
  parts_->pose(t, room.frames);
  for (std::size_t j = 0; j < room.frames.size(); ++j)
    room.motions[j] = motion_between(attachment.bind_frames[j], room.frames[j]);
  if (out.rows() != attachment.points.rows()) out.resize(attachment.points.rows(), 3);
  for (Index p = 0; p < out.rows(); ++p)
    out.row(p) = blend(attachment.influences[static_cast<std::size_t>(p)], room.motions,
                       attachment.points.row(p).matrix().transpose())
                     .array()
                     .transpose();
}

}  // namespace hooke::human
