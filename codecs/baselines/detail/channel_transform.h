// What one of the codecs that papers compare with does to the channels of a clip: a transform into coefficients, a
// choice among them, and the way back. Everything else - targets, quantiser, entropy coder, tables, the stream - is the
// same for all of them: channel_codec.h.
//
// Private to this folder.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "kinespace/base/bytes.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/entropy/coefficient_coder.h"

namespace kinespace {

// A clip, or a part of a long one, that is transformed as a whole.
struct ChannelPiece {
  int channels = 0;
  int frames = 0;
  double rate_hz = 0;
  std::vector<double> values;  // [channel][frame], cm and degrees; times weights where the transform is weighted
  Eigen::MatrixXd metric;      // of the values (channel_metric.h): squared cm of joint position, mean over joints
};

// What is asked for. Either a tolerance, which every transform understands (a target sets it), or an amount in the
// transform's own words.
struct Quality {
  double tolerance = 0;  // in units of the values
  double amount = 0;     // where tolerance is 0
  double step = 0;       // of the quantiser; 0: what goes with the error
};

// How coefficients stand in the coder's blocks (coefficient_coder.h).
struct PieceShape {
  int components = 0;
  int functions = 0;
  std::array<int, band_count + 1> edges{};
};

struct PieceCoefficients {
  PieceShape shape;
  int step_index = 0;          // grid_step() of it is the quantiser's step
  std::vector<double> values;  // [component][function], in steps
  Bytes side;                  // what else the way back needs
};

// Quantiser steps are 2^(index / 32), a number that every machine has alike.
inline constexpr int steps_per_octave = 32;
inline constexpr int largest_step_index = 32 * steps_per_octave;
[[nodiscard]] double grid_step(int index);
// The largest step on the grid that is not above; within the grid's ends.
[[nodiscard]] int step_index_below(double step);

// The step whose noise, step^2 / 12 on so many coefficients, is `share` times a squared error (a sum). Not below
// `least`.
[[nodiscard]] double step_for_error(double squared_error, double share, double coefficients, double least);

// A piece, made ready to be asked for coefficients at several qualities.
class PieceAnalysis {
 public:
  virtual ~PieceAnalysis() = default;
  PieceAnalysis() = default;
  PieceAnalysis(const PieceAnalysis&) = delete;
  PieceAnalysis& operator=(const PieceAnalysis&) = delete;
  [[nodiscard]] virtual PieceCoefficients at(const Quality& quality) = 0;
};

class ChannelTransform {
 public:
  virtual ~ChannelTransform() = default;
  ChannelTransform() = default;
  ChannelTransform(const ChannelTransform&) = delete;
  ChannelTransform& operator=(const ChannelTransform&) = delete;

  [[nodiscard]] virtual std::string_view name() const = 0;
  // The first is the transform's own: Quality::amount. Then "step" and "rate_weight".
  [[nodiscard]] virtual std::span<const CodecSetting> settings() const = 0;
  // Whether channels are scaled so that one unit of each moves the body alike, before they are transformed.
  [[nodiscard]] virtual bool weighted() const { return false; }
  // The piece must outlive the analysis.
  [[nodiscard]] virtual std::unique_ptr<PieceAnalysis> analyse(const ChannelPiece& piece) const = 0;

  // Decoding; the same bits on every machine. `side` as at() gave it; throws Error{bad_input} naming `source`.
  [[nodiscard]] virtual PieceShape shape(int channels, int frames, double rate_hz, std::span<const std::byte> side,
                                         const std::string& source) const = 0;
  // coefficients: [component][functions], in units of the values; `shape.functions` may be less than shape() gave when
  // the rest is zero. values: [channel][frame].
  virtual void synthesise(const PieceShape& shape, std::span<const std::byte> side,
                          std::span<const double> coefficients, int frames, double step, std::span<double> values,
                          const std::string& source) const = 0;
};

// The transforms, by their codec's name.
[[nodiscard]] const ChannelTransform& pca_transform();
[[nodiscard]] const ChannelTransform& dwt_transform();
[[nodiscard]] const ChannelTransform& awt_transform();
[[nodiscard]] const ChannelTransform& fourier_transform();
[[nodiscard]] const ChannelTransform& legendre_transform();

}  // namespace kinespace
