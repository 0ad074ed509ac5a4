#include <human/footing.hpp>

#include <algorithm>
#include <cmath>

namespace hooke::human {
namespace {

using Quat = Eigen::Quaterniond;

// Frames first … last in which a foot stands.
struct Standing {
  Index first = 0;
  Index last = 0;
};

constexpr double low = 0.03;   // [m] how far a standing ball may be above its lowest
constexpr double slow = 0.4;   // [m/s] how fast it may drift
constexpr double brief = 0.1;  // [s] shorter contacts are left alone

Vec3 horizontal(const Vec3& v) { return {v.x(), 0, v.z()}; }

// When a ball with this path stands.
std::vector<Standing> find_stances(const std::vector<Vec3>& ball, double frame_rate, Index begin) {
  double floor = 1e300;
  for (const Vec3& x : ball) floor = std::min(floor, x.y());
  std::vector<Standing> stances;
  bool stood = false;
  for (Index f = std::max<Index>(begin, 1); f + 1 < static_cast<Index>(ball.size()); ++f) {
    const auto at = static_cast<std::size_t>(f);
    const double speed = horizontal(ball[at + 1] - ball[at - 1]).norm() * frame_rate / 2;
    const bool stands = ball[at].y() < floor + low && speed < slow;
    if (stands && !stood) stances.push_back({f, f});
    if (stands) stances.back().last = f;
    stood = stands;
  }
  std::erase_if(stances, [&](const Standing& s) { return static_cast<double>(s.last - s.first) < brief * frame_rate; });
  return stances;
}

// The shift that holds the ball at its mean place in every stance; from one to the next a cubic
// that continues place and velocity.
std::vector<Vec3> find_shifts(const std::vector<Vec3>& ball, const std::vector<Standing>& stances, Index begin) {
  const auto frames = static_cast<Index>(ball.size());
  std::vector<Vec3> shifts(ball.size(), Vec3::Zero());
  const auto at = [&](Index f) -> Vec3& { return shifts[static_cast<std::size_t>(f)]; };
  Index from = begin;  // the last frame that is known
  Vec3 rate = Vec3::Zero();
  const auto go_over = [&](Index to, const Vec3& place, const Vec3& rate_there) {
    const auto n = static_cast<double>(to - from);
    const Vec3 start = at(from);
    for (Index f = from + 1; f < to; ++f) {
      const double u = static_cast<double>(f - from) / n;
      at(f) = start + (3 - 2 * u) * u * u * (place - start) + n * u * (1 - u) * ((1 - u) * rate - u * rate_there);
    }
  };
  for (const Standing& s : stances) {
    Vec3 mean = Vec3::Zero();
    for (Index f = s.first; f <= s.last; ++f) mean += ball[static_cast<std::size_t>(f)];
    mean /= static_cast<double>(s.last - s.first + 1);
    const auto held = [&](Index f) { return horizontal(mean - ball[static_cast<std::size_t>(f)]); };
    go_over(s.first, held(s.first), held(s.first + 1) - held(s.first));
    for (Index f = s.first; f <= s.last; ++f) at(f) = held(f);
    from = s.last;
    rate = held(s.last) - held(s.last - 1);
  }
  if (!stances.empty())
    for (Index f = from + 1; f < frames; ++f) at(f) = at(from);
  return shifts;
}

// Smooth where stance and swing meet.
void smooth(std::vector<Vec3>& shifts, double frame_rate, double cut_off) {
  io::Motion signal;
  signal.names = {"shift"};
  signal.frame_rate = frame_rate;
  signal.root_positions = shifts;
  signal.rotations.assign(shifts.size(), Quat::Identity());
  io::low_pass(signal, cut_off);
  shifts = std::move(signal.root_positions);
}

// A leg that is moved at its foot.
struct Leg {
  std::size_t hip, knee, ankle, ball;

  Leg(const io::Motion& motion, const std::string& side) {
    const auto find = [&](const char* name) { return static_cast<std::size_t>(motion.find(side + name)); };
    hip = find("UpLeg");
    knee = find("Leg");
    ankle = find("Foot");
    ball = find("ToeBase");
  }

  // Two-bone inverse kinematics: bend the knee to the right distance, then turn the leg at the
  // hip; the foot keeps its direction. `local` are the rotations of one frame.
  void shift_foot(const io::Motion& motion, const Vec3& shift, std::span<const io::JointFrame> global,
                  Quat* local) const {
    if (shift.isZero(0)) return;
    const Vec3 thigh = global[knee].position - global[hip].position;
    const Vec3 shank = global[ankle].position - global[knee].position;
    const Vec3 before = thigh + shank;
    const Vec3 wanted = before + shift;
    const double a = thigh.norm();
    const double b = shank.norm();
    const double reach = std::min(wanted.norm(), std::max(before.norm(), 0.998 * (a + b)));
    // The hinge as it is; knees bend backward.
    const Vec3 side = global[hip].rotation * Vec3::UnitX();
    Vec3 hinge = thigh.cross(shank) + 1e-4 * side;
    hinge.normalize();
    const auto inner = [&](double c) {
      return std::acos(std::clamp((a * a + b * b - c * c) / (2 * a * b), -1.0, 1.0));
    };
    const Quat bend(Eigen::AngleAxisd(inner(before.norm()) - inner(reach), hinge));
    const Quat swing = Quat::FromTwoVectors(thigh + bend * shank, wanted);
    const Quat new_hip = swing * global[hip].rotation;
    const Quat new_knee = swing * bend * global[knee].rotation;
    const auto parent = static_cast<std::size_t>(motion.parents[hip]);
    set(local[hip], global[parent].rotation.conjugate() * new_hip);
    set(local[knee], new_hip.conjugate() * new_knee);
    set(local[ankle], new_knee.conjugate() * global[ankle].rotation);
  }

 private:
  // Keeps the sign, so that neighbouring frames still agree.
  static void set(Quat& to, Quat q) {
    if (q.dot(to) < 0) q.coeffs() *= -1;
    to = q.normalized();
  }
};

}  // namespace

void plant_feet(io::Motion& motion, Index begin) {
  const auto frames = static_cast<std::size_t>(motion.frame_count());
  const auto joints = static_cast<std::size_t>(motion.joint_count());
  std::vector<std::vector<io::JointFrame>> global(frames, std::vector<io::JointFrame>(joints));
  io::LocalPose pose;
  for (std::size_t f = 0; f < frames; ++f) {
    io::local_pose(motion, motion.first_time + static_cast<double>(f) / motion.frame_rate, pose);
    io::global_pose(motion, pose, global[f]);
  }
  for (const char* side : {"Left", "Right"}) {
    const Leg leg(motion, side);
    std::vector<Vec3> ball;
    for (const auto& frame : global) ball.push_back(frame[leg.ball].position);
    std::vector<Vec3> shifts = find_shifts(ball, find_stances(ball, motion.frame_rate, begin), begin);
    smooth(shifts, motion.frame_rate, 8);
    for (std::size_t f = 0; f < frames; ++f)
      leg.shift_foot(motion, shifts[f], global[f], motion.rotations.data() + f * joints);
  }
}

}  // namespace hooke::human
