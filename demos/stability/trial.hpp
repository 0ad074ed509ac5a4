// What the cases share: building a scene with a trial's solver, and watching it run.
#pragma once

#include "stability.hpp"

#include <scene/figures.hpp>
#include <scene/scene.hpp>

#include <optional>

namespace hooke::stability {

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[400];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

/// The scene with every body moved by this solver.
scene::Scene build(scene::SceneDescription description, const Solver& solver);

/// Thrown by a case whose solver does not claim it; becomes Outcome::NotClaimed.
struct NoClaim {
  std::string reason;
};

/// True for methods that have a largest stable step, whatever the step is.
bool is_explicit(const std::string& method);

double rms_speed(const World& world);  ///< of free points [m/s]
bool asleep(const World& world);       ///< all bodies

/// Work that a row may cost, in forces of springs of explicit methods; about 1e9 a second. More in the long form.
/// Counted, not timed: the same rows are too dear on every machine.
double allowance(const Trial& trial, double share = 1);
constexpr double kAnyWork = 1e300;

/// Runs a world frame by frame and takes down what every case asks.
class Watch {
 public:
  /// @param reach points that are farther from their start have left the scene [m]
  /// @param allowed work, see allowance
  Watch(World& world, Row& row, double reach, double allowed);

  double frame = 1.0 / 60;       ///< [s]
  bool energy = false;           ///< take down the energy's growth
  std::function<void()> look;    ///< after every frame
  std::function<void()> before;  ///< before every frame

  double told_at = kNone;  ///< [s], when the library first named the largest stable step

  /// Up to world time `until` [s]; false where it ended before.
  bool run(double until);

 private:
  bool refuse_if_too_dear(double seconds);
  double work() const;
  bool left() const;
  void listen(const StepReport& report);
  void measure_energy();

  World& world_;
  Row& row_;
  double reach_, allowed_;
  std::vector<Points<double>> start_;
  double energy_start_ = 0, highest_ = 0, exchanged_ = 0;
};

/// Sets the figure and whether it meets the gate. Rows that broke stay broken.
void judge(Row& row, double figure, double gate);
/// Bounded is all that is asked.
void judge(Row& row);

/// Where springs and weight balance.
struct Balance {
  Points<double> positions{0, 3};  ///< [m], world
  double residual = 0;             ///< greatest force on a free point over the weight of all
};
/// By Newton's method with conjugate gradients and a line search on the energy, in double; it shares the springs'
/// force with the solvers and nothing else. Starts where the body is.
Balance balance_of(const scene::SceneBody& body, const Vec3& gravity);

/// A value that is computed at the first call and then kept, whatever the thread.
template <class T>
std::function<const T&()> once(std::function<T()> make);

}  // namespace hooke::stability

#include <mutex>

namespace hooke::stability {

template <class T>
std::function<const T&()> once(std::function<T()> make) {
  struct State {
    std::once_flag flag;
    std::optional<T> value;
  };
  return [state = std::make_shared<State>(), make = std::move(make)]() -> const T& {
    std::call_once(state->flag, [&] { state->value = make(); });
    return *state->value;
  };
}

}  // namespace hooke::stability
