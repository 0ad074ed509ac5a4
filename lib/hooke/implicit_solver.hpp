// The equation of one implicit step, solved from anywhere.
#pragma once

#include <hooke/block_cholesky.hpp>
#include <hooke/contacts.hpp>
#include <hooke/method.hpp>
#include <hooke/types.hpp>

#include <cstdint>
#include <vector>

namespace hooke {

template <class S>
class Dynamics;
struct SolveResult;
struct Work;

/// Finds u = v + h a(x + h u, u, t + h), the velocity of a backward Euler step.
///
/// For forces with a potential V that is a minimum of Φ(u) = ½ |u - v|²_M + V(x + h u). Newton's method goes
/// downhill in Φ: differences of Φ are integrals of its slope along a step by Simpson's rule, which
/// rounding does not drown and which forces without a potential (drag, dampers) have as well. Steps
/// come from conjugate gradients with the exact stiffness or, where that has a direction of negative
/// curvature, with the positive part of it. They are preconditioned by the 3×3 blocks of the points, or by the factors
/// of the whole positive part where those are cheaper than what they save.
///
/// Points touch planes as in a projected Newton method: those that are pressed against theirs stay in it and
/// let go where it would have to pull (Bertsekas 1982; the filter of Baraff and Witkin 1998). Friction holds
/// a point while it can do so within Coulomb's cone, else it slides against µ times the pressure of the last
/// iteration.
template <class S>
class ImplicitSolver {
 public:
  /// Solves from u = v for a step of θh; points do not cross planes in the whole of h. The end of θh is in position()
  /// and velocity().
  SolveResult solve(const Implicit& scheme, Dynamics<S>& dynamics, const Points<S>& x, const Points<S>& v, double t,
                    double h, Work& work);
  const Points<S>& position() const { return x_; }
  const Points<S>& velocity() const { return u_; }

  /// Makes v of the points that the last solve held go with what holds them.
  void settle(Points<S>& v) const;

  /// Takes from accelerations at rest what the planes of the last solve bear.
  void bear(Points<S>& a) const;

  /// Forgets what it knows of the last step's matrix.
  void restart() { factored_ = false; }

 private:
  using Vec = Eigen::Matrix<S, 3, 1>;
  enum class Touch : char { Free, Slides, Sticks };
  struct Contact {
    Index point = 0;
    Vec normal{0, 0, 0}, surface_velocity{0, 0, 0};
    S friction = 0;
    Touch touch = Touch::Free;
    S least = 0;           // of normal · u
    S still = 0;           // speeds below are rounding
    S pressure = 0;        // [kg m/s] of the last iteration
    Vec against{0, 0, 0};  // the direction of sliding
    Vec slip(const Vec& u) const {
      const Vec relative = u - surface_velocity;
      return relative - relative.dot(normal) * normal;
    }
  };
  struct Held {  // what a point may not do: move along one or two orthogonal directions, or at all (3)
    Index point;
    Vec first, second;
    int directions;
  };
  struct Rub {  // how friction changes with the direction of sliding: strength (1 - nnᵀ - ddᵀ)
    Index point;
    S strength;
    Vec normal, direction;
    Vec times(const Vec& d) const { return strength * (d - normal * normal.dot(d) - direction * direction.dot(d)); }
    Mat3 matrix() const {
      const Vec3 n = normal.template cast<double>(), d = direction.template cast<double>();
      return double(strength) * (Mat3::Identity() - n * n.transpose() - d * d.transpose());
    }
  };
  // Everything that stays the same in a solve.
  struct Step {
    Dynamics<S>& dynamics;
    const Points<S>&from, &v;
    double t, h;
    Work& work;
  };

  double miss(const Step& step, Points<S>& u, Points<S>& end, Points<S>& out);
  void find_touches(const Step& step, double tolerance);
  void rub(const Step& step, const Points<S>& u, Points<S>& out) const;
  static void hold_more(Held& held, const Held& more);
  void filter(Points<S>& p) const;
  void find_planes(const Step& step, double whole);
  void clip(Points<S>& u) const;
  void multiply(const Step& step, bool safe);
  void prepare(const Step& step);
  void factor(const Step& step);
  void precondition(const Step& step);
  void solve_linear(const Step& step, bool safe, double tolerance);
  double rounding_of_force(const Step& step);
  double fall(const Step& step, const Points<S>& out) const;

  bool factored_ = false;
  double patience_ = 0;             // products that are worth a factorisation
  double spent_ = 0;                // products since the last one
  double radius_ = 0, length_ = 0;  // of the trust region and of the last update, in the preconditioner's norm
  bool on_border_ = false;
  int rounds_ = 1;  // more where a point has more than one plane
  BlockCholesky cholesky_;
  std::vector<Coupling> couplings_;
  std::vector<Mat3> diagonal_, off_diagonal_, inverse_;
  std::vector<ContactPlane<S>> planes_;
  std::vector<Contact> contacts_;
  std::vector<Held> held_;
  std::vector<Rub> rubs_;
  std::vector<Mat3> projector_;
  Points<S> u_, x_, out_, filtered_, trial_u_, trial_x_, trial_out_, middle_u_, middle_x_, middle_out_;
  Points<S> whole_, update_, step_, acceleration_;
  Points<S> residual_, preconditioned_, direction_, product_;
  Points<double> solved_;
};

extern template class ImplicitSolver<float>;
extern template class ImplicitSolver<double>;

}  // namespace hooke
