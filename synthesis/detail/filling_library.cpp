#include "kinespace/synthesis/detail/filling_library.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <Eigen/Eigenvalues>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/alignment.h"

namespace kinespace {
namespace {

constexpr double least_weight_m = 0.02;  // joints that nothing hangs on (hands, toes) turn visibly too
constexpr int index_axes = 24;           // 99 % of the variance of poses and more
constexpr int row_step = 3;              // frames between the rows that are compared: 0.1 s
constexpr double fade_s = 0.12;          // rows count less the further they are from the gap
constexpr float change_weight = 10;      // of the change from row to row against the row itself
constexpr int most_windows = 70000;      // beyond, every second, third, .. start is looked at

using Root = Eigen::Matrix<float, 1, 7>;

// The rows of a window that are compared, each with its neighbour further from the gap (-1: none).
struct SearchRow {
  int row = 0;
  int neighbour = -1;
  float weight = 0;
  bool after = false;
};

std::vector<SearchRow> search_rows(const WindowShape& shape) {
  std::vector<SearchRow> out;
  float sum = 0;
  const auto add = [&](int steps, int row, bool has_neighbour, bool after) {
    const double away = steps * row_step / filling_rate_hz;
    const int neighbour = has_neighbour ? static_cast<int>(out.size()) + 1 : -1;
    out.push_back({row, neighbour, static_cast<float>(std::exp(-away / fade_s)), after});
    sum += out.back().weight;
  };
  for (int k = 0; k * row_step < shape.before; ++k) {
    add(k, shape.before - 1 - k * row_step, (k + 1) * row_step < shape.before, false);
  }
  for (int k = 0; k * row_step < shape.after; ++k) {
    add(k, shape.before + shape.gap + k * row_step, (k + 1) * row_step < shape.after, true);
  }
  for (SearchRow& row : out) row.weight /= sum;
  return out;
}

}  // namespace

Root placed_root(const float* root, const float* reference) {
  const float length = std::hypot(reference[3], reference[5]);
  const float c = length > 1e-9F ? reference[3] / length : 1.0F;   // cos and sin of half the heading
  const float s = length > 1e-9F ? -reference[5] / length : 0.0F;  // turned back
  const float cos = c * c - s * s;
  const float sin = 2 * c * s;
  const float x = root[0] - reference[0];
  const float z = root[2] - reference[2];
  Root out;
  out << cos * x + sin * z, root[1], cos * z - sin * x, c * root[3] - s * root[5], c * root[4] + s * root[6],
      c * root[5] + s * root[3], c * root[6] - s * root[4];
  return out;
}

SampleMatrix resampled_curves(const ClipCurves& curves, double rate_hz) {
  SampleMatrix values = curves.values;
  values.col(1).array() += curves.placement.start_cm.y() / 100;
  const double step = curves.rate_hz / rate_hz;
  const auto count = static_cast<Eigen::Index>(std::floor((curves.frames() - 1) / step + 1e-9)) + 1;
  SampleMatrix out(count, values.cols());
  if (std::abs(step - std::round(step)) < 1e-9) {
    for (Eigen::Index i = 0; i < count; ++i) out.row(i) = values.row(i * static_cast<Eigen::Index>(std::lround(step)));
    return out;
  }
  const UniformSpline spline(std::move(values));
  for (Eigen::Index i = 0; i < count; ++i) spline.value(static_cast<double>(i) * step, out.row(i));
  return out;
}

FillLibrary::FillLibrary(const PreparedSource& clips, const Progress& progress) {
  if (clips.count < 1) {
    throw Error(ErrorKind::usage, {.found = "no clips", .expected = "at least one clip to learn from"});
  }
  std::vector<SampleMatrix> curves(static_cast<std::size_t>(clips.count));
  for (int i = 0; i < clips.count; ++i) {
    PreparedClip clip = clips.load(i);
    if (i == 0) skeleton_ = clip.skeleton;
    if (!skeleton_.same_tree(clip.skeleton)) {
      throw Error(ErrorKind::bad_input, {.file = clip.curves.name,
                                         .found = "another skeleton than that of the first clip",
                                         .expected = "clips of one joint tree"});
    }
    curves[static_cast<std::size_t>(i)] = resampled_curves(clip.curves, filling_rate_hz);
    progress.at("read", static_cast<double>(i + 1) / clips.count);
    progress.check_stop();
  }
  layout_ = curve_layout(skeleton_);
  weights_ = curve_weights(skeleton_).cwiseMax(least_weight_m);
  weights_.head<3>().setOnes();
  OrientationMoments orientations(layout_.joint_count());
  for (const SampleMatrix& c : curves) orientations.add(c);
  references_ = orientations.references();
  for (SampleMatrix& c : curves) {
    tracks_.push_back(track_of(c));
    frames_ += tracks_.back().frames();
    c.resize(0, 0);
  }
  find_axes();
}

FillTrack FillLibrary::track_of(const SampleMatrix& curves) const {
  FillTrack out;
  out.root = curves.leftCols<7>().cast<float>();
  SampleMatrix body = curves.rightCols(curves.cols() - 7);
  for (Eigen::Index j = 0; j < body.cols() / 4; ++j) {
    auto q = body.middleCols<4>(4 * j);
    // One side for the whole track, the one most of it is on, so that it stays continuous.
    const double side = (q * references_.col(j + 1)).sum() < 0 ? -1 : 1;
    q *= side * weights_(7 + 4 * j);
  }
  out.body = body.cast<float>();
  if (axes_.size() > 0) out.index = out.body * axes_;
  return out;
}

// Principal axes of all poses, from their covariance. Distances between poses need no mean.
void FillLibrary::find_axes() {
  const Eigen::Index n = tracks_.front().body.cols();
  if (n == 0) return;
  Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(n);
  for (const FillTrack& t : tracks_) mean += t.body.cast<double>().colwise().sum();
  mean /= frames_;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (const FillTrack& t : tracks_) {
    const Eigen::MatrixXd centred = t.body.cast<double>().rowwise() - mean;
    covariance.selfadjointView<Eigen::Lower>().rankUpdate(centred.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  axes_ = eigen.eigenvectors().rightCols(std::min<Eigen::Index>(index_axes, n)).cast<float>();
  for (FillTrack& t : tracks_) t.index = t.body * axes_;
}

void FillLibrary::window(const FillTrack& track, int start, const WindowShape& shape,
                         Eigen::Ref<FeatureMatrix> out) const {
  const Root root_weights = weights_.head<7>().cast<float>();
  const float* reference = track.root.row(start + shape.reference()).data();
  for (int r = 0; r < shape.frames(); ++r) {
    out.row(r).head<7>() = placed_root(track.root.row(start + r).data(), reference).cwiseProduct(root_weights);
  }
  out.rightCols(track.body.cols()) = track.body.middleRows(start, shape.frames());
}

std::vector<FillWindow> FillLibrary::nearest(const FillTrack& query, const WindowShape& shape,
                                             const Search& search) const {
  const std::vector<SearchRow> rows = search_rows(shape);
  const Root root_weights = weights_.head<7>().cast<float>();
  const int right = shape.before + shape.gap;
  const auto all = tracks_.size() + search.extra.size();
  const int stride = std::max(1, (frames_ + most_windows - 1) / most_windows);
  const auto features = [&](const FillTrack& t, int start, FeatureMatrix& out) {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const int from = search.free_placement && rows[k].after ? right : shape.reference();
      const auto i = static_cast<Eigen::Index>(k);
      out.row(i).head<7>() = placed_root(t.root.row(start + rows[k].row).data(), t.root.row(start + from).data())
                                 .cwiseProduct(root_weights);
      out.row(i).tail(t.index.cols()) = t.index.row(start + rows[k].row);
    }
  };
  FeatureMatrix own(static_cast<Eigen::Index>(rows.size()), 7 + query.index.cols());
  features(query, 0, own);

  std::vector<std::vector<FillWindow>> found(all);
  parallel_for(std::size_t{0}, all, [&](std::size_t i) {
    if (static_cast<int>(i) == search.without) return;
    const bool of_library = i < tracks_.size();
    const FillTrack& t = of_library ? tracks_[i] : search.extra[i - tracks_.size()];
    FeatureMatrix other(own.rows(), own.cols());
    for (int start = 0; start + shape.frames() <= t.frames(); start += of_library ? stride : 1) {
      features(t, start, other);
      other -= own;
      float sum = 0;
      for (std::size_t k = 0; k < rows.size(); ++k) {
        const auto row = other.row(static_cast<Eigen::Index>(k));
        sum += rows[k].weight * row.squaredNorm();
        if (rows[k].neighbour >= 0) {
          sum += change_weight * rows[k].weight * (row - other.row(rows[k].neighbour)).squaredNorm();
        }
      }
      found[i].push_back({sum, static_cast<int>(i), start});
    }
  });
  std::vector<FillWindow> out;
  for (const auto& part : found) out.insert(out.end(), part.begin(), part.end());
  const auto count = std::min(out.size(), static_cast<std::size_t>(std::max(search.count, 0)));
  const auto nearer = [](const FillWindow& a, const FillWindow& b) {
    return std::tie(a.distance, a.track, a.start) < std::tie(b.distance, b.track, b.start);
  };
  std::ranges::partial_sort(out, out.begin() + static_cast<std::ptrdiff_t>(count), nearer);
  out.resize(count);
  return out;
}

}  // namespace kinespace
