#include "kinespace/codecs/pose_space/detail/pose_space_encoder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include <tbb/parallel_for.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/pose_space/time_blocks.h"

namespace kinespace {
namespace {

constexpr std::size_t metric_samples = 256;
constexpr int planned_components = 16;  // that windows are planned by: nearly all of the energy

using Curves = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

Curves curves_of(const PoseVectors& vectors, int dimensions) {
  return {vectors.values.data(), dimensions, vectors.frames};
}

std::vector<int> equal_windows(int frames, int wanted) {
  const int count = std::max(1, (frames + wanted / 2) / wanted);
  std::vector<int> out;
  for (int i = 0; i < count; ++i) {
    const auto at = [&](int k) { return static_cast<int>(static_cast<std::int64_t>(frames) * k / count); };
    out.push_back(at(i + 1) - at(i));
  }
  return out;
}

void require_same_tree(const PoseSpaceBasis& basis, const Clip& clip) {
  if (basis.skeletons().front().same_tree(clip.skeleton)) return;
  throw Error(ErrorKind::usage, {.file = clip.name,
                                 .found = "a skeleton of another tree than the basis",
                                 .expected = "clips of the skeleton that the basis was learned from"});
}

}  // namespace

PoseSpaceEncoder::PoseSpaceEncoder(std::span<const Clip> clips, const Progress& progress, const PoseSpaceBasis* basis)
    : clips_(clips), progress_(progress), basis_(basis), vectors_(clips.size()) {
  for (const Clip& clip : clips) {
    const int skeleton = table_.add_skeleton(clip.skeleton, clip.name);
    table_.clips.push_back({.name = clip.name, .skeleton = skeleton, .rate_hz = clip.rate_hz, .frames = clip.frames});
    frames_ += clip.frames;
  }
  if (basis_ != nullptr) {
    require_same_tree(*basis_, clips.front());
    reference_ = basis_->reference();
  } else {
    reference_ = reference_pose(clips);
  }
  take_vectors();
  add_moments();
  add_metrics();
}

void PoseSpaceEncoder::take_vectors() {
  progress_.check_stop();
  tbb::parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
    vectors_[c] = {};
    vectors_[c] = pose_vectors(clips_[c], reference_);
    table_.clips[c].placement = vectors_[c].placement;
    table_.clips[c].side_tracks = std::move(vectors_[c].side_tracks);
  });
}

void PoseSpaceEncoder::add_moments() {
  const int d = reference_.dimensions();
  std::vector<Eigen::MatrixXd> parts(vectors_.size());
  tbb::parallel_for(std::size_t{0}, vectors_.size(), [&](std::size_t c) {
    const Curves x = curves_of(vectors_[c], d);
    parts[c] = Eigen::MatrixXd::Zero(d, d);
    parts[c].selfadjointView<Eigen::Lower>().rankUpdate(x);
  });
  moments_ = Eigen::MatrixXd::Zero(d, d);
  for (const Eigen::MatrixXd& part : parts) moments_ += part;
  moments_ = Eigen::MatrixXd(moments_.selfadjointView<Eigen::Lower>()) / static_cast<double>(frames_);
}

void PoseSpaceEncoder::add_metrics() {
  const int d = reference_.dimensions();
  const std::int64_t samples = std::min<std::int64_t>(frames_, metric_samples);
  std::vector<PoseMetric> parts(static_cast<std::size_t>(samples));
  std::vector<std::int64_t> first{0};
  for (const PoseVectors& v : vectors_) first.push_back(first.back() + v.frames);
  tbb::parallel_for(std::int64_t{0}, samples, [&](std::int64_t s) {
    const std::int64_t frame = (2 * s + 1) * frames_ / (2 * samples);
    const auto c = static_cast<std::size_t>(std::ranges::upper_bound(first, frame) - first.begin()) - 1;
    const Eigen::VectorXd pose = curves_of(vectors_[c], d).col(frame - first[c]);
    const Skeleton& skeleton = table_.skeletons[static_cast<std::size_t>(table_.clips[c].skeleton)];
    parts[static_cast<std::size_t>(s)] =
        pose_metric(skeleton, reference_, std::span(pose.data(), static_cast<std::size_t>(d)));
  });
  metrics_ = {Eigen::MatrixXd::Zero(d, d), Eigen::MatrixXd::Zero(d, d)};
  for (const PoseMetric& part : parts) {
    metrics_.positions += part.positions / static_cast<double>(samples);
    metrics_.shell += part.shell / static_cast<double>(samples);
  }
}

