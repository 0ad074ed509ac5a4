// The world: bodies, colliders, gravity, damping and the clock. One step reads from top to
// bottom in World::step.
#pragma once

#include <hooke/body.hpp>
#include <hooke/clock.hpp>

#include <iosfwd>
#include <memory>

namespace hooke {

/// Calls work(i) for every i in [0, n), in any order and on any threads, and returns when all
/// are done. Set your engine's thread pool here; bodies are independent within a tick, so the
/// result has the same bits at any thread count.
using ParallelFor = std::function<void(Index n, const std::function<void(Index)>& work)>;

/// The tutorial's PhysicsSystem.
class World {
 public:
  /// @param tick_rate ticks per second, > 0
  explicit World(double tick_rate = 240) : clock_(tick_rate) {}

  /// Adds a body and returns it. Names must be unique (std::invalid_argument).
  Body& add(std::unique_ptr<Body> body);
  template <class B>
  B& add(std::unique_ptr<B> body) {
    B& added = *body;
    add(std::unique_ptr<Body>(std::move(body)));
    return added;
  }
  const std::vector<std::unique_ptr<Body>>& bodies() const { return bodies_; }
  /// The body of that name, or nullptr.
  Body* find(const std::string& name) const;

  /// Adds a collider; bodies meet it from the next tick on.
  void add_collider(Collider collider);
  const std::vector<Collider>& colliders() const { return colliders_; }

  void set_gravity(const Vec3& gravity);  ///< [m/s²]; wakes what sleeps where it is another
  void enable_gravity(bool on) { gravity_on_ = on; }
  Vec3 gravity() const { return gravity_on_ ? gravity_ : Vec3(Vec3::Zero()); }

  /// Global damping: the fraction of velocity lost per second, in [0, 1). Not spring damping
  /// [N·s/m] and not a damping ratio.
  void set_damping(double fraction_per_second);
  double damping() const { return damping_; }

  void set_parallel_for(ParallelFor parallel_for) { parallel_for_ = std::move(parallel_for); }

  /// Threads that share the work on one body, where it is large enough and bodies are not moved in
  /// parallel; the same bits at any number. 1: none but the caller's.
  /// @throws std::invalid_argument below 1
  void set_threads(int threads);

  /// Drops forces added since the last update (update does so itself at its end).
  void clear_forces();

  /// Moves everything by a frame of any length: as many whole ticks as there is room for; the
  /// rest waits. Stops at the first tick that fails; every body keeps its state of before that tick.
  StepReport update(double frame_seconds);

  /// Wakes all bodies. Edits, forces, pins, gravity and moving colliders do so by themselves.
  void wake();
  /// What bodies noticed since the last call and did not stop them: steps that may be unstable, energy that grows.
  std::vector<StepReport> take_warnings();

  const Clock& clock() const { return clock_; }
  double time() const { return clock_.time(); }
  /// How far the frame's end is into the next tick, in [0, 1): for positions_between when drawing
  /// one tick behind.
  double fraction() const { return clock_.remainder() * clock_.tick_rate(); }

  Energy energy() const;
  Vec3 momentum() const;
  Vec3 displacement() const;  ///< of the centre of mass of all bodies [m]

  // Checkpoints, between two updates; docs/checkpoints.md.
  /// Writes everything that changes while time goes on: clock, gravity, damping, bodies. Forces, colliders, functions
  /// and settings are left to the program that builds the world again. Cost: a copy of the state.
  /// @throws std::invalid_argument for bodies of a kind that has no checkpoints, hooke::OutputError
  void save(std::ostream& file) const;
  void save(CheckpointWriter& out) const;
  /// Takes over what `save` wrote of a world that was built in the same way; whatever comes after has the same bits as
  /// it would have had there, at any number of threads. Where this throws, the world is as it was.
  /// @param name what errors call the file
  /// @throws hooke::Error naming file, section, rule and value: not a checkpoint, another version, truncated,
  ///         damaged, or of a world that differs in bodies, settings or colliders
  void load(std::istream& file, const std::string& name = "checkpoint");
  void load(CheckpointReader& in);

 private:
  StepReport step();
  Blueprint blueprint() const;
  void save_state(CheckpointWriter& out) const;
  void load_state(CheckpointReader& in);
  void for_each_body(const std::function<void(Body&, std::size_t)>& work);

  Clock clock_;
  std::vector<std::unique_ptr<Body>> bodies_;
  std::vector<Collider> colliders_;
  Vec3 gravity_{0, -9.81, 0};
  bool gravity_on_ = true;
  double damping_ = 0;
  ParallelFor parallel_for_;
  std::unique_ptr<Gang> gang_;
  std::vector<StepReport> reports_;
};

}  // namespace hooke
