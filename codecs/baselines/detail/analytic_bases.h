// The analytic bases that yoo2019 (section 7.2) compares its functions with, orthonormal on the samples of a clip.
//
//   Fourier   1, cos(2 pi m t / n), sin(2 pi m t / n), m = 1, 2, ..: the series of a curve that repeats after
//             n samples. Function 2 m - 1 is the cosine, 2 m the sine. By the chirp transform (bluestein 1970) over a
//             transform of a power of two: n log n for every n
//   Legendre  polynomials of degree 0, 1, 2, .. that are orthonormal on n equal steps (gram's, or discrete chebyshev's;
//             on a fine grid the Legendre polynomials). Each from its difference equation
//                 (t+1)(t+1-n) (p(t+1) - p(t)) - t (t-n) (p(t) - p(t-1)) = k (k+1) p(t)
//             from the end of the grid to its middle, which is the direction in which p grows: orthonormal to 1e-11 for
//             10 000 samples and every degree, where the recurrence over degrees is lost beyond 2 sqrt(n)
//
// Sums, products, quotients and square roots in a fixed order: decoding gives the same bits on every machine.
#pragma once

#include <span>
#include <vector>

namespace kinespace {

class DiscreteFourier {
 public:
  explicit DiscreteFourier(int points);

  // All coefficients of a curve; and the curve of the first coefficients, fewer or as many as points.
  void analyse(std::span<const double> curve, std::span<double> coefficients) const;
  void synthesise(std::span<const double> coefficients, std::span<double> curve) const;

 private:
  struct Numbers {  // complex ones
    std::vector<double> re, im;
    void resize(std::size_t n);
  };
  // sum over t of x(t) exp(-2 pi i m t / n), in place.
  void transform(Numbers& x) const;
  void power_of_two(Numbers& x) const;  // the same of padded_ numbers

  int points_;
  std::size_t padded_ = 1;
  Numbers chirp_;         // exp(-i pi t^2 / n)
  Numbers chirp_filter_;  // the transform of its inverse
  Numbers roots_;         // exp(-2 pi i t / padded_), t < padded_ / 2
};

class DiscreteLegendre {
 public:
  explicit DiscreteLegendre(int points);

  [[nodiscard]] int half() const { return half_; }
  // Degree k at the first half() = (points + 1) / 2 samples; the rest mirrors it, with the sign of (-1)^k.
  void function(int k, std::span<double> out) const;

  // Coefficients [first, last) of curves that were folded.
  void analyse(std::span<const double> folded, int curves, int first, int last, std::span<double> coefficients,
               int stride) const;
  // [curve][2][half]: sums and differences of the samples and their mirror images.
  [[nodiscard]] std::vector<double> fold(std::span<const double> values, int curves) const;

  // [curve][points] from the first `used` coefficients, [curve][stride].
  void synthesise(std::span<const double> coefficients, int curves, int stride, int used,
                  std::span<double> values) const;

 private:
  int points_;
  int half_;
  std::vector<double> here_, degree_, before_;  // p(t+1) = (here + k (k+1) degree) p(t) - before p(t-1)
};

}  // namespace kinespace
