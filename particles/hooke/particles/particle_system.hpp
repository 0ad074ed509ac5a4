// A particle system: emitters, forces and contacts, moved tile by tile by the integrator core.
#pragma once

#include <hooke/body.hpp>
#include <hooke/particles/deaths.hpp>
#include <hooke/particles/emitter.hpp>
#include <hooke/particles/force.hpp>

#include <memory>
#include <string>

namespace hooke::particles {

/// What a kind of particles looks like over its life. Asked for when drawn; costs nothing before.
struct Kind {
  std::string name;
  ColorRamp color;        ///< by share of life
  Curve size = Curve(1);  ///< times the size at birth, by share of life
};

struct ParticleSettings {
  std::string name = "particles";
  Vec3 origin{0, 0, 0};  ///< [m]; positions are relative to it, so that float keeps its digits anywhere

  /// Any method of the core. `verlet` and `velocity-verlet` (which are one method here: velocities are those of the
  /// ticks), `semi-implicit-euler` and other splittings run in the fast loop, the rest through hooke::Integrator.
  const Method* method = &verlet();
  double dt = 0;            ///< wanted substep [s]; 0: one a tick
  double tolerance = 1e-6;  ///< adaptive methods with dt = 0, away from colliders: as Integrator::adapt [m], > 0

  Index capacity = 100'000;  ///< most particles alive
  enum class AtCapacity { Refuse, OldestDies };
  AtCapacity at_capacity = AtCapacity::Refuse;  ///< what happens to births beyond that; both are counted

  bool collides = true;    ///< false: colliders are ignored
  double radius = 0;       ///< distance kept from colliders [m]
  double restitution = 0;  ///< the larger of this and the collider's counts
  double rest_speed =
      1e-3;  ///< approach speed below which nothing bounces [m/s]; at least what gravity gives in two steps
  bool exact_impacts = false;  ///< impact times are solved within the substep, as many as there are: slower
  bool dies_on_impact = false;

  double prewarm = 0;          ///< [s] that are simulated before the first tick
  bool keeps_previous = true;  ///< needed for positions_between and to take a tick back; costs a copy
  Index trail = 0;             ///< positions of so many ticks are kept for each particle
  Index tile = 512;            ///< particles that pass through all modules together; changes no bit of explicit methods
  std::uint64_t seed = 0;      ///< of everything random; emitters differ by their order and own seeds
  std::vector<Kind> kinds;
};

/// A particle that is alive, for ever the same one; what was alive once is told from who took its place.
struct Handle {
  std::uint32_t slot = 0, generation = 0;
};

/// What came and went since creation.
struct Counts {
  std::int64_t born = 0, died = 0;
  std::int64_t refused = 0;    ///< births beyond the capacity
  std::int64_t displaced = 0;  ///< the oldest, who made room
  std::int64_t impacts = 0;    ///< told only where sub-emitters or dies_on_impact ask for them
};

/// Particles as a body of the world. The same bits at any thread count, and at any tile size where the method is
/// explicit with steps of its own (implicit solves and error control look at a whole tile).
///
/// Order within a tick: births of sub-emitters' parents, forces and flight, contacts, ageing, deaths, births; who is
/// born within a tick flies on for the rest of it. Dead particles are replaced by the last ones, so indices change from
/// tick to tick; handles do not. Memory is asked for at creation (and by bursts of events larger than any before).
template <class S>
class ParticleSystem final : public Body {
 public:
  /// @throws std::invalid_argument naming the setting, the rule and the value
  explicit ParticleSystem(ParticleSettings settings);
  ~ParticleSystem() override;

  // Modules, to be added before the first tick. Forces are summed in the order in which they were added.
  void add_force(std::unique_ptr<Force<S>> force);
  void add_emitter(EmitterSettings emitter);
  void add_sub_emitter(SubEmitterSettings sub_emitter);
  using Body::add_force;

  /// Adds one particle now. @return its handle; slot = -1 where there was no room
  Handle add(const Birth& birth);

  const ParticleSettings& settings() const { return settings_; }
  const std::vector<Emitter>& emitters() const { return emitters_; }
  const Counts& counts() const { return counts_; }

  /// Views of the state, by index; valid until the next tick. Positions [m] are relative to the origin.
  Eigen::Ref<const Points<S>, 0, Eigen::OuterStride<>> state_positions() const;
  Eigen::Ref<const Points<S>, 0, Eigen::OuterStride<>> state_velocities() const;

  double age(Index i) const;       ///< [s]
  double lifetime(Index i) const;  ///< [s]; infinity: never dies
  int kind(Index i) const { return kind_[std::size_t(i)]; }
  std::uint64_t serial(Index i) const { return serial_[std::size_t(i)]; }  ///< number of birth
  /// Linear RGB, shape (n, 3), and radius [m] as drawn: the kinds' colours and sizes over life.
  void appearance(Points<float>& colors, Values<float>& sizes) const;
  /// Positions of the last ticks, world, newest first, fewer for the young. @param out (settings().trail, 3)
  Index trail(Index i, Points<float>& out) const;

  Handle handle(Index i) const;
  Index find(Handle handle) const;  ///< its index now, or -1 where it is dead

