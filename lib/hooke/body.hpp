// What the world and its users know of a body: points at a double border, whatever the
// precision inside.
#pragma once

#include <hooke/checkpoint.hpp>
#include <hooke/collider.hpp>
#include <hooke/gang.hpp>
#include <hooke/method.hpp>
#include <hooke/types.hpp>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace hooke {

/// How a tick went.
struct StepReport {
  enum class Status {
    Good,
    NotFinite,     ///< a position or velocity became infinite or NaN
    NotConverged,  ///< an implicit solve missed its tolerance
    EnergyGrew,    ///< more energy than there can be
    StepTooLong,   ///< a substep above the largest that is surely stable; only ever a warning
  };
  Status status = Status::Good;
  std::string body;    ///< its name
  Index point = -1;    ///< in user order; -1: no single point
  double time = 0;     ///< [s], start of the tick that failed; the body keeps its state of that time
  std::string advice;  ///< what to change

  bool good() const { return status == Status::Good; }
  /// One line for people.
  std::string text() const;
};

struct Energy {
  double kinetic = 0;        ///< [J], free points
  double gravitational = 0;  ///< [J], -m g · x of the free points, 0 at the world's origin
  double elastic = 0;        ///< [J], of all force fields that have a potential
  double total() const { return kinetic + gravitational + elastic; }
};

/// How a body is moved.
struct MotionFacts {
  std::string method;            ///< its name; empty: the body is not moved by one
  std::string precision;         ///< "float", "double" or "double-float"
  Index substeps = 0;            ///< of the last tick
  double stable_step = 0;        ///< [s], in the present state; infinity: any; 0: none
  double wanted_dt = 0;          ///< [s]; 0: automatic
  bool velocity_forces = false;  ///< drag or dampers act at every stage; some methods refuse them
  std::int64_t evaluations = 0;  ///< of all forces, since creation
  std::int64_t products = 0;     ///< of stiffness and damping with a vector, in implicit solves, since creation
};

/// One tick, as the world hands it to a body.
struct Tick {
  double start = 0, end = 0;  ///< [s]
  Vec3 gravity{0, 0, 0};      ///< [m/s²]
  std::span<const Collider> colliders;
  Gang* gang = nullptr;  ///< threads for this body alone, or null
};

/// Writes where driven points are at time t: world coordinates [m], shape (driven count, 3).
/// The same t must give the same positions.
using PinMotion = std::function<void(double t, Points<double>& positions)>;

/// A set of point masses that moves itself. All arguments and results are in world
/// coordinates, double, SI units and user order. Indices outside [0, size()) throw
/// std::out_of_range, values that are not finite std::invalid_argument.
class Body {
 public:
  explicit Body(std::string name) : name_(std::move(name)) {}
  virtual ~Body() = default;
  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;

  const std::string& name() const { return name_; }

  /// Bodies without physics are skipped by the world's step.
  bool has_physics() const { return has_physics_; }
  void set_physics(bool on) { has_physics_ = on; }

  virtual Index size() const = 0;
  virtual Points<double> positions() const = 0;   ///< [m], (n, 3)
  virtual Points<double> velocities() const = 0;  ///< [m/s], (n, 3)
  virtual Values<double> masses() const = 0;      ///< [kg], (n)
  /// Between the last two ticks, for drawing: fraction 0 = the tick before, 1 = the last.
  virtual Points<double> positions_between(double fraction) const = 0;
  virtual Points<double> start_positions() const = 0;  ///< at creation

  virtual void set_position(Index point, const Vec3& position) = 0;  ///< a jump, adds no velocity
  virtual void set_velocity(Index point, const Vec3& velocity) = 0;

  /// Holds a point where it is. A pinned point has inverse mass 0 and keeps its mass.
  virtual void pin(Index point) = 0;
  virtual void release(Index point) = 0;
  virtual bool pinned(Index point) const = 0;
  /// Moves a pinned point on a straight line over the coming frame's ticks, exactly there at the last.
  virtual void move_pin(Index point, const Vec3& target) = 0;
  /// Pins points and drives them by time, evaluated at every stage of every substep.
  virtual void drive_pins(std::vector<Index> points, PinMotion motion) = 0;

  /// Adds a force [N] on a point for the coming frame; forces add up.
  virtual void add_force(Index point, const Vec3& force) = 0;
  /// Drops the forces added since the last frame.
  virtual void clear_forces() = 0;

  virtual Energy energy(const Vec3& gravity) const = 0;
  virtual Vec3 momentum() const = 0;  ///< [kg m/s], free points

  /// True where it has come to rest and its steps are skipped until something wakes it: a touch, an
  /// edit, a force, a moved pin, other gravity.
  virtual bool asleep() const { return false; }
  virtual void wake() {}

  /// What was noticed and did not stop it, each kind once until it has gone; cleared by the call.
  virtual std::vector<StepReport> take_warnings() { return {}; }

  /// How it is moved. Costs as much as stable_step.
  virtual MotionFacts motion_facts() const { return {}; }
  /// The largest stable substep [s] that `method` would have in the present state, as
  /// largest_stable_step, whether or not it accepts the body's forces. Cost: about one evaluation.
  virtual double stable_step(const Method& method) const;

  double total_mass() const { return masses().sum(); }

  /// Displacement since creation of a point, or of the centre of mass [m].
  Vec3 displacement(Index point) const;
  Vec3 displacement() const;
  double speed(Index point) const;                        ///< [m/s]
  double weight(Index point, const Vec3& gravity) const;  ///< [N] = mass × |gravity|

  // What the world calls, in this order.
  /// A frame begins: forces added so far become an impulse bank of `seconds`; `waiting` seconds of
  /// earlier frames have not been simulated yet; pins move over [t0, t1].
  virtual void begin_frame(double seconds, double waiting, double t0, double t1) = 0;
  virtual StepReport advance(const Tick& tick) = 0;
  /// Another body failed in this tick: back to the state before it.
  virtual void take_back() = 0;
  /// Global damping: free velocities times `factor`.
  virtual void damp(double factor) = 0;

  // Checkpoints, between frames. A body that adds state to a base calls the base's first, in each of the three.
  /// What `save` leaves out because the program that builds the world gives it: settings, forces, functions.
  virtual void describe(Blueprint& out) const;
  /// Everything that changes while time goes on.
  /// @throws std::invalid_argument where a kind of body cannot be saved, which is what this base does
  virtual void save(CheckpointWriter& out) const;
  /// Takes over what `save` wrote of a body of the same description; from here on every bit is as it would have
  /// been there. May throw half-way: the world loads what was there before.
  virtual void load(CheckpointReader& in);

 private:
  std::string name_;
  bool has_physics_ = true;
};

}  // namespace hooke
