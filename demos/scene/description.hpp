// What a scene file says, as plain data: one struct an object of the file, its members named
// like the keys and holding their defaults. Units and meaning of every key: docs/scene-files.md.
#pragma once

#include <hooke/softbody/soft_body.hpp>
#include <scene/cape.hpp>
#include <scene/drive.hpp>
#include <scene/particles.hpp>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace hooke::scene {

/// Points by index or as an edge of a grid ("top", "bottom-left", …) or a face, edge or corner of a lattice.
using PointChoice = std::variant<Index, std::string>;

struct PinDrive {
  std::vector<PointChoice> points;
  Drive drive;
};

struct RawPoints {
  Points<double> points{0, 3};
  Points<double> velocities{0, 3};
  Values<double> masses;
  softbody::SpringNetwork network;
  std::vector<Index> pins;
};
struct Grid {
  double width = 1, height = 1;  ///< "size"
  int columns = 2, rows = 2;     ///< "points"
  Vec3 right{1, 0, 0}, down{0, -1, 0};
};
struct MeshFile {
  std::filesystem::path file;
};
struct LatticeBox {
  Vec3 size{1, 1, 1};
  std::array<int, 3> points{2, 2, 2};
  Vec3 center{0, 0, 0};          ///< of the box, relative to the body's origin [m]
  Mat3 turn = Mat3::Identity();  ///< "rotation"
};
struct CapeCut {
  std::string human;  ///< name of a human collider
  double width = 0.9, height = 1.2;
  int columns = 60, rows = 80;
};

/// Springs with fixed constants on a grid of equal masses: the classical mass-spring sheet.
struct FixedMaterial {
  double mass = 1;                             ///< total [kg]
  double structural = 0, shear = 0, bend = 0;  ///< "stiffness" of each spring [N/m]
  double damping = 0;                          ///< of each spring [N·s/m]
};
/// The last two are for lattices.
using Material =
    std::variant<softbody::ClothMaterial, FixedMaterial, softbody::LatticeMaterial, softbody::FixedLatticeMaterial>;

struct Solver {
  double error = 0;  ///< wanted, as a share of the body's size: the chooser picks all below; 0: they are given
  std::string method = "velocity-verlet";
  double dt = 0;            ///< [s]; 0: automatic
  double tolerance = 1e-6;  ///< of adaptive methods with dt = 0 [m], as MotionSettings::tolerance
  int iterations = 0;       ///< of xpbd, as MotionSettings::iterations; 0: its default
  double wanted_error = 0;  ///< of filtered-leapfrog [m], as SoftBodySettings::wanted_error; 0: none
  softbody::Precision precision = softbody::Precision::Automatic;  // particles: float
  bool compensated = true;                                         ///< as MotionSettings
  int retries = 0;                                                 ///< as MotionSettings
};

/// What a soft body's surface is drawn as.
enum class BodyLook { Cloth, Jelly };

struct SoftBody {
  std::string name;
  std::string path;  ///< in the file, for messages: bodies[0]
  Vec3 origin{0, 0, 0};
  std::variant<RawPoints, Grid, MeshFile, CapeCut, LatticeBox> form;
  Material material;
  std::vector<PointChoice> pin;
  std::vector<PinDrive> pin_motion;
  std::optional<softbody::Wind> wind;  ///< times as shown
  double linear_drag = 0, quadratic_drag = 0;
  double thickness = 0;
  std::optional<Vec3> color, inside_color;
  BodyLook look = BodyLook::Cloth;  ///< lattices: jelly where the file does not say
  Solver solver;
};

struct MovingShape {
  Shape shape;
  std::optional<Drive> motion;
};

/// Solids that become level sets.
struct MeshForm {
  std::filesystem::path file;  ///< OBJ, closed
};
struct LatheForm {
  std::vector<std::array<double, 2>> profile;  ///< radius and height [m], as turned_on_lathe
  Vec3 axis{0, 1, 0};                          ///< where heights grow to; any length
};
struct VolumeForm {
  std::filesystem::path file;  ///< OpenVDB
  std::string grid;            ///< empty: the first level set
};
struct MovingForm {
  std::variant<MeshForm, LatheForm, VolumeForm> form;
  Vec3 origin{0, 0, 0};  ///< where the form's zero is [m]
  double voxel = 0;      ///< [m]; 0: a 128th of the longest side; not for volumes
  std::optional<Drive> motion;
};

/// What a collider is drawn as.
enum class Surface { Matte, Stone, Steel, Water };

struct ColliderDescription {
  std::string name;
  std::string path;
  std::variant<MovingShape, human::HumanSettings, MovingForm> solid;
  double friction = 0.3, restitution = 0;
  Surface look = Surface::Matte;
  std::optional<Vec3> color;
};

struct CameraDescription {
  Vec3 eye{0, 1.3, 5}, target{0, 0.9, 0};
  double fov = 30;       ///< [degrees]
  Vec3 origin{0, 0, 0};  ///< in the world [m]; everything is drawn relative to it, and so are eye and target
  bool follow = false;   ///< eye and target are relative to where the first human walks
};

struct SceneDescription {
  std::string file;   ///< what messages call it
  std::string title;  ///< one line, may be empty
  Vec3 gravity{0, -9.81, 0};
  double damping = 0;
  double duration = 2, frame_rate = 60, tick_rate = 240, preroll = 0;
  double poster = -1;  ///< moment of a still picture [s]; < 0: the middle
  std::vector<SoftBody> bodies;
  std::vector<ParticleBody> particles;
  std::vector<ColliderDescription> colliders;
  std::optional<CameraDescription> camera;
};

}  // namespace hooke::scene
