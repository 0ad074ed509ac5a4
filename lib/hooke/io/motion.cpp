#include <hooke/error.hpp>
#include <hooke/io/motion.hpp>

#include <assimp/config.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <stdexcept>

namespace hooke::io {
namespace {

using Quat = Eigen::Quaterniond;

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& what) {
  throw Error("read_motion: " + file.string() + ": " + what);
}

std::string read_text(const std::filesystem::path& file) {
  std::error_code code;
  if (!std::filesystem::exists(file, code)) fail(file, "no such file");
  if (!std::filesystem::is_regular_file(file, code)) fail(file, "not a regular file");
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (stream.bad() || !stream.is_open()) fail(file, "cannot be read");
  return text;
}

void add_joints(const aiNode& node, int parent, Motion& motion) {
  const int self = static_cast<int>(motion.names.size());
  const aiMatrix4x4& m = node.mTransformation;
  motion.names.emplace_back(node.mName.C_Str());
  motion.parents.push_back(parent);
  motion.offsets.emplace_back(m.a4, m.b4, m.c4);
  for (unsigned c = 0; c < node.mNumChildren; ++c) add_joints(*node.mChildren[c], self, motion);
}

void add_frames(const std::filesystem::path& file, const aiAnimation& animation, Motion& motion) {
  const Index joints = motion.joint_count();
  std::map<std::string, const aiNodeAnim*, std::less<>> channels;
  Index frames = 0;
  for (unsigned c = 0; c < animation.mNumChannels; ++c) {
    const aiNodeAnim* channel = animation.mChannels[c];
    channels[channel->mNodeName.C_Str()] = channel;
    frames = std::max<Index>(frames, channel->mNumRotationKeys);
  }
  if (frames < 1) fail(file, "has no frames");
  motion.root_positions.assign(static_cast<std::size_t>(frames), motion.offsets[0]);
  motion.rotations.assign(static_cast<std::size_t>(frames * joints), Quat::Identity());
  for (Index j = 0; j < joints; ++j) {
    const auto found = channels.find(motion.names[static_cast<std::size_t>(j)]);
    if (found == channels.end()) continue;
    const aiNodeAnim& channel = *found->second;
    const unsigned keys = channel.mNumRotationKeys;
    if (keys > 1 && keys != static_cast<unsigned>(frames)) fail(file, "joints differ in frames");
    for (Index f = 0; f < frames && keys > 0; ++f) {
      const aiQuaternion& q = channel.mRotationKeys[keys > 1 ? f : 0].mValue;
      Quat& to = motion.rotations[static_cast<std::size_t>(f * joints + j)];
      to = Quat(q.w, q.x, q.y, q.z);
      if (!(std::abs(to.norm() - 1) < 1e-2)) fail(file, "a rotation is not a number");
      to.normalize();
    }
    if (j != 0) continue;
    for (Index f = 0; f < frames && channel.mNumPositionKeys > 0; ++f) {
      const unsigned key = channel.mNumPositionKeys > 1 ? static_cast<unsigned>(f) : 0;
      if (key >= channel.mNumPositionKeys) fail(file, "the root has too few positions");
      const aiVector3D& p = channel.mPositionKeys[key].mValue;
      motion.root_positions[static_cast<std::size_t>(f)] = Vec3(p.x, p.y, p.z);
      if (!motion.root_positions[static_cast<std::size_t>(f)].allFinite())
        fail(file, "a root position is not a number");
    }
  }
}

// What the header says; the importer makes up a frame when there is none.
long promised_frames(const std::filesystem::path& file, const std::string& text) {
  const std::size_t motion = text.find("MOTION");
  const std::size_t key = motion == std::string::npos ? motion : text.find("Frames:", motion);
  if (key == std::string::npos) fail(file, "has no frames: the MOTION part is missing or cut off");
  const long frames = std::strtol(text.c_str() + key + 7, nullptr, 10);
  if (frames < 1) fail(file, "has no frames: Frames must be positive, got " + std::to_string(frames));
  return frames;
}

void make_signs_continuous(Motion& motion) {
  const auto joints = static_cast<std::size_t>(motion.joint_count());
  for (std::size_t i = joints; i < motion.rotations.size(); ++i)
    if (motion.rotations[i].dot(motion.rotations[i - joints]) < 0) motion.rotations[i].coeffs() *= -1;
}

// weights[k], k = 0 ... half, of a Gaussian with the given cut-off; they sum to 1 over ±half.
std::vector<double> gaussian_weights(double cut_off, double frame_rate) {
  const double sigma = std::sqrt(std::numbers::ln2) * frame_rate / (2 * std::numbers::pi * cut_off);
  std::vector<double> weights(static_cast<std::size_t>(std::ceil(4 * sigma)) + 1);
  double sum = 0;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const double z = static_cast<double>(k) / sigma;
    weights[k] = std::exp(-z * z / 2);
    sum += (k == 0 ? 1 : 2) * weights[k];
  }
  for (double& w : weights) w /= sum;
  return weights;
}

