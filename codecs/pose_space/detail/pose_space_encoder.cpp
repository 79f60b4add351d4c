#include "kinespace/codecs/pose_space/detail/pose_space_encoder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/pose_space/time_blocks.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/measured_stream.h"
#include "kinespace/storage/bitstream.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

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
  moments_ = pose_moments(vectors_, reference_.dimensions());
  metrics_ = mean_pose_metric(clips_, vectors_, reference_);
}

void PoseSpaceEncoder::take_vectors() {
  progress_.check_stop();
  parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
    vectors_[c] = {};
    vectors_[c] = pose_vectors(clips_[c], reference_);
    table_.clips[c].placement = vectors_[c].placement;
    table_.clips[c].side_tracks = std::move(vectors_[c].side_tracks);
  });
}

void PoseSpaceEncoder::plan(double step, const PoseSpaceSettings& settings) {
  if (!windows_.empty()) take_vectors();  // the plan before made coefficients of them
  weigh(settings.shell_weight);
  parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) { cut(c, step, settings); });
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
  parallel_for(std::size_t{0}, lengths.size(), [&](std::size_t i) {
    transforms.at(lengths[i]) = std::make_shared<const WindowTransform>(lengths[i], lengths[i]);
  });

  const int d = reference_.dimensions();
  parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
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
  parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    const RowMatrix moved = root.triangularView<Eigen::Upper>() * coefficients(w);
    energies_[w].resize(static_cast<std::size_t>(moved.cols()));
    Eigen::Map<Eigen::RowVectorXd>(energies_[w].data(), moved.cols()) = moved.colwise().squaredNorm();
  });
}

void PoseSpaceEncoder::cut(std::size_t c, double step, const PoseSpaceSettings& settings) {
  const int d = reference_.dimensions();
  const int planned = std::min(planned_components, d);
  const RowMatrix analysis = (exact_.basis.transpose() * metric_).topRows(planned) / step;
  const RowMatrix z = analysis * pose_curves(vectors_[c], d);
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

// One attempt: coding at a step with the windows that are planned.

namespace {

constexpr std::size_t windows_at_once = 16;

double finer_factor(int finer) {
  return std::pow(2.0, 0.5 * finer);
}

}  // namespace

// The functions of a window up to the last whose coefficients, all components together, are not sure to be coded as
// zero: of recordings at 120 Hz a quarter or less.
int PoseSpaceEncoder::active_functions(std::size_t window, double step) const {
  const std::vector<double>& energy = energies_[window];
  std::size_t n = energy.size();
  while (n > 0 && energy[n - 1] < 0.25 * step * step) --n;
  return static_cast<int>(n);
}

// What coding each component takes off the squared error, in squared steps, less what its bits are worth.
Eigen::VectorXd PoseSpaceEncoder::gains(double step, const WindowLayout& layout,
                                        std::span<const std::size_t> windows) const {
  constexpr double bits_of_value = 7;
  constexpr double bits_of_entry = 3;
  constexpr double worth = 0.12;
  const Eigen::Index d = reference_.dimensions();
  const RowMatrix analysis = exact_.basis.transpose() * metric_ / step;  // B' M B = I
  // A sample of the windows is to pay for its share of the basis.
  const double price = worth * bits_of_entry * static_cast<double>(d) * static_cast<double>(windows.size()) /
                       static_cast<double>(window_count());
  std::vector<Eigen::VectorXd> parts((windows.size() + windows_at_once - 1) / windows_at_once);
  parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
    parts[part] = Eigen::VectorXd::Zero(d);
    const std::size_t end = std::min(windows.size(), (part + 1) * windows_at_once);
    for (std::size_t i = part * windows_at_once; i < end; ++i) {
      const std::size_t w = windows[i];
      const double finer = finer_factor(layout.windows[w].finer);
      const RowMatrix z = (finer * analysis) * coefficients(w).leftCols(active_functions(w, step / finer));
      for (Eigen::Index c = 0; c < d; ++c) {
        for (Eigen::Index k = 0; k < z.cols(); ++k) {
          const double square = z(c, k) * z(c, k);
          if (square > surely_zero * surely_zero) parts[part](c) += square - 1.0 / 12 - worth * bits_of_value;
        }
      }
    }
  });
  Eigen::VectorXd out = Eigen::VectorXd::Constant(d, -price);
  for (const Eigen::VectorXd& part : parts) out += part;
  return out;
}

