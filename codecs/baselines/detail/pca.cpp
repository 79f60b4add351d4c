// The `pca` codec (khan2014, section 4): the mean pose of a clip, the q eigenvectors of its channels' covariance of
// largest eigenvalues, and their coefficients, frame by frame.
//
// As in the paper nothing is predicted in time. Means are kept to a step of the quantiser, eigenvectors so finely that
// they add little to its noise; coefficients are least squares on the eigenvectors as they are kept.
#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "kinespace/codecs/baselines/detail/channel_transform.h"
#include "kinespace/codecs/pose_space/joint_basis.h"
#include "kinespace/entropy/integer_coder.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

constexpr std::array pca_settings{
    CodecSetting::whole("components", 13, 0, 4096, "eigenvectors that are kept of each clip"),
    CodecSetting{"step", 0, 0, 1e3, "quantiser step in degrees (cm) times root channels; 0: what goes with the error"},
    CodecSetting{"rate_weight", 0, 0, 1, "squared steps that a bit is worth when values are chosen"},
};
constexpr double pca_noise_share = 0.5;  // of what was left out
constexpr double pca_rounding = 0.01;    // two decimals
constexpr int least_exponent = 3;        // eigenvectors: an eighth
constexpr int most_exponent = 20;

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct PcaSide {
  int components = 0;
  std::vector<std::int64_t> mean;  // in steps
  JointBasis basis;
};

Bytes pack_side(const PcaSide& side) {
  IntegerWriter numbers;
  numbers.put(side.components);
  for (const std::int64_t m : side.mean) numbers.put(m, 1);
  const Bytes means = std::move(numbers).finish();
  ByteWriter out;
  put_part(out, means);
  out.put_bytes(pack_basis(side.basis));
  return std::move(out).take();
}

PcaSide unpack_side(std::span<const std::byte> bytes, int channels, const std::string& source) {
  ByteReader in(bytes, source);
  IntegerReader numbers(get_part(in, "bytes of means"), source);
  PcaSide out;
  out.components = static_cast<int>(numbers.get_between(0, channels));
  for (int c = 0; c < channels; ++c) out.mean.push_back(numbers.get_between(-(1LL << 37), 1LL << 37, 1));
  numbers.expect_end();
  out.basis = unpack_basis(in.take(in.remaining()), channels, out.components, source);
  return out;
}

PieceShape pca_shape(int components, int frames) {
  PieceShape out{.components = components, .functions = frames};
  out.edges.fill(frames);
  out.edges[0] = 0;
  return out;
}

class PcaAnalysis final : public PieceAnalysis {
 public:
  explicit PcaAnalysis(const ChannelPiece& piece) : piece_(piece) {
    const Eigen::Map<const RowMatrix> values(piece.values.data(), piece.channels, piece.frames);
    mean_ = values.rowwise().mean();
    centred_ = values.colwise() - mean_;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(centred_ * centred_.transpose());
    energy_ = solver.eigenvalues().reverse().cwiseMax(0);  // sums of squares over the frames
    vectors_ = solver.eigenvectors().rowwise().reverse();
  }

  [[nodiscard]] PieceCoefficients at(const Quality& quality) override {
    const int q = components(quality);
    const double samples = static_cast<double>(piece_.channels) * piece_.frames;
    const double lost = quality.tolerance > 0 ? quality.tolerance * quality.tolerance * samples
                                              : energy_.tail(piece_.channels - q).sum();
    const double least = quality.tolerance > 0 ? 0 : pca_rounding;
    const double count = static_cast<double>(q) * piece_.frames;
    PieceCoefficients out{.shape = pca_shape(q, piece_.frames)};
    out.step_index =
        step_index_below(quality.step > 0 ? quality.step : step_for_error(lost, pca_noise_share, count, least));
    const double step = grid_step(out.step_index);

    PcaSide side{.components = q};
    Eigen::VectorXd kept_mean(piece_.channels);
    for (int c = 0; c < piece_.channels; ++c) {
      side.mean.push_back(std::llround(mean_[c] / step));
      kept_mean[c] = step * static_cast<double>(side.mean.back());
    }
    std::vector<int> exponents;
    for (int k = 0; k < q; ++k) {
      const double rms = std::sqrt(energy_[k] / piece_.frames);
      const int exponent = static_cast<int>(std::ceil(std::log2(std::max(rms / step, 1e-3)))) + 1;
      exponents.push_back(std::clamp(exponent, least_exponent, most_exponent));
    }
    side.basis = quantise_basis(vectors_.leftCols(q), exponents);
    const Eigen::MatrixXd basis = side.basis.mixing();
    out.values.resize(static_cast<std::size_t>(q) * static_cast<std::size_t>(piece_.frames));
    if (q > 0) {
      const Eigen::MatrixXd gram = basis.transpose() * basis;
      const RowMatrix wanted = centred_.colwise() + (mean_ - kept_mean);
      Eigen::Map<RowMatrix>(out.values.data(), q, piece_.frames) = gram.ldlt().solve(basis.transpose() * wanted) / step;
    }
    out.side = pack_side(side);
    return out;
  }

 private:
  // A tolerance asks for as many as leave out no more, root mean square.
  [[nodiscard]] int components(const Quality& quality) const {
    if (!(quality.tolerance > 0)) return std::min(piece_.channels, static_cast<int>(std::lround(quality.amount)));
    const double allowed = quality.tolerance * quality.tolerance * piece_.channels * piece_.frames;
    double lost = 0;
    int q = piece_.channels;
    while (q > 0 && lost + energy_[q - 1] <= allowed) lost += energy_[--q];
    return q;
  }

  const ChannelPiece& piece_;
  Eigen::VectorXd mean_;
  RowMatrix centred_;
  Eigen::VectorXd energy_;
  Eigen::MatrixXd vectors_;
};

class PcaTransform final : public ChannelTransform {
 public:
  [[nodiscard]] std::string_view name() const override { return "pca"; }
  [[nodiscard]] std::span<const CodecSetting> settings() const override { return pca_settings; }
  [[nodiscard]] std::unique_ptr<PieceAnalysis> analyse(const ChannelPiece& piece) const override {
    return std::make_unique<PcaAnalysis>(piece);
  }
  [[nodiscard]] PieceShape shape(int channels, int frames, double /*rate_hz*/, std::span<const std::byte> side,
                                 const std::string& source) const override {
    return pca_shape(unpack_side(side, channels, source).components, frames);
  }
  void synthesise(const PieceShape& shape, std::span<const std::byte> side, std::span<const double> coefficients,
                  int frames, double step, std::span<double> values, const std::string& source) const override {
    const auto n = static_cast<std::size_t>(frames), used = static_cast<std::size_t>(shape.functions);
    const int channels = static_cast<int>(values.size() / n);
    const PcaSide parts = unpack_side(side, channels, source);
    const Eigen::MatrixXd basis = parts.basis.mixing();
    for (int c = 0; c < channels; ++c) {
      const std::span<double> curve = values.subspan(static_cast<std::size_t>(c) * n, n);
      std::ranges::fill(curve, step * static_cast<double>(parts.mean[static_cast<std::size_t>(c)]));
      for (int k = 0; k < parts.components; ++k) {
        const double weight = basis(c, k);
        const double* score = coefficients.data() + static_cast<std::size_t>(k) * used;
        for (std::size_t t = 0; t < used; ++t) curve[t] += weight * score[t];
      }
    }
  }
};

}  // namespace

const ChannelTransform& pca_transform() {
  static const PcaTransform transform;
  return transform;
}

}  // namespace kinespace