// Filters column after column in place; at(f) gives a reference to frame f's vector.
template <class Vector, class At>
void filter_signal(Index frames, const std::vector<double>& weights, const At& at) {
  std::vector<Vector> raw(static_cast<std::size_t>(frames));
  for (Index f = 0; f < frames; ++f) raw[static_cast<std::size_t>(f)] = at(f);
  const auto sample = [&](Index f) -> Vector {
    const Index last = frames - 1;
    if (f < 0) return 2 * raw.front() - raw[static_cast<std::size_t>(std::min(-f, last))];
    if (f > last) return 2 * raw.back() - raw[static_cast<std::size_t>(std::max<Index>(2 * last - f, 0))];
    return raw[static_cast<std::size_t>(f)];
  };
  for (Index f = 0; f < frames; ++f) {
    Vector sum = weights[0] * raw[static_cast<std::size_t>(f)];
    for (std::size_t k = 1; k < weights.size(); ++k)
      sum += weights[k] * (sample(f - static_cast<Index>(k)) + sample(f + static_cast<Index>(k)));
    at(f) = sum;
  }
}

}  // namespace

int Motion::find(std::string_view name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

Motion read_motion(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  const std::size_t start = text.find_first_not_of(" \t\r\n");
  if (start == std::string::npos) fail(file, "is empty");
  if (text.compare(start, 9, "HIERARCHY") != 0) fail(file, "is not a BVH file: it must start with HIERARCHY");
  const long promised = promised_frames(file, text);
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  const aiScene* scene = nullptr;
  try {
    scene = importer.ReadFileFromMemory(text.data(), text.size(), 0, "bvh");
  } catch (const std::exception& e) {
    fail(file, std::string("broken or truncated: ") + e.what());
  }
  if (scene == nullptr) fail(file, std::string("broken or truncated: ") + importer.GetErrorString());
  if (scene->mRootNode == nullptr) fail(file, "has no joints");
  Motion motion;
  add_joints(*scene->mRootNode, -1, motion);
  if (scene->mNumAnimations == 0) fail(file, "has no frames: the MOTION part is missing");
  const aiAnimation& animation = *scene->mAnimations[0];
  if (animation.mNumChannels == 0) fail(file, "has no joints");
  motion.frame_rate = animation.mTicksPerSecond;
  if (!(motion.frame_rate > 0) || !std::isfinite(motion.frame_rate)) fail(file, "the frame time must be positive");
  add_frames(file, animation, motion);
  if (motion.frame_count() != promised)
    fail(file, "promises " + std::to_string(promised) + " frames and has " + std::to_string(motion.frame_count()));
  make_signs_continuous(motion);
  return motion;
}

void drop_frames(Motion& motion, Index count) {
  if (count < 0 || count >= motion.frame_count())
    throw std::invalid_argument("drop_frames: count must be in [0, " + std::to_string(motion.frame_count()) +
                                "), got " + std::to_string(count));
  motion.root_positions.erase(motion.root_positions.begin(), motion.root_positions.begin() + count);
  motion.rotations.erase(motion.rotations.begin(), motion.rotations.begin() + count * motion.joint_count());
  motion.first_time += static_cast<double>(count) / motion.frame_rate;
}

void scale(Motion& motion, double factor) {
  if (!(factor > 0) || !std::isfinite(factor))
    throw std::invalid_argument("scale: factor must be positive, got " + std::to_string(factor));
  for (Vec3& offset : motion.offsets) offset *= factor;
  for (Vec3& position : motion.root_positions) position *= factor;
}

void low_pass(Motion& motion, double cut_off) {
  if (!(cut_off > 0) || !std::isfinite(cut_off))
    throw std::invalid_argument("low_pass: cut_off must be positive, got " + std::to_string(cut_off) + " Hz");
  const std::vector<double> weights = gaussian_weights(cut_off, motion.frame_rate);
  const Index frames = motion.frame_count();
  const Index joints = motion.joint_count();
  filter_signal<Vec3>(frames, weights,
                      [&](Index f) -> Vec3& { return motion.root_positions[static_cast<std::size_t>(f)]; });
  for (Index j = 0; j < joints; ++j)
    filter_signal<Eigen::Vector4d>(frames, weights, [&](Index f) -> Eigen::Vector4d& {
      return motion.rotations[static_cast<std::size_t>(f * joints + j)].coeffs();
    });
  for (Quat& q : motion.rotations) q.normalize();
}

void local_pose(const Motion& motion, double time, LocalPose& out) {
  assert(motion.frame_count() > 0);
  const auto joints = static_cast<std::size_t>(motion.joint_count());
  const Index last = motion.frame_count() - 1;
  const double at = std::clamp((time - motion.first_time) * motion.frame_rate, 0.0, static_cast<double>(last));
  const Index frame = std::min(static_cast<Index>(at), std::max<Index>(last - 1, 0));
  const double u = at - static_cast<double>(frame);
  const double u2 = u * u;
  const double u3 = u2 * u;
  const double w[4] = {(-u + 2 * u2 - u3) / 2, (2 - 5 * u2 + 3 * u3) / 2, (u + 4 * u2 - 3 * u3) / 2, (u3 - u2) / 2};
  std::size_t frames[4];
  for (Index k = 0; k < 4; ++k) frames[k] = static_cast<std::size_t>(std::clamp<Index>(frame + k - 1, 0, last));

  if (out.rotations.size() != joints) out.rotations.resize(joints);
  out.root.setZero();
  for (int k = 0; k < 4; ++k) out.root += w[k] * motion.root_positions[frames[k]];
  const Quat* row[4];
  for (int k = 0; k < 4; ++k) row[k] = motion.rotations.data() + frames[k] * joints;
  for (std::size_t j = 0; j < joints; ++j) {
    Eigen::Vector4d q =
        w[0] * row[0][j].coeffs() + w[1] * row[1][j].coeffs() + w[2] * row[2][j].coeffs() + w[3] * row[3][j].coeffs();
    out.rotations[j].coeffs() = q / std::sqrt(q.squaredNorm());
  }
}

void global_pose(const Motion& motion, const LocalPose& pose, std::span<JointFrame> out) {
  const auto joints = static_cast<std::size_t>(motion.joint_count());
  assert(out.size() == joints && pose.rotations.size() == joints);
  for (std::size_t j = 0; j < joints; ++j) {
    const int parent = motion.parents[j];
    if (parent < 0) {
      out[j] = {pose.root, pose.rotations[j]};
      continue;
    }
    const JointFrame& above = out[static_cast<std::size_t>(parent)];
    out[j].position = above * motion.offsets[j];
    out[j].rotation = above.rotation * pose.rotations[j];
  }
}

}  // namespace hooke::io
