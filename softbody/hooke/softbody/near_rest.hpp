// The force of a spring near its rest length as a series, for kernels written in whatever way. Internal to
// hooke::softbody and not installed.
#pragma once

namespace hooke::softbody {

/// Below this length [m], squared, a spring has no direction. It is added to all squares of lengths.
constexpr double kTiny = 1e-24;

/// Springs whose squared length is off by at most this share of its square at rest take a series.
template <class S>
constexpr S kNear = S(sizeof(S) == 4 ? 0.125 : 0.085);

/// Coefficients for a spring's force over length, k (1 - 1/sqrt(1 + e)) with e = l²/L² - 1, to a unit of the last place
/// for |e| <= kNear. Without root and quotient it costs multiplications alone, which processors do many of at once, and
/// it is exactly zero where e is.
///
/// In float k e g(e) with g by interpolation at the zeros of Chebyshev's polynomials, which keeps what is small as
/// exact as what is not. In double a cubic, y = 1/sqrt(1 + e) to 4e-6, exact at and around e = 0, and one step of third
/// order from there: y (1 + r + 3/2 r²), r = (1 - (1 + e) y²)/2. A series of that precision would have eleven terms.
template <class S>
struct NearRest;
template <>
struct NearRest<float> {
  static constexpr float c[] = {0.500000025f, -0.375000024f, 0.312470649f, -0.273409976f, 0.251080795f, -0.230262271f};
};
template <>
struct NearRest<double> {
  static constexpr double c[] = {1, -0.5, 0.3769874362125975, -0.314289032358835};
};

}  // namespace hooke::softbody
