#include "kinespace/mesh_codecs/detail/linear_prediction.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include <Eigen/Core>
#include <Eigen/LU>

#include "kinespace/entropy/integer_coder.h"
#include "kinespace/mesh_codecs/node_coder.h"

namespace kinespace {
namespace {

constexpr int shortest = 10;              // frames from which on coefficients have predictions of their own
constexpr double weight_step = 1.0 / 64;  // of a_1 and a_2
constexpr int most_weight = 256;          // in these steps

struct Prediction {
  std::int32_t a0 = 0;  // in steps of the coefficients
  std::int32_t a1 = 64, a2 = 0;

  [[nodiscard]] double expected(double before, double earlier, double step) const {
    return step * a0 + weight_step * (a1 * before + a2 * earlier);
  }
};

// Least squares over the frames from the third on, with a little weight on (0, 1, 0).
Prediction fitted(std::span<const double> table, std::size_t width, std::size_t i, int frames, double step) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (int t = 2; t < frames; ++t) {
    const auto at = [&](int s) { return table[static_cast<std::size_t>(s) * width + i]; };
    const Eigen::Vector3d x(step, at(t - 1), at(t - 2));
    normal += x * x.transpose();
    right += x * at(t);
  }
  const double little = step * step;
  normal.diagonal().array() += little;
  right[1] += little;
  const Eigen::Vector3d a = normal.fullPivLu().solve(right);
  const auto rounded = [](double x, double most) {
    return static_cast<std::int32_t>(std::lround(std::isfinite(x) ? std::clamp(x, -most, most) : 0.0));
  };
  Prediction out{.a0 = rounded(a[0], 1e6),
                 .a1 = rounded(a[1] / weight_step, most_weight),
                 .a2 = rounded(a[2] / weight_step, most_weight)};
  const auto energy = [&](const Prediction& p) {
    double sum = 0;
    for (int t = 2; t < frames; ++t) {
      const auto at = [&](int s) { return table[static_cast<std::size_t>(s) * width + i]; };
      const double miss = std::round((at(t) - p.expected(at(t - 1), at(t - 2), step)) / step);
      sum += std::log2(1 + std::abs(miss));
    }
    return sum;
  };
  constexpr double price = 4;  // bits that a prediction of its own costs beside the usual one
  return energy(out) + price < energy({}) ? out : Prediction{};
}

Bytes pack(std::span<const Prediction> predictions) {
  IntegerWriter out;
  for (const Prediction& p : predictions) {
    out.put(p.a1 - 64, 1);
    out.put(p.a2, 2);
    out.put(p.a0, 3);
  }
  return std::move(out).finish();
}

std::vector<Prediction> unpack(std::span<const std::byte> bytes, std::size_t count, const std::string& source) {
  IntegerReader in(bytes, source);
  std::vector<Prediction> out(count);
  for (Prediction& p : out) {
    p.a1 = static_cast<std::int32_t>(in.get_between(-most_weight - 64, most_weight, 1)) + 64;
    p.a2 = static_cast<std::int32_t>(in.get_between(-most_weight, most_weight, 2));
    p.a0 = static_cast<std::int32_t>(in.get_between(-1'000'000, 1'000'000, 3));
  }
  in.expect_end();
  return out;
}

double expected(std::span<const double> decoded, std::span<const double> key, const Prediction& p, std::size_t t,
                std::size_t i, double step) {
  const std::size_t width = key.size();
  if (t == 0) return key[i];
  const double before = decoded[(t - 1) * width + i];
  if (t == 1) return before;
  return p.expected(before, decoded[(t - 2) * width + i], step);
}

NodeGraph line_of(std::size_t functions) {
  NodeGraph out;
  out.first.push_back(0);
  for (std::size_t k = 0; k < functions; ++k) {
    for (std::size_t back = 1; back <= std::min<std::size_t>(k, 4); ++back) {
      out.near.push_back(static_cast<std::int32_t>(k - back));
    }
    out.first.push_back(static_cast<std::int32_t>(out.near.size()));
    out.band.push_back(static_cast<std::uint8_t>(std::min(bit_length(k), 14)));
  }
  return out;
}

}  // namespace

CodedPrediction encode_prediction(std::span<const double> table, std::span<const double> key, int frames, double step) {
  const std::size_t width = key.size();
  std::vector<Prediction> predictions(width);
  if (frames >= shortest) {
    for (std::size_t i = 0; i < width; ++i) predictions[i] = fitted(table, width, i, frames, step);
  }
  CodedPrediction out;
  out.decoded.resize(table.size());
  NodeValues misses{.components = frames, .value = std::vector<double>(table.size())};
  for (std::size_t t = 0; t < static_cast<std::size_t>(frames); ++t) {
    for (std::size_t i = 0; i < width; ++i) {
      const double guess = expected(out.decoded, key, predictions[i], t, i, step);
      const double miss = std::round((table[t * width + i] - guess) / step);
      misses.value[t * width + i] = miss;
      out.decoded[t * width + i] = guess + step * miss;
    }
  }
  if (frames >= shortest) out.coefficients = pack(predictions);
  out.misses = encode_nodes(misses, line_of(width / 3), 0).bytes;
  return out;
}

std::vector<double> decode_prediction(std::span<const std::byte> coefficients, std::span<const std::byte> misses,
                                      std::span<const double> key, int frames, double step, const std::string& source) {
  const std::size_t width = key.size();
  std::vector<Prediction> predictions(width);
  if (frames >= shortest) predictions = unpack(coefficients, width, source);
  const NodeValues found = decode_nodes(misses, frames, line_of(width / 3), source);
  std::vector<double> out(found.value.size());
  for (std::size_t t = 0; t < static_cast<std::size_t>(frames); ++t) {
    for (std::size_t i = 0; i < width; ++i) {
      const double value = expected(out, key, predictions[i], t, i, step) + step * found.value[t * width + i];
      // An unstable prediction of damaged bytes; positions stay finite.
      out[t * width + i] = std::abs(value) < 1e15 ? value : 0;
    }
  }
  return out;
}

}  // namespace kinespace
