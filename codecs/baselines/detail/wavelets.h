// Discrete wavelet transforms of one curve of any length, by lifting: whatever the length, the inverse gives the curve
// back, but for rounding.
//
//   cdf97                cohen, daubechies, feauveau 1992: the 9/7 pair of image compression. Four vanishing moments on
//                        both sides, symmetric (so curves are mirrored at their ends and no jump stands there), within
//                        a few percent of orthonormal
//   cubic_interpolating  the wavelet that beaudoin, poulin, van de panne 2007 take: odd samples less the cubic through
//                        their four even neighbours (deslauriers, dubuc 1989), even samples updated by 9/32 and -1/32
//                        of the four details around them (sweldens 1996), so that the coarse curve keeps the mean
//
// Coefficients stand from coarse to fine: the coarse curve, then the details of each level. They are scaled so that
// every one has a basis curve of unit length (in the middle of a long curve; to 1 % for the cubic one), so that one
// threshold and one quantiser step suit all.
//
// Sums and products in a fixed order: the same bits on every machine.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kinespace {

enum class Wavelet : std::uint8_t { cdf97, cubic_interpolating };

class WaveletTransform {
 public:
  static constexpr int shortest = 8;      // samples; a shorter curve is not split
  static constexpr int most_levels = 16;  // a curve is split again until it is shorter than `shortest`, or so often

  // Of curves of so many samples, >= 1.
  WaveletTransform(Wavelet wavelet, int length);

  [[nodiscard]] int length() const { return length_; }
  [[nodiscard]] int levels() const { return static_cast<int>(lengths_.size()); }
  // Where the coarse curve, then the details from the coarsest level on, begin; and the end: levels() + 2 numbers.
  [[nodiscard]] std::vector<int> edges() const;

  // length() numbers each; the two may not overlap.
  void forward(std::span<const double> curve, std::span<double> coefficients) const;
  void inverse(std::span<const double> coefficients, std::span<double> curve) const;

 private:
  Wavelet wavelet_;
  int length_;
  std::vector<int> lengths_;  // of what each level splits, the finest first
};

}  // namespace kinespace