  // hooke::Body. Particles cannot be pinned: pin, move_pin and drive_pins throw std::invalid_argument.
  Index size() const override { return count_; }
  Points<double> positions() const override;
  Points<double> velocities() const override;
  Values<double> masses() const override;
  Points<double> positions_between(double fraction) const override;
  Points<double> start_positions() const override;  ///< where each was born
  void set_position(Index point, const Vec3& position) override;
  void set_velocity(Index point, const Vec3& velocity) override;
  void pin(Index point) override;
  void release(Index point) override;
  bool pinned(Index) const override { return false; }
  void move_pin(Index point, const Vec3& target) override;
  void drive_pins(std::vector<Index> points, PinMotion motion) override;
  void add_force(Index point, const Vec3& force) override;
  void clear_forces() override { pushed_.clear(); }
  Energy energy(const Vec3& gravity) const override;
  Vec3 momentum() const override;
  MotionFacts motion_facts() const override;
  void begin_frame(double seconds, double waiting, double t0, double t1) override;
  StepReport advance(const Tick& tick) override;
  void take_back() override;
  void damp(double factor) override;
  void describe(Blueprint& out) const override;
  void save(CheckpointWriter& out) const override;
  void load(CheckpointReader& in) override;

 private:
  struct Particle;  // one particle's share of all arrays
  struct Plan;      // what is the same for all tiles of a tick
  struct Worker;    // one thread's scratch memory
  struct Event {
    SubEmitterSettings::On on;
    Index particle;  // where it is now; the parent's data are copied
    int order;       // among the events of its tile
    double time;
    std::uint64_t serial;
    int kind;
    Vec3 position, velocity, normal;
    double speed;
  };

  void check_index(Index i) const;
  void start_weighing();
  Particle get(Index i) const;
  void put(Index i, const Particle& particle);
  bool append(const Birth& birth, const Tick* tick);
  void remove(Index i);
  void remove_now(Index i);
  void drop_newborn(Index i);
  void remove_all(std::vector<Index>& dead);
  Tile<S> tile_at(Index first, Index count);
  void plan(const Tick& tick);
  void move(Tile<S> tile, Index first, Plan& plan, Worker& worker);
  void fly_newborn(Index i, double t0, const Tick& tick);
  void flight(Tile<S>& tile, Index first, Plan& plan, Worker& worker);
  void integrate(Tile<S>& tile, Index first, Plan& plan, Worker& worker);
  void accelerate(const Tile<S>& tile, Index first, double t, S* const a[3]) const;
  void spend_bank(double seconds);
  void births(const Tick& tick);
  void sub_births();
  void simulate_tick(const Tick& tick);
  void prewarm(const Tick& tick);
  void keep_trail();

  ParticleSettings settings_;
  std::vector<std::unique_ptr<Force<S>>> forces_;
  std::vector<Emitter> emitters_;
  std::vector<SubEmitterSettings> sub_emitters_;
  std::vector<Random> sub_random_;
  bool wants_births_ = false, wants_deaths_ = false, wants_impacts_ = false;

  // By particle. Hot: read and written in every tick. Cold: only at births, deaths and when asked.
  Index count_ = 0;
  Index padded_ = 0;
  Points<S> position_, velocity_;
  Values<S> inverse_mass_;  // empty where all weigh the same
  double same_mass_ = 1;
  bool has_mass_ = false;
  Deaths deaths_;
  std::vector<double> lifetime_;
  std::vector<float> size_;
  std::vector<std::uint64_t> serial_;
  std::vector<std::uint32_t> slot_;
  std::vector<std::uint8_t> kind_;
  Points<float> birth_place_;
  Points<S> previous_position_, previous_velocity_;
  std::vector<Points<float>> trail_;  // one a tick, newest at trail_head_
  std::vector<std::uint8_t> trail_length_;
  Index trail_head_ = 0;

  struct Slot {
    Index index = -1;
    std::uint32_t generation = 0;
  };
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_;
  std::uint64_t next_serial_ = 0;
  Counts counts_, previous_counts_;

  // To take a tick back.
  struct Removed;
  std::vector<Removed> removed_;
  Index births_begin_ = 0;
  std::uint64_t previous_serial_ = 0;
  double previous_now_ = 0;

  std::unique_ptr<Plan> plan_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::unique_ptr<Worker> newborn_;
  std::vector<Event> events_;
  std::vector<Event> early_;  // impacts of newborns, for the next tick
  std::vector<Birth> born_;
  std::vector<Index> dead_;
  std::vector<std::pair<std::uint64_t, Index>> oldest_;
  double now_ = 0;  // end of the last tick [s]; deaths_ are told in the same time
  bool started_ = false, warming_ = false;
  int steps_ = 1;
  std::int64_t evaluations_ = 0;

  struct Push {
    Handle who;
    Vec3 force;
  };
  struct Banked {
    double seconds;
    std::vector<Push> pushes;
  };
  std::vector<Push> pushed_;
  std::vector<Banked> bank_;
};

extern template class ParticleSystem<float>;
extern template class ParticleSystem<double>;

}  // namespace hooke::particles