void PoseSpaceEncoder::plan(double step, const PoseSpaceSettings& settings) {
  if (!windows_.empty()) take_vectors();  // the plan before made coefficients of them
  weigh(settings.shell_weight);
  tbb::parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) { cut(c, step, settings); });
  transform();
  measure_energies();
}

void PoseSpaceEncoder::weigh_again(const PoseSpaceSettings& settings) {
  weigh(settings.shell_weight);
  measure_energies();
}

void PoseSpaceEncoder::weigh(double shell_weight) {
  metric_ = metrics_.combined(shell_weight);
  exact_ = karhunen_loeve(metric_, moments_);
}

void PoseSpaceEncoder::transform() {
  progress_.check_stop();
  windows_.clear();
  first_window_.assign(1, 0);
  std::map<int, std::shared_ptr<const WindowTransform>> transforms;
  for (std::size_t c = 0; c < clips_.size(); ++c) {
    int first = 0;
    for (const int points : table_.clips[c].blocks) {
      windows_.push_back({.clip = c, .first = first, .points = points});
      transforms[points] = nullptr;
      first += points;
    }
    first_window_.push_back(windows_.size());
  }
  std::vector<int> lengths;
  for (const auto& [points, none] : transforms) lengths.push_back(points);
  tbb::parallel_for(std::size_t{0}, lengths.size(), [&](std::size_t i) {
    transforms.at(lengths[i]) = std::make_shared<const WindowTransform>(lengths[i], lengths[i]);
  });

  const int d = reference_.dimensions();
  tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    const Window& window = windows_[w];
    PoseVectors& vectors = vectors_[window.clip];
    double* const place = vectors.values.data() + window.first;
    RowMatrix out(d, window.points);
    transforms.at(window.points)->analyse(place, vectors.frames, d, out.data());
    Eigen::Map<RowMatrix, 0, Eigen::OuterStride<>>(place, d, window.points, Eigen::OuterStride<>(vectors.frames)) = out;
  });
  progress_.check_stop();
}

PoseSpaceEncoder::Coefficients PoseSpaceEncoder::coefficients(std::size_t w) const {
  const Window& window = windows_[w];
  const PoseVectors& vectors = vectors_[window.clip];
  return {vectors.values.data() + window.first, reference_.dimensions(), window.points,
          Eigen::OuterStride<>(vectors.frames)};
}

void PoseSpaceEncoder::measure_energies() {
  const RowMatrix root = Eigen::MatrixXd(metric_.llt().matrixU());
  energies_.resize(windows_.size());
  tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    const RowMatrix moved = root.triangularView<Eigen::Upper>() * coefficients(w);
    energies_[w].resize(static_cast<std::size_t>(moved.cols()));
    Eigen::Map<Eigen::RowVectorXd>(energies_[w].data(), moved.cols()) = moved.colwise().squaredNorm();
  });
}

void PoseSpaceEncoder::cut(std::size_t c, double step, const PoseSpaceSettings& settings) {
  const int d = reference_.dimensions();
  const int planned = std::min(planned_components, d);
  const RowMatrix analysis = (exact_.basis.transpose() * metric_).topRows(planned) / step;
  const RowMatrix z = analysis * curves_of(vectors_[c], d);
  ClipEntry& clip = table_.clips[c];
  const std::vector<int> jumps = find_jumps(z, step, vectors_[c].jumps);
  if (settings.window_s > 0) {
    const auto wanted = std::clamp<std::int64_t>(std::llround(settings.window_s * clip.rate_hz), 1, longest_block / 2);
    clip.blocks.clear();
    int first = 0;
    for (std::size_t j = 0; j <= jumps.size(); ++j) {
      const int last = j < jumps.size() ? jumps[j] : clip.frames;
      const auto stretch = equal_windows(last - first, static_cast<int>(wanted));
      clip.blocks.insert(clip.blocks.end(), stretch.begin(), stretch.end());
      first = last;
    }
  } else {
    clip.blocks = plan_blocks({z.data(), static_cast<std::size_t>(z.size())}, planned, clip.frames, clip.rate_hz, jumps,
                              {.longest_frames = longest_block});
  }
  clip.finer.assign(clip.blocks.size(), 0);
}

}  // namespace kinespace
