#include <hooke/softbody/solver_cost.hpp>

#include <hooke/block_cholesky.hpp>
#include <hooke/point_body.hpp>
#include <hooke/softbody/filtered_grid.hpp>
#include <hooke/softbody/grid_order.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace hooke::softbody {

namespace {

bool is_grid(const SoftBodySettings& s) {
  if (!s.network || s.network->springs.empty()) return false;
  try {
    const SpringGrid grid = SpringGrid::of(*s.network, s.positions.rows());
    return grid.rows > 1 && grid.columns > 1;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

// What the fused kernels take for it.
const CostTable& fused_cost(const SoftBodySettings& s) {
  if (!s.network) return kNetworkCost;
  return is_grid(s) || !grid_order(*s.network, s.positions).empty() ? kGridCost : kNetworkCost;
}

// Whether the fused kernels can run it.
bool springs_alone(const SoftBodySettings& s) {
  if (s.volume_stiffness != 0 || s.cell_stiffness != 0) return false;
  if (s.linear_drag != 0 || s.quadratic_drag != 0 || (s.wind && !s.wind->once_a_tick)) return false;
  return !s.network || std::none_of(s.network->springs.begin(), s.network->springs.end(),
                                    [](const Spring& spring) { return spring.damping > 0; });
}

}  // namespace

bool rounding_shows(const SoftBodySettings& settings, double h, double speed, double gravity, double stable_step) {
  if (!settings.motion.compensated) return false;
  if (std::isfinite(stable_step) && h < PointBody<float>::kFine * stable_step) return true;
  const double size = settings.positions.rows() ? settings.positions.abs().maxCoeff() : 0;
  return PointBody<float>::rounding_shows(h, speed, size, gravity);
}

SolverCost::SolverCost(const SoftBodySettings& settings)
    : fused_(springs_alone(settings) ? &fused_cost(settings) : &kDampedCost) {
  const double springs = settings.network ? double(settings.network->springs.size()) : 0;
  springs_and_points_ = springs + double(settings.positions.rows());
}

double SolverCost::seconds(const Method& method, Precision precision, double evaluations, bool in_double) const {
  const CostTable* table = &method == &filtered_leapfrog()                    ? &kFilteredCost
                           : &method == &xpbd()                               ? &kXpbdCost
                           : std::holds_alternative<Splitting>(method.scheme) ? fused_
                                                                              : &kDampedCost;
  // The general way keeps its price.
  const bool stepped = table == &kGridCost || table == &kNetworkCost;
  const bool single = precision == Precision::Float && !(stepped && in_double);
  return 1e-9 * (single ? table->single : table->twice) * springs_and_points_ * evaluations;
}

ImplicitCost::ImplicitCost(const SoftBodySettings& settings) {
  const Index points = settings.positions.rows();
  std::vector<Coupling> couplings;
  if (settings.network)
    for (const Spring& spring : settings.network->springs) couplings.push_back({spring.a, spring.b, Mat3::Zero()});
  springs_and_points_ = double(points) + double(couplings.size());
  BlockCholesky factors;
  factors.analyse(points, couplings);
  if (!std::isfinite(factors.cost())) return;
  factoring_ = factors.cost();
  // 18 a block of the factors, of which there are about so many.
  solving_ = 18 * std::sqrt(2 * factors.cost() * double(points) / 27);
}

double ImplicitCost::seconds(Precision precision, double evaluations, double products, double steps) const {
  const bool single = precision == Precision::Float;
  const double evaluation = springs_and_points_ * (single ? kDampedCost.single : kDampedCost.twice),
               product = springs_and_points_ * (single ? kProductCost.single : kProductCost.twice);
  const double refactoring = factoring_ > 0 ? product : 0;
  return 1e-9 * (evaluation * evaluations + (product + solving_ + refactoring) * products + factoring_ * steps);
}

double evaluations_of(const Method& method, double ticks, double substeps) {
  if (&method == &xpbd()) return ticks * substeps * kXpbdIterations;
  // What ends with a kick evaluates once more at a tick's end.
  const auto* table = std::get_if<Splitting>(&method.scheme);
  const bool kick_last = table && &method != &filtered_leapfrog() && table->drift.back() == 0;
  return ticks * (substeps * method.evaluations + (kick_last ? 1 : 0));
}

}  // namespace hooke::softbody