// The components that pay, as they are sent.
void PoseSpaceEncoder::choose_basis(const WindowLayout& layout, std::span<const std::size_t> windows, bool all,
                                    PoseSpaceTables& tables) const {
  const double step = tables.step;
  const int d = reference_.dimensions();
  const Eigen::VectorXd gain = gains(step, layout, windows);
  std::vector<int> kept;
  for (int c = 0; c < d; ++c) {
    if (all || gain(c) > 0) kept.push_back(c);
  }
  tables.basis =
      sent_basis(exact_, kept, step, metric_at_rest(tables.reference, table_.skeletons.front(), tables.shell_weight));
}

// The state of one attempt.
struct PoseSpaceEncoder::Coding {
  Attempt attempt;
  std::vector<RowMatrix> wanted;             // by window, [component][active function], in steps
  std::vector<CodingStatistics> statistics;  // by group
  std::vector<ClipErrorSums> errors;

  [[nodiscard]] CodingStatistics total() const {
    CodingStatistics out;
    for (const CodingStatistics& one : statistics) out.add(one);
    return out;
  }
};

void PoseSpaceEncoder::code_groups(Coding& coding, const PoseSpaceSettings& settings, bool measure) const {
  Attempt& a = coding.attempt;
  const auto components = static_cast<std::size_t>(a.tables.basis.components);
  a.layout = lay_out(a.clips, a.tables.coding.spectrum, a.tables.group_frames);
  a.groups.assign(a.layout.groups.size(), {});
  a.largest.assign(a.layout.windows.size(), 0.0);
  coding.statistics.assign(a.layout.groups.size(), {});
  coding.errors.assign(a.layout.groups.size(), {});
  const WindowSynthesis synthesis(a.tables, table_.skeletons.front());
  parallel_for(std::size_t{0}, a.layout.groups.size(), [&](std::size_t g) {
    if (g % static_cast<std::size_t>(settings.sample) != 0) return;
    progress_.check_stop();
    const WindowGroup& group = a.layout.groups[g];
    std::vector<std::vector<double>> wanted(group.count), values(group.count);
    std::vector<CoefficientBlock> blocks;
    for (std::size_t i = 0; i < group.count; ++i) {
      const WindowPlace& window = a.layout.windows[group.first + i];
      const auto functions = static_cast<std::size_t>(window.functions);
      const RowMatrix& active = coding.wanted[group.first + i];
      const Eigen::Index known = std::min<Eigen::Index>(active.cols(), window.functions);
      wanted[i].assign(components * functions, 0.0);
      values[i].assign(components * functions, 0.0);
      Eigen::Map<RowMatrix>(wanted[i].data(), active.rows(), window.functions).leftCols(known) = active.leftCols(known);
      blocks.push_back({window.functions, window.edges, window.follows, wanted[i], values[i]});
    }
    a.groups[g] = encode_group(blocks, a.tables.coding, settings.rate_weight, coding.statistics[g]);
    if (!measure) return;
    WindowSynthesis::Scratch scratch;
    std::vector<double> vectors;
    for (std::size_t i = 0; i < group.count; ++i) {
      const WindowPlace& window = a.layout.windows[group.first + i];
      const auto c = static_cast<std::size_t>(window.clip);
      vectors.resize(static_cast<std::size_t>(reference_.dimensions()) * static_cast<std::size_t>(window.points));
      synthesis.synthesise(window, values[i], vectors, scratch);
      Clip decoded = slice(clips_[c], window.first, window.points);
      PoseWriter(reference_, a.clips.clips[c].placement, decoded).write(vectors, 0, window.points);
      const ClipErrorSums error = clip_error(clips_[c], decoded, window.first, window.points, 0);
      coding.errors[g].add(error);
      a.largest[group.first + i] = error.largest;
    }
  });
  a.error = {};
  for (const ClipErrorSums& error : coding.errors) a.error.add(error);
}

