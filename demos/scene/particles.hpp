// Particle systems of a scene: what the file says of one, how it is read, and the system that it becomes.
// Units and meaning of every key: docs/scene-files.md.
#pragma once

#include <hooke/particles/particle_system.hpp>
#include <hooke/world.hpp>
#include <scene/drive.hpp>
#include <scene/reader.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace hooke::scene {

/// What a kind is drawn as.
enum class Look { Spark, Smoke, Drop, Water };

struct ParticleKind {
  std::string name = "particle";
  Look look = Look::Spark;
  particles::ColorRamp color;
  std::optional<particles::Curve> temperature;  ///< [K] over age, instead of a color: sparks glow like a black body
  particles::Curve size = 1;                    ///< times the size at birth, over age
  double intensity = 1000;                      ///< sparks: times the color
  particles::Curve opacity = 1;                 ///< smoke and drops, over age
};

struct ParticleEmitter {
  particles::EmitterSettings settings;  ///< in shown time, positions relative to the origin; without mesh and path
  std::filesystem::path mesh;           ///< OBJ; empty: another form
  std::optional<Drive> motion;
};

struct Drag {
  bool quadratic = false;
  double coefficient = 0;  ///< [N s/m] or [N s²/m²]
  Vec3 wind{0, 0, 0};      ///< [m/s]
};
struct Attractor {
  Vec3 place{0, 0, 0};
  double strength = 0, radius = 0.1;  ///< [m³/s²], [m]
};
struct Turbulence {
  particles::CurlNoise<double>::Settings noise;
  double rate = 1;  ///< [1/s]
};
struct Vortex {
  Vec3 place{0, 0, 0}, axis{0, 1, 0};
  double circulation = 0, core = 0.1, updraught = 0;  ///< [m²/s], [m], [m/s]
  double rate = 1;                                    ///< [1/s]
};
struct VelocityField {
  std::filesystem::path file;  ///< OpenVDB
  std::string grid;            ///< empty: the first vector grid
  Vec3 place{0, 0, 0};         ///< where the file's zero is
  double rate = 1;             ///< [1/s]
};
struct Repulsion {
  double stiffness = 0, distance = 0.1;  ///< [1/s²], [m]
};
using ParticleForce = std::variant<Drag, Attractor, Turbulence, Vortex, VelocityField, Repulsion>;

struct ParticleBody {
  std::string path;                      ///< in the file, for messages: bodies[0]
  particles::ParticleSettings settings;  ///< without kinds
  std::vector<ParticleKind> kinds;
  std::vector<ParticleEmitter> emitters;
  std::vector<ParticleForce> forces;
  std::vector<particles::SubEmitterSettings> sub_emitters;
  bool in_double = false;  ///< precision
};

/// @param number its place among the bodies: part of names and seeds that are not given
/// @param folder where the files that it names are looked up; they are not opened yet
ParticleBody read_particles(const Value& value, std::size_t number, const std::filesystem::path& folder);

/// Sets what is given on the command line. Throws hooke::Error where particles have no such method or precision.
void override_solver(ParticleBody& body, const std::string& method, double dt, const std::string& precision);

/// One picture's worth of a system, one row a particle.
struct ParticleView {
  Points<float> positions, velocities, colors;  ///< [m], [m/s], linear RGB of the kinds' ramps
  Values<float> radii, ages, lives;             ///< as drawn [m], [s], share of life that is over; 0 without end
  std::vector<int> kinds;
  std::vector<std::uint64_t> serials;  ///< number of birth
};

/// A system in a world, of either precision.
class SceneParticles {
 public:
  /// Builds it and adds it to the world; its clock is the shown time, `preroll` behind the world's.
  /// @throws hooke::Error "FILE: PATH: …"
  SceneParticles(const ParticleBody& description, const std::string& file, double preroll, World& world);

  Body& body() const { return *body_; }
  const std::vector<ParticleKind>& kinds() const { return kinds_; }
  const particles::ParticleSettings& settings() const;
  const particles::Counts& counts() const;
  /// Places of the last ticks of a particle, as ParticleSystem::trail.
  Index trail(Index i, Points<float>& out) const;
  ParticleView view() const;
  /// Forces, emitters and so on, in a line.
  std::string text() const;

 private:
  Body* body_ = nullptr;  // in the world
  std::variant<particles::ParticleSystem<float>*, particles::ParticleSystem<double>*> system_;
  std::vector<ParticleKind> kinds_;
  std::size_t forces_ = 0, sub_emitters_ = 0;
};

}  // namespace hooke::scene
