// A body made of point masses, force fields and a method: particles, cloth, jelly and the
// points of linear rigid bodies are all this.
#pragma once

#include <hooke/body.hpp>
#include <hooke/contacts.hpp>
#include <hooke/energy_watch.hpp>
#include <hooke/force_field.hpp>
#include <hooke/integrator.hpp>
#include <hooke/point_masses.hpp>
#include <hooke/surroundings.hpp>

#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

namespace hooke {

/// How a body is moved.
struct MotionSettings {
  const Method* method = &velocity_verlet();
  double dt = 0;                   ///< wanted substep [s]; 0: from the largest stable step
  double thickness = 0;            ///< distance kept from colliders [m]
  bool collides = true;            ///< false: colliders are ignored
  Index max_substeps = 1'000'000;  ///< a tick; the automatic step stops there
  /// Adaptive methods with dt = 0: most that the estimated error of a step may be [m], as in
  /// Integrator::adapt; > 0. The error of a second is about as many times this as steps it takes.
  double tolerance = 1e-6;
  /// In float, sums of positions and velocities keep what rounding drops (see Integrator), steppers make their steps in
  /// double while rounding shows (PointBody::rounding_shows; about twice the cost), and the body's origin follows it.
  /// Without it: plain float. What moves less than a rounding of its place a substep stays where it is, and what should
  /// rest shakes.
  bool compensated = true;
  /// Bodies of passive fields that lose energy (dampers, drag, friction, global damping, a method that does)
  /// sleep once they are at rest, as PointBody::kQuietSpeed and its neighbours say.
  bool sleeps = true;
  /// Energy that a body of passive fields alone gains from nowhere is an error: off, it is not looked at.
  bool watches_energy = true;
  /// A tick that fails is tried again with twice the substeps, this often.
  int retries = 0;
  int iterations = 0;  ///< sweeps a substep, of softbody::xpbd() alone; 0: its default
};

template <class S>
class PointBody : public Body, protected Dynamics<S> {
 public:
  /// @throws std::invalid_argument where sizes differ, a value is not finite, a mass is not
  ///         positive, or the method does not accept the fields
  PointBody(std::string name, PointMasses<S> points, MotionSettings settings);

  /// Adds a force field. Order of addition is order of summation.
  void add_field(std::unique_ptr<const ForceField<S>> field);

  /// In float the origin follows a body that travels: what `state` says is relative to where it is now.
  const PointMasses<S>& state() const { return points_; }
  const MotionSettings& settings() const { return settings_; }
  /// Rest: for so long [s] its RMS speed was below this [m/s], and of its forces, Σ |f_i| over its points, what
  /// surfaces bear taken off, no more is left than this share of its weight or what the rounding of its positions
  /// makes of stiff springs in float.
  static constexpr double kQuietSpeed = 2e-4, kQuietTime = 0.5, kQuietForce = 0.01;
  /// Float is not enough for substeps in which a body moves less than kSlow roundings of its size, RMS over points;
  /// for what steppers move also where gravity adds less than kLight of them (the noise of so stiff springs turns a
  /// sheet's normals by 2°), and at a given substep that is less than kFine of the largest stable one.
  static constexpr double kSlow = 256, kLight = 0.25, kFine = 0.1;
  /// True where the first or the second holds.
  /// @param h substep [s]  @param speed RMS over points [m/s]  @param size largest coordinate [m]
  /// @param gravity [m/s²]; 0: not looked at
  static bool rounding_shows(double h, double speed, double size, double gravity);
  /// Σ |f_i| over free points [N] of gravity, fields and contacts, were it at rest where it is. Cost: one evaluation.
  virtual double residual_force(const Vec3& gravity);

  Index substeps() const { return adapts() ? integrator_.adapted_steps() : substeps_; }  ///< in the last tick

  /// True where a stepper of its only field moves it: a splitting method, forces of position alone. Ticks with
  /// contacts or driven pins still take the general way.
  virtual bool fused() const {
    return stepper_ && !uses_velocity_ && std::holds_alternative<Splitting>(settings_.method->scheme);
  }

  using Body::stable_step;
  /// The largest stable substep [s] of the method in the present state; infinity or 0 as in
  /// largest_stable_step.
  double stable_step() const { return stable_step(*settings_.method); }
  double stable_step(const Method& method) const override;
  MotionFacts motion_facts() const override;

  Index size() const override { return points_.size(); }
  Points<double> positions() const override { return world(points_.position); }
  Points<double> velocities() const override { return points_.velocity.template cast<double>(); }
  Values<double> masses() const override { return points_.mass.template cast<double>(); }
  Points<double> positions_between(double fraction) const override;
  Points<double> start_positions() const override {
    return start_.template cast<double>().rowwise() + start_origin_.transpose().array();
  }
  void set_position(Index point, const Vec3& position) override;
  void set_velocity(Index point, const Vec3& velocity) override;
  void pin(Index point) override;
  void release(Index point) override;
  bool pinned(Index point) const override;
  void move_pin(Index point, const Vec3& target) override;
  void drive_pins(std::vector<Index> points, PinMotion motion) override;
  void add_force(Index point, const Vec3& force) override;
  void clear_forces() override { pushed_.clear(); }
  Energy energy(const Vec3& gravity) const override;
  Vec3 momentum() const override;
  void begin_frame(double seconds, double waiting, double t0, double t1) override;
  StepReport advance(const Tick& tick) override;
  void take_back() override;
  void damp(double factor) override;
  void describe(Blueprint& out) const override;
  void save(CheckpointWriter& out) const override;
  void load(CheckpointReader& in) override;
  bool asleep() const override { return asleep_; }
  void wake() override;
  std::vector<StepReport> take_warnings() override { return std::exchange(warnings_, {}); }

