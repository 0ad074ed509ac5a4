// The force of a spring near its rest length as a series, for kernels written in whatever way. Internal to
// hooke::softbody and not installed.
#pragma once

namespace hooke::softbody {

/// Below this length [m], squared, a spring has no direction. It is added to all squares of lengths.
constexpr double kTiny = 1e-24;

/// Springs whose squared length is off by at most this share of its square at rest take a series.
template <class S>
constexpr S kNear = S(sizeof(S) == 4 ? 0.125 : 0.1);

/// (1 - 1/sqrt(1 + e)) / e to a unit of the last place for |e| <= kNear: interpolated at the zeros of Chebyshev's
/// polynomials. Taken this way, not from a root and a quotient, a spring's force costs multiplications alone, which
/// processors do many of at once, and it is exactly zero where e is.
template <class S>
struct NearRest;
template <>
struct NearRest<float> {
  static constexpr float c[] = {0.500000025f, -0.375000024f, 0.312470649f, -0.273409976f, 0.251080795f, -0.230262271f};
};
template <>
struct NearRest<double> {
  static constexpr double c[] = {0.49999999999999994, -0.37499999999999994, 0.31250000000056027, -0.27343750000054035,
                                 0.24609374934676426, -0.22558593687001458, 0.20947293457775856, -0.19638088365402018,
                                 0.18541704559776184, -0.17614542296905183, 0.17291995622024864, -0.16574349597998742};
};

}  // namespace hooke::softbody