Attempt PoseSpaceEncoder::attempt(double step, const PoseSpaceSettings& settings, const Attempt* learned,
                                  std::span<const int> finer) const {
  Coding coding;
  Attempt& a = coding.attempt;
  a.clips = table_;
  a.tables.step = step;
  a.tables.shell_weight = settings.shell_weight;
  a.tables.group_frames = settings.group_frames;
  a.tables.reference = reference_;
  for (std::size_t c = 0; c < clips_.size() && !finer.empty(); ++c) {
    for (std::size_t b = 0; b < a.clips.clips[c].blocks.size(); ++b)
      a.clips.clips[c].finer[b] = finer[first_window_[c] + b];
  }
  a.layout = lay_out(a.clips, {}, settings.group_frames);
  std::vector<std::size_t> windows;  // that are coded
  for (std::size_t g = 0; g < a.layout.groups.size(); g += static_cast<std::size_t>(settings.sample)) {
    for (std::size_t i = 0; i < a.layout.groups[g].count; ++i) windows.push_back(a.layout.groups[g].first + i);
  }
  if (basis_ != nullptr) {
    a.rung = basis_->rung_for(step);
    const PoseSpaceTables& rung = basis_->rungs()[static_cast<std::size_t>(a.rung)];
    a.tables.shell_weight = rung.shell_weight;
    a.tables.basis = rung.basis;
    a.tables.coding = rung.coding;
  } else {
    choose_basis(a.layout, windows, settings.all_components, a.tables);
  }
  const RowMatrix projection =
      projection_onto(WindowSynthesis(a.tables, table_.skeletons.front()).basis(), metric_) / step;
  const int components = a.tables.basis.components;

  // Scaled coefficients, and what the spectrum of their plain rounding is.
  coding.wanted.resize(windows_.size());
  std::vector<CodingStatistics> plain((windows.size() + windows_at_once - 1) / windows_at_once);
  parallel_for(std::size_t{0}, plain.size(), [&](std::size_t part) {
    const std::size_t end = std::min(windows.size(), (part + 1) * windows_at_once);
    for (std::size_t i = part * windows_at_once; i < end; ++i) {
      const std::size_t w = windows[i];
      const WindowPlace& window = a.layout.windows[w];
      const double factor = finer_factor(window.finer);
      const int functions = active_functions(w, step / factor);
      RowMatrix& wanted = coding.wanted[w];
      wanted.noalias() = (factor * projection) * coefficients(w).leftCols(functions);
      plain[part].add_plain({wanted.data(), static_cast<std::size_t>(wanted.size())}, functions, window.points,
                            a.clips.clips[static_cast<std::size_t>(window.clip)].rate_hz, components);
    }
  });
  CodingStatistics first;
  for (const CodingStatistics& one : plain) first.add(one);
  a.tables.coding.spectrum = Spectrum::of(first, components);
  if (learned != nullptr && basis_ == nullptr) {
    a.tables.coding.start = learned->tables.coding.start;
    a.tables.coding.points = learned->tables.coding.points;
  }
  const bool estimate = settings.sample > 1;
  code_groups(coding, settings, estimate);
  CodingStatistics total = coding.total();
  if (!estimate) {
    // Once more with what was learned.
    a.tables.coding.spectrum = Spectrum::of(total, components);
  }
  if (basis_ == nullptr) {
    a.tables.coding.start = total.counts.learn();
    a.tables.coding.points = total.reconstruction();
  }
  if (!estimate) code_groups(coding, settings, true);
  return std::move(coding.attempt);
}

namespace {

Bytes write_stream(const Attempt& attempt, const MeasuredError& error, const PoseSpaceBasis* basis) {
  BitstreamWriter out(stream_kind("motion-space"));
  out.set_error(error);
  if (basis != nullptr) out.set_option("basis", basis->id());
  const Bytes clips = pack_clip_table(attempt.clips, basis != nullptr ? basis->skeletons() : std::vector<Skeleton>());
  const Bytes tables =
      basis != nullptr ? pack_own_tables(attempt.tables, attempt.rung) : pack_pose_space_tables(attempt.tables);
  std::vector<Bytes> layers;
  std::size_t size = clips.size() + tables.size();
  for (std::size_t layer = 0; layer < layer_count; ++layer) {
    std::vector<Bytes> groups;
    for (const auto& group : attempt.groups) groups.push_back(group[layer]);
    layers.push_back(pack_parts(groups));
    size += layers.back().size();
  }
  out.add_section("clips", clips);
  out.add_section("tables", tables);
  add_padding(out, size, attempt.clips.frames());
  out.add_progressive_section("layers", layers);
  return out.finish();
}

}  // namespace

Bytes PoseSpaceEncoder::finish(const Attempt& attempt) const {
  const Bytes draft = write_stream(attempt, {}, basis_);
  return write_stream(attempt, decoded_error(draft, clips_, basis_).measured(), basis_);
}

}  // namespace kinespace
