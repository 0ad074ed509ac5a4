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
/// With `error` it is an embedded pair: h Σ error[i] k[i] estimates the error of a step.
struct RungeKutta {
  std::vector<std::vector<double>> stage;
  std::vector<double> weight;
  double half_disc = 0;             ///< largest h|λ| stable for every λ with Re λ ≤ 0; 0: none
  std::vector<double> error{};      ///< empty: no estimate
  bool first_same_as_last = false;  ///< the last stage is the next step's first
};

/// Runge-Kutta-Nyström, explicit, for a(x, t): k[i] = a(x + node[i] h v + h² Σ stage[i][j] k[j],
/// t + node[i] h); x += h v + h² Σ position[i] k[i]; v += h Σ velocity[i] k[i].
struct Nystrom {
  std::vector<double> node;
  std::vector<std::vector<double>> stage;
  std::vector<double> position, velocity;
};

/// The one-leg theta method: v' = v + h a(xθ, vθ, t + θh), x' = x + h vθ, where xθ = (1-θ) x + θ x'
/// and vθ likewise; θ = 1 is backward Euler, θ = ½ the implicit midpoint rule. Solved by Newton's
/// method in a trust region (implicit_solver.hpp), contacts and friction included, until the residual is below
/// `tolerance` of the velocity scale (0: 1e-12 in double, 1e-6 in float, which is also the least), or below what
/// the rounding of positions makes of the forces. A step that needs more than max_iterations ends where it is, downhill
/// from its start, and is counted in Work::unfinished.
struct Implicit {
  double tolerance = 0;
  int max_iterations = 200;
  double theta = 1;         ///< in [½, 1]
  bool linearised = false;  ///< one Newton step from xθ = x + θ h v; `tolerance` is that of the gradients
};

/// One integration method and what is known about it.
struct Method {
  std::string_view name;         ///< as in scene files
  int order;                     ///< of the global position error, as dt → 0
  bool symplectic;               ///< keeps the energy of undamped motion bounded
  double stability_limit;        ///< largest stable dt·ω undamped; 0: none; infinity: always
  int evaluations;               ///< of the forces per step
  bool accepts_velocity_forces;  ///< drag and dampers allowed
  std::variant<Splitting, Verlet, RungeKutta, Nystrom, Implicit> scheme;

  /// True where it can estimate its error and choose its own steps.
  bool adaptive() const;
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

/// PEFRL, the position-extended Forest-Ruth-like splitting: five drifts with four kicks between
/// them, v + ½(1 - 2λ) a h and v + λ a h each twice. Order 4, symplectic, time-reversible, stable
/// for ωh < 2.989 (unstable to 3.506). 4 evaluations: it begins and ends with a drift, so that the
/// last evaluation is not the next step's first. Forces of position and time only.
/// Source: Omelyan, Mryglod, Folk, Comput. Phys. Commun. 146 (2002) 188.
const Method& pefrl();

/// Nyström's method of order 4 for a(x, t): RK4's order with 3 evaluations. Not symplectic, stable for
/// ωh < 2.587, loses energy slowly. Forces of position and time only. Source: Nyström 1925; Hairer,
/// Nørsett, Wanner, "Solving Ordinary Differential Equations I", II.14.
const Method& rkn4();

/// Blanes and Moan's splitting of six stages (SRKN6b), kick first. Order 4, symplectic,
/// time-reversible, stable for ωh < 3.163 (unstable to 3.169, then stable to 5.027). 6 evaluations (the last is
/// the next step's first). Forces of position and time only.
/// Source: Blanes, Moan, J. Comput. Appl. Math. 142 (2002) 313.
const Method& blanes_moan_4();

/// Blanes and Moan's splitting of eleven stages (SRKN11b), kick first. Order 6, symplectic,
/// time-reversible. Stable for ωh < 3.141; beyond it two narrow windows, 3.1414-3.1424 and
/// 6.348-6.350, grow by at most 1.0007 a step, and 9.073 is the end. 11 evaluations (the last is the next
/// step's first). Forces of position and time only. Source: as blanes_moan_4.
const Method& blanes_moan_6();

/// The implicit midpoint rule: v' = v + h a((x + x')/2, (v + v')/2), x' = x + h (v + v')/2, solved.
/// Order 2, symplectic, time-reversible, linearly stable at any h, keeps the energy of a linear
/// oscillator. As many evaluations as the solve needs. Source: Hairer, Lubich, Wanner,
/// "Geometric Numerical Integration", II.1.
const Method& implicit_midpoint();

/// The implicit midpoint rule with one Newton step from (x + ½ h v, v): one evaluation and one
/// solve by conjugate gradients, which stop at a millionth of the step's change. Order 2, the same as
/// implicit midpoint for linear forces; for others it keeps energy only approximately, and fails
/// where a step is too long for one Newton step. Source: linearly implicit methods, Hairer, Wanner,
/// "Solving Ordinary Differential Equations II", IV.7; Baraff, Witkin 1998 do it to backward Euler.
const Method& linearised_midpoint();

/// The embedded pair 5(4) of Dormand and Prince with error control: chooses its own steps within a
/// tick so that each errs by less than MotionSettings::tolerance, or runs at a given dt. Order 5 (the
/// error is that of the fourth-order result; the fifth is kept). Not symplectic; at a given dt stable
/// undamped for ωh ≤ 0.997. 6 evaluations (the last is the next step's first).
/// Source: Dormand, Prince, J. Comput. Appl. Math. 6 (1980) 19; step control: Hairer, Nørsett,
/// Wanner, "Solving Ordinary Differential Equations I", II.4 and IV.2 (PI controller).
const Method& dormand_prince();

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
/// h·max(ω, γ) ≤ 2.615, the largest half-disc inside its region. Dormand-Prince: h·max(ω, γ) ≤ 0.997,
/// its half-disc. Methods that accept no forces of velocity do not look at gamma.
double largest_stable_step(const Method& method, double omega, double gamma);

}  // namespace hooke