 protected:
  // Dynamics: the equations of motion of these points.
  bool uses_velocity() const override { return uses_velocity_; }
  void acceleration(const Points<S>& x, const Points<S>& v, double t, Points<S>& a) override;
  void prescribe(double t0, const Points<S>& from, double t, Points<S>& x, Points<S>& v) override;
  bool prescribes() const override { return !driven_.empty() || !moving_.empty(); }
  void collide(double t0, const Points<S>& from, double t1, Points<S>& x, Points<S>& v) override;
  void settle(Points<S>& v) override { contacts_.settle(v); }
  bool collides() const override { return contacts_.any(); }
  void planes(double t0, const Points<S>& x, double t1, S reach, std::vector<ContactPlane<S>>& out) override {
    contacts_.planes(t0, x, t1, reach, points_.inverse_mass, out);
  }
  const Values<S>& mass() const override { return points_.mass; }
  const Values<S>& inverse_mass() const override { return points_.inverse_mass; }
  void add_implicit_times(const Points<S>& x, const Points<S>& v, S h, bool safe, const Points<S>& d,
                          Points<S>& out) override;
  void add_couplings(const Points<S>& x, const Points<S>& v, double h, std::vector<Coupling>& out) override;

  /// One substep; linear rigid bodies add their impacts to it.
  virtual SolveResult substep(double t, double h);
  /// The acceleration that everything but contacts would give it, were it at rest at x.
  virtual void still_acceleration(const Points<S>& x, const Points<S>& still, double t, Points<S>& a) {
    acceleration(x, still, t, a);
  }
  /// True where its motion dies down by itself.
  virtual bool loses_energy() const;

  void check(Index point) const;
  /// True where fields or pushes add to gravity in this tick.
  bool other_forces() const { return !fields_.empty() || pushing_; }
  Points<double> world(const Points<S>& p) const;

  bool may_follow_ = true;  // its origin it
  PointMasses<S> points_;
  Tick tick_;  // the one being simulated

 private:
  using Push = std::pair<Index, Vec3>;
  struct Banked {
    double seconds;
    std::vector<Push> pushes;
  };
  struct Driven {
    std::vector<Index> points;
    PinMotion motion;
    Points<double> place;
  };
  struct Moving {  // a pin on its way
    Index point;
    Vec3 from, to;  // world
  };

  bool adapts() const { return settings_.dt == 0 && settings_.method->adaptive(); }
  typename ForceField<S>::Rates rate_bounds() const;
  double automatic_step() const;
  void choose_substeps(const Tick& tick);
  void bound_swing(const Tick& tick);
  void follow();
  void begin_tick(const Tick& tick);
  void spend_bank(double seconds);
  void hold_fields(double t);
  void hold(Index point);
  SolveResult run_tick();
  bool run_fast();
  bool needs_low() const;
  StepReport explain(bool finite_state);
  StepReport try_tick();
  void changed(Index point);
  bool disturbed(const Tick& tick);
  void rest(double kinetic);
  bool balanced();
  double free_mass();
  double unbalanced(const Points<S>& x, Points<S>& left);
  bool alone() const;
  double kept_energy(double enough = -std::numeric_limits<double>::infinity());
  void begin_energy_watch();
  StepReport watch_energy(double kinetic);
  void check_step();
  StepReport report_of(StepReport::Status status) const;
  std::string step_advice() const;
  void warn(StepReport warning, bool& warned);

  MotionSettings settings_;
  Integrator<S> integrator_;
  Contacts<S> contacts_;
  std::vector<std::unique_ptr<const ForceField<S>>> fields_, held_fields_;
  std::unique_ptr<Stepper<S>> stepper_, fine_stepper_;  // where there are ones for the only field
  std::vector<Stage> stages_;
  bool uses_velocity_ = false;
  Points<S> start_, previous_position_, previous_velocity_, force_, damping_product_;
  std::vector<Push> pushed_;
  std::deque<Banked> bank_;
  Points<S> push_acceleration_;
  bool pushing_ = false;
  std::vector<Driven> driven_;
  std::vector<Moving> moving_;
  double frame_start_ = 0, frame_end_ = 0;
  Index substeps_ = 0;
  bool slow_ = false;  // rounding shows in this tick
  double wanted_dt_ = 0, last_estimate_ = -1;
  double step_share_ = 1, swing_checked_ = -1, exchanged_ = 0;  // of the automatic step; [s]; [J]
  bool passive_ = true;                                         // all fields are
  Vec3 start_origin_{0, 0, 0};
  double known_reach_ = 0;  // while its first point is not farther from the origin, it stays where it is [m]
  double free_mass_ = -1;   // [kg]; negative: to be summed up again

  bool asleep_ = false, damped_ = false;  // damped_: by the world, lately
  double quiet_since_ = 0;
  Vec3 last_gravity_{0, 0, 0};
  Surroundings surroundings_;
  bool surroundings_known_ = false;

  EnergyWatch energy_watch_;
  std::vector<StepReport> warnings_;
  bool warned_of_energy_ = false, warned_of_step_ = false;
  double step_checked_ = -1, checked_limit_ = 0;

  // Several ask for these before a tick, of the same positions.
  mutable std::optional<typename ForceField<S>::Rates> rates_;
  bool before_tick_ = false;

  // While a failed tick is run once more to find out what went wrong.
  bool watching_ = false;
  Index culprit_ = -1;            // the first point with a force or place that is not finite
  bool fields_at_fault_ = false;  // its force came from ordinary positions and velocities
};

extern template class PointBody<float>;
extern template class PointBody<double>;

}  // namespace hooke
