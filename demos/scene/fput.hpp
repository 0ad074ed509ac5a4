// The chain of stiff and soft springs of Fermi, Pasta, Ulam and Tsingou in the form of Hairer, Lubich
// and Wanner: fast vibrations that trade their energy slowly. For tests, demos and the report.
#pragma once

#include <hooke/point_body.hpp>

namespace hooke::scene {

/// 2m points of 1 kg between two walls, joined by m stiff linear springs (1-2, 3-4, …) and m + 1 soft
/// quartic ones (wall-1, 2-3, …, 2m-wall):
///
///     H = ½ Σ p² + ω²/4 Σ (q[2i] - q[2i-1])² + Σ (q[2i+1] - q[2i])⁴.
///
/// Source: Hairer, Lubich, Wanner, "Geometric Numerical Integration", I.5 and XIII.
struct FputChain {
  int stiff_springs = 3;  ///< m, > 0
  double omega = 50;      ///< [rad/s], of a stiff spring, > 0
};

/// The chain as a body, at the start that the literature takes: with x0 = (q[2i] + q[2i-1])/√2 and
/// x1 = (q[2i] - q[2i-1])/√2 of the first stiff spring, x0 = 1, x0' = 1, x1 = 1/ω, x1' = 1, all else 0.
/// The x coordinate of a point is its displacement q [m]; y is its number [m], so that it can be
/// drawn; nothing moves along y and z. body.energy(0).total() is H: 2.00120008 J for the default.
/// @throws std::invalid_argument where stiff_springs or omega is not positive
template <class S>
std::unique_ptr<PointBody<S>> fput_body(const MotionSettings& motion, const FputChain& chain = {});

/// I_j = ½ (x1_j'² + ω² x1_j²) of each stiff spring [J], shape (m).
Values<double> stiff_energies(const Body& body, const FputChain& chain = {});

extern template std::unique_ptr<PointBody<float>> fput_body(const MotionSettings&, const FputChain&);
extern template std::unique_ptr<PointBody<double>> fput_body(const MotionSettings&, const FputChain&);

}  // namespace hooke::scene
