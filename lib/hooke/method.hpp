// Integration methods as data: tables of coefficients, not classes. The routines that run
// them are in integrator.hpp, one per shape.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace hooke {

/// v += kick[i] h a(x); x += drift[i] h v; for i = 0, 1, …
struct Splitting {
  std::vector<double> kick, drift;  ///< same length; each sums to 1
};

/// Verlet in increment form: d += h² a(x); x += d, with d = x - x₋₁ stored as its own
/// variable. Algebraically x' = x + (x - x₋₁) + a h², but without the difference of two nearly
/// equal positions, in which the velocity would drown. The first d is v h - ½ a h² (plus the
/// step's a h²).
struct Verlet {};

/// Explicit Runge-Kutta: stage[i][j] for j < i, weight[i]; forces are evaluated at the stages.
struct RungeKutta {
  std::vector<std::vector<double>> stage;
  std::vector<double> weight;
};

/// Backward Euler, v' = v + a(x', v') h; x' = x + v' h, solved by Newton's method with
/// matrix-free conjugate gradients until the residual is below `tolerance` of the velocity
/// scale (0: 1e-12 in double, 1e-6 in float).
struct Implicit {
  double tolerance = 0;
  int max_iterations = 200;
};

/// One integration method and what is known about it.
struct Method {
  std::string_view name;         ///< as in scene files
  int order;                     ///< of the global position error, as dt → 0
  bool symplectic;               ///< keeps the energy of undamped motion bounded
  double stability_limit;        ///< largest stable dt·ω undamped; 0: none; infinity: always
  int evaluations;               ///< of the forces per step
  bool accepts_velocity_forces;  ///< drag and dampers allowed
  std::variant<Splitting, Verlet, RungeKutta, Implicit> scheme;
};

/// Explicit (forward) Euler: v' = v + a h, p' = p + v h. Order 1; energy of an oscillator
/// grows by 1 + (ωh)² a step, always. 1 evaluation. The tutorial's "Explicit Euler".
const Method& explicit_euler();

/// Semi-implicit (symplectic) Euler: v' = v + a h, p' = p + v' h. Order 1, stable for ωh < 2.
/// 1 evaluation. The tutorial's "Semi-Implicit Euler".
const Method& semi_implicit_euler();

/// Implicit (backward) Euler: v' = v + a' h, p' = p + v' h, solved. Order 1, stable at any h,
/// loses energy: 1/(1 + (ωh)²) a step. The tutorial's "Implicit Euler".
const Method& implicit_euler();

/// Verlet in increment form: p' = p + (p - p₋₁) + a h². Order 2, symplectic, stable for
/// ωh < 2. 1 evaluation. The tutorial's "Verlet" (Störmer; Verlet 1967).
const Method& verlet();

/// Velocity Verlet: half a kick, a drift, half a kick. Order 2, symplectic, stable for ωh < 2.
/// 1 evaluation (the last is the next step's first). Velocity-dependent forces take a
/// predicted velocity, which keeps the order (Swope et al. 1982).
const Method& velocity_verlet();

/// Runge-Kutta 2 (explicit midpoint). Order 2, never stable undamped (energy × 1 + (ωh)⁴/4).
/// 2 evaluations. The tutorial's "RK2".
const Method& rk2();

/// The classical Runge-Kutta method. Order 4, stable for ωh ≤ 2√2, loses energy slowly.
/// 4 evaluations. The tutorial's "RK4" (Kutta 1901).
const Method& rk4();

/// Every method, in the order of the documentation.
std::span<const Method* const> methods();

/// The method of that name. Throws std::invalid_argument that lists the names there are.
const Method& method_named(std::string_view name);

/// The largest stable step [s] for undamped frequencies up to `omega` [rad/s] that are damped
/// at the rate `gamma` [1/s] (the largest eigenvalue of M⁻¹D; ζ = γ/2ω). Infinity where any
/// step is stable; 0 where no step is.
///
/// Semi-implicit Euler, damping at the old velocity: h²ω² + 2hγ ≤ 4. Verlet and velocity
/// Verlet, damping at the predicted velocity: h²ω² + 4hγ ≤ 4. Both exact. Explicit Euler:
/// h ≤ min(γ/ω², 2/γ), exact for ζ ≤ 1/√2 and within a factor 2 up to critical damping; safe for
/// RK2, whose region contains explicit Euler's. RK4: hω ≤ 2√2 for ζ ≤ 0.3, else
/// h·max(ω, γ) ≤ 2.615, the largest half-disc inside its region.
double largest_stable_step(const Method& method, double omega, double gamma);

}  // namespace hooke
