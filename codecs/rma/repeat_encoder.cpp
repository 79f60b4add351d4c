#include "codecs/rma/repeat_encoder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <tbb/parallel_for.h>

#include "codecs/registry.h"
#include "codecs/rma/contact_ik.h"
#include "codecs/rma/marker_clips.h"
#include "codecs/rma/marker_reader.h"
#include "codecs/rma/spline_fit.h"
#include "codecs/time_blocks.h"
#include "storage/varint.h"

namespace kinespace {
namespace {

constexpr std::size_t metric_samples = 256;
constexpr int planned_components = 16;
// Slow joints only, and no step of theirs that the eye would miss: half of the bytes of the paper's rule.
constexpr ContactOptions contact_options{.near_cm = 0, .still_cm = 0.6};
constexpr double unlikely = 0.62;  // steps; what is smaller will be coded as zero

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Curves = Eigen::Map<const RowMatrix>;

Curves curves_of(const PoseVectors& vectors, int dimensions) {
  return {vectors.values.data(), dimensions, vectors.frames};
}

double bits_of(std::span<const double> coefficients, double step) {
  double out = 0;
  for (const double c : coefficients) {
    const double size = std::abs(c) / step;
    if (size > 0.5) out += 1.5 * std::log2(1 + size);
  }
  return out;
}

// Frames where a body is suddenly elsewhere; z: whitened curves, cm.
std::vector<int> find_jumps(const RowMatrix& z, std::vector<int> jumps) {
  constexpr double break_cm = 10;
  constexpr double break_ratio = 4;
  const Eigen::Index n = z.cols();
  const auto travel = [&](Eigen::Index f) { return f > 0 && f < n ? (z.col(f) - z.col(f - 1)).norm() : 0.0; };
  for (Eigen::Index f = 1; f < n; ++f) {
    const double here = travel(f);
    if (here > break_cm && here > break_ratio * std::max(travel(f - 1), travel(f + 1)))
      jumps.push_back(static_cast<int>(f));
  }
  std::ranges::sort(jumps);
  jumps.erase(std::unique(jumps.begin(), jumps.end()), jumps.end());
  return jumps;
}

// Functions above this frequency are not looked at: nothing is left of them at such a step.
int functions_for(int points, double rate_hz, double step) {
  const double highest_hz = step > 4 ? 12 : step > 1 ? 25 : 1e9;
  return static_cast<int>(std::min<double>(points, std::ceil(2 * highest_hz * points / rate_hz) + 2));
}

}  // namespace

RepeatEncoder::RepeatEncoder(std::span<const Clip> clips, const Preparation& preparation, const Progress& progress)
    : clips_(clips),
      progress_(progress),
      preparation_(preparation),
      aligned_(align_clips(clips)),
      table_(marker_clip_table(clips, aligned_)) {
  add_statistics();
  std::int64_t start = 0;
  for (const Clip& clip : clips_) {
    starts_.push_back(start);
    start += clip.frames;
  }
  if (preparation_.repeats) analysis_ = analyse_repeats(marker_table(aligned_), {});
  progress_.check_stop();
  contacts_.resize(clips_.size());
  if (!preparation_.contacts) return;
  tbb::parallel_for(std::size_t{0}, clips_.size(),
                    [&](std::size_t c) { contacts_[c] = find_contacts(clips_[c], contact_options); });
}

// Moments of the pose vectors and the metric, and with them the exact basis.
void RepeatEncoder::add_statistics() {
  const int d = aligned_.reference.dimensions();
  std::vector<Eigen::MatrixXd> moments(clips_.size());
  std::vector<std::int64_t> first{0};
  for (const PoseVectors& v : aligned_.vectors) first.push_back(first.back() + v.frames);
  const std::int64_t frames = first.back();
  tbb::parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
    moments[c] = Eigen::MatrixXd::Zero(d, d);
    moments[c].selfadjointView<Eigen::Lower>().rankUpdate(curves_of(aligned_.vectors[c], d));
  });
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(d, d);
  for (const Eigen::MatrixXd& one : moments) total += one;
  total = Eigen::MatrixXd(total.selfadjointView<Eigen::Lower>()) / static_cast<double>(frames);

  const std::int64_t samples = std::min<std::int64_t>(frames, metric_samples);
  std::vector<PoseMetric> metrics(static_cast<std::size_t>(samples));
  tbb::parallel_for(std::int64_t{0}, samples, [&](std::int64_t s) {
    const std::int64_t frame = (2 * s + 1) * frames / (2 * samples);
    const auto c = static_cast<std::size_t>(std::ranges::upper_bound(first, frame) - first.begin()) - 1;
    const Eigen::VectorXd pose = curves_of(aligned_.vectors[c], d).col(frame - first[c]);
    metrics[static_cast<std::size_t>(s)] =
        pose_metric(clips_[c].skeleton, aligned_.reference, std::span(pose.data(), static_cast<std::size_t>(d)));
  });
  PoseMetric mean{Eigen::MatrixXd::Zero(d, d), Eigen::MatrixXd::Zero(d, d)};
  for (const PoseMetric& one : metrics) {
    mean.positions += one.positions / static_cast<double>(samples);
    mean.shell += one.shell / static_cast<double>(samples);
  }
  metric_ = mean.combined(preparation_.shell_weight);
  const KarhunenLoeve exact = karhunen_loeve(metric_, total);
  basis_ = exact.basis;
  energy_ = exact.energy;
}

void RepeatEncoder::cut(std::size_t clip, double step) {
  const int d = aligned_.reference.dimensions();
  const int planned = std::min(planned_components, d);
  const RowMatrix z = (basis_.transpose() * metric_).topRows(planned) * curves_of(aligned_.vectors[clip], d);
  ClipEntry& entry = table_.clips[clip];
  const std::vector<int> jumps = find_jumps(z, aligned_.vectors[clip].jumps);
  const RowMatrix scaled = z / step;
  entry.blocks = plan_blocks({scaled.data(), static_cast<std::size_t>(scaled.size())}, planned, entry.frames,
                             entry.rate_hz, jumps, {.longest_frames = longest_block});
  entry.finer.assign(entry.blocks.size(), 0);
}

void RepeatEncoder::plan(double step) {
  tbb::parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) { cut(c, step); });
  windows_.clear();
  first_of_clip_.assign(1, 0);
  jumps_.clear();
  for (std::size_t c = 0; c < clips_.size(); ++c) {
    const int d = aligned_.reference.dimensions();
    const Curves x = curves_of(aligned_.vectors[c], d);
    const RowMatrix analysis = (basis_.transpose() * metric_).topRows(std::min(planned_components, d));
    const std::vector<int> jumps = find_jumps(analysis * x, aligned_.vectors[c].jumps);
    int first = 0;
    for (const int points : table_.clips[c].blocks) {
      windows_.push_back({.clip = static_cast<int>(c), .first = first, .points = points});
      jumps_.push_back(std::ranges::binary_search(jumps, first));
      first += points;
    }
    first_of_clip_.push_back(windows_.size());
  }
  std::map<std::pair<int, int>, std::size_t> sizes;
  std::vector<std::shared_ptr<const WindowTransform>> made;
  std::vector<std::size_t> which;
  std::vector<std::pair<int, int>> wanted;
  for (const WindowPlace& w : windows_) {
    const double rate = table_.clips[static_cast<std::size_t>(w.clip)].rate_hz;
    const std::pair size{w.points, functions_for(w.points, rate, step)};
    const auto [at, is_new] = sizes.emplace(size, wanted.size());
    if (is_new) wanted.push_back(size);
    which.push_back(at->second);
  }
  made.resize(wanted.size());
  tbb::parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t i) {
    made[i] = std::make_shared<const WindowTransform>(wanted[i].first, wanted[i].second);
  });
  transforms_.clear();
  for (const std::size_t i : which) transforms_.push_back(made[i]);
  progress_.check_stop();
  find_predictions(step);
}

// The reference frames of a window: those of the repeated clips in it, gone on from where there are none.
WindowPrediction RepeatEncoder::candidate(std::size_t w) const {
  constexpr double least_share = 0.2;
  const WindowPlace& window = windows_[w];
  const auto clip = static_cast<std::size_t>(window.clip);
  const std::int64_t first = starts_[clip] + window.first;
  const std::int64_t last = first + window.points;
  // The repeated clip that covers most of it.
  const auto& all = analysis_.clips;
  auto at = std::ranges::upper_bound(all, first, {}, &RepeatClip::first);
  if (at != all.begin()) --at;
  const RepeatClip* best = nullptr;
  std::int64_t most = 0;
  for (; at != all.end() && at->first < last; ++at) {
    const std::int64_t shared = std::min(last, at->last) - std::max(first, at->first);
    if (at->kind != RepeatClip::Kind::repeated || shared <= most) continue;
    most = shared;
    best = &*at;
  }
  WindowPrediction out;
  if (best == nullptr || static_cast<double>(most) < least_share * window.points) return out;
  const RepeatClip& primary = all[static_cast<std::size_t>(best->primary)];
  const auto target = static_cast<std::size_t>(std::ranges::upper_bound(starts_, primary.first) - starts_.begin()) - 1;
  const std::int64_t low = starts_[target];
  const std::int64_t high = low + clips_[target].frames - 1;
  const double rate = table_.clips[clip].rate_hz;
  for (const int k : regular_knots(window.points, prediction_span(rate))) {
    const std::int64_t frame = first + k;
    const std::int64_t inside = std::clamp(frame, best->first, best->last - 1);
    const std::int64_t reference = best->reference[static_cast<std::size_t>(inside - best->first)] + frame - inside;
    out.frames.push_back(static_cast<std::int32_t>(std::clamp(reference, low, high) - low));
  }
  out.clip = static_cast<int>(target);
  // How the two face, in the middle.
  const auto heading = [&](std::size_t c, std::int64_t frame) {
    return aligned_.vectors[c].curve(3)[static_cast<std::size_t>(frame)];
  };
  const double turn =
      (heading(clip, window.first + window.points / 2) - heading(target, out.frames[out.frames.size() / 2])) /
      (2 * std::numbers::pi);
  out.turn = static_cast<std::int32_t>(std::lround((turn - std::round(turn)) * WindowPrediction::turn_steps));
  return out;
}

std::vector<double> RepeatEncoder::predicted_from_originals(std::size_t w, const WindowPrediction& prediction) const {
  const PoseVectors& vectors = aligned_.vectors[static_cast<std::size_t>(prediction.clip)];
  const int points = windows_[w].points;
  std::vector<double> out(static_cast<std::size_t>(aligned_.reference.dimensions()) * static_cast<std::size_t>(points));
  const double rate = table_.clips[static_cast<std::size_t>(windows_[w].clip)].rate_hz;
  predict_window(prediction, points, prediction_span(rate), vectors.values, 0, vectors.frames, out);
  return out;
}

std::vector<double> RepeatEncoder::analyse(std::size_t w, std::span<const double> vectors,
                                           const Eigen::MatrixXd& projection) const {
  const WindowPlace& window = windows_[w];
  const RowMatrix z = projection * Curves(vectors.data(), projection.cols(), window.points);
  const WindowTransform& transform = *transforms_[w];
  std::vector<double> out(static_cast<std::size_t>(z.rows()) * static_cast<std::size_t>(transform.functions()));
  transform.analyse(z.data(), z.cols(), static_cast<int>(z.rows()), out.data());
  return out;
}

namespace {

// The vectors of a window, [dimension][points].
std::vector<double> window_of(const PoseVectors& vectors, int dimensions, const WindowPlace& window) {
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(dimensions) * static_cast<std::size_t>(window.points));
  for (int k = 0; k < dimensions; ++k) {
    const auto curve =
        vectors.curve(k).subspan(static_cast<std::size_t>(window.first), static_cast<std::size_t>(window.points));
    out.insert(out.end(), curve.begin(), curve.end());
  }
  return out;
}

}  // namespace

void RepeatEncoder::find_predictions(double step) {
  predictions_.assign(windows_.size(), {});
  if (analysis_.clips.empty()) return;
  constexpr double overhead_bits = 24;
  const int d = aligned_.reference.dimensions();
  const Eigen::MatrixXd projection = (basis_.transpose() * metric_).topRows(std::min(planned_components, d));
  std::vector<WindowPrediction> candidates(windows_.size());
  std::vector<double> gain(windows_.size(), 0.0);
  tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    candidates[w] = candidate(w);
    if (!candidates[w].used()) return;
    std::vector<double> own = window_of(aligned_.vectors[static_cast<std::size_t>(windows_[w].clip)], d, windows_[w]);
    const double alone = bits_of(analyse(w, own, projection), step);
    const std::vector<double> told = predicted_from_originals(w, candidates[w]);
    for (std::size_t i = 0; i < own.size(); ++i) own[i] -= told[i];
    const double moves = 3.0 * static_cast<double>(candidates[w].frames.size());
    gain[w] = alone - bits_of(analyse(w, own, projection), step) - overhead_bits - moves;
  });
  std::vector<std::size_t> order;
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    if (gain[w] > 0) order.push_back(w);
  }
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return gain[a] > gain[b]; });
  std::vector<bool> referred(windows_.size(), false);
  for (const std::size_t w : order) {
    const WindowPrediction& p = candidates[w];
    const auto clip = static_cast<std::size_t>(p.clip);
    const int first = p.first_frame();
    const int last = p.last_frame() + 1;
    std::vector<std::size_t> rests_on;
    bool possible = !referred[w];
    for (std::size_t r = first_of_clip_[clip]; r < first_of_clip_[clip + 1]; ++r) {
      if (windows_[r].first > last || windows_[r].first + windows_[r].points <= first) continue;
      possible = possible && r != w && !predictions_[r].used();
      rests_on.push_back(r);
    }
    if (!possible) continue;
    predictions_[w] = p;
    for (const std::size_t r : rests_on) referred[r] = true;
  }
}

bool RepeatEncoder::predicts() const {
  return std::ranges::any_of(predictions_, &WindowPrediction::used);
}

// What is coded: components that take more off the error than their bits and entries are worth.
void RepeatEncoder::choose_basis(double step, MotionSpaceTables& tables) const {
  constexpr double bits_of_value = 7;
  constexpr double bits_of_entry = 3;
  constexpr double worth = 0.12;
  constexpr int coarsest_exponent = 5;
  constexpr int extra_exponent = 6;
  const int d = aligned_.reference.dimensions();
  const Eigen::MatrixXd projection = basis_.transpose() * metric_;
  std::vector<Eigen::VectorXd> gains(windows_.size());
  tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    gains[w] = Eigen::VectorXd::Zero(d);
    const std::vector<double> own =
        window_of(aligned_.vectors[static_cast<std::size_t>(windows_[w].clip)], d, windows_[w]);
    const std::vector<double> z = analyse(w, own, projection);
    const std::size_t functions = z.size() / static_cast<std::size_t>(d);
    for (int c = 0; c < d; ++c) {
      for (std::size_t k = 0; k < functions; ++k) {
        const double size = std::abs(z[static_cast<std::size_t>(c) * functions + k]) / step;
        if (size > unlikely) gains[w](c) += size * size - 1.0 / 12 - worth * bits_of_value;
      }
    }
  });
  Eigen::VectorXd total = Eigen::VectorXd::Constant(d, -worth * bits_of_entry * d);
  for (const Eigen::VectorXd& one : gains) total += one;
  std::vector<int> kept;
  for (int c = 0; c < d; ++c) {
    if (total(c) > 0) kept.push_back(c);
  }
  if (kept.empty()) kept.push_back(0);
  Eigen::MatrixXd basis(d, static_cast<Eigen::Index>(kept.size()));
  std::vector<int> exponents;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    basis.col(static_cast<Eigen::Index>(i)) = basis_.col(kept[i]);
    const double rms = std::sqrt(energy_(kept[i]));
    exponents.push_back(std::clamp(static_cast<int>(std::ceil(std::log2(std::max(rms / step, 1e-3)))) + extra_exponent,
                                   coarsest_exponent, 20));
  }
  const std::vector<double> rest(static_cast<std::size_t>(d), 0.0);
  const Eigen::MatrixXd lower =
      fixed_cholesky(pose_metric(table_.skeletons.front(), aligned_.reference, rest).lifted(preparation_.shell_weight));
  tables.basis = quantise_basis(lower.transpose() * basis, exponents);
}

struct RepeatEncoder::Coding {
  RepeatAttempt attempt;
  Eigen::MatrixXd projection;  // onto the basis that is sent, in steps
  std::unique_ptr<RepeatLayout> layout;
  std::vector<std::shared_ptr<RepeatGroup>> groups;
  std::vector<std::array<std::vector<Bytes>, 2>> layers;  // by group
  std::vector<std::vector<double>> wanted;                // by window
};

namespace {

Spectrum spectrum_of(const CodingStatistics& statistics, int components) {
  Spectrum out{.components = components, .level = {}};
  for (std::size_t i = 0; i < static_cast<std::size_t>(components) * band_count; ++i) {
    const double count = i < statistics.coefficients.size() ? statistics.coefficients[i] : 0;
    out.level.push_back(count > 0 ? Spectrum::level_of(statistics.magnitude[i] / count) : std::uint8_t{0});
  }
  return out;
}

// What plain rounding gives.
void add_plain(std::span<const double> wanted, int functions, int points, double rate_hz, int components,
               CodingStatistics& sums) {
  sums.magnitude.resize(static_cast<std::size_t>(components) * band_count);
  sums.coefficients.resize(sums.magnitude.size());
  const auto edges = band_edges(points, points, rate_hz);
  for (int c = 0; c < components; ++c) {
    const double* row = wanted.data() + static_cast<std::ptrdiff_t>(c) * functions;
    for (std::size_t band = 0; band < band_count; ++band) {
      const std::size_t cell = static_cast<std::size_t>(c) * band_count + band;
      for (int k = edges[band]; k < std::min(edges[band + 1], functions); ++k) {
        const double size = std::abs(row[k]);
        if (size > unlikely) sums.magnitude[cell] += std::floor(size + 0.5);
      }
      sums.coefficients[cell] += edges[band + 1] - edges[band];
    }
  }
}

}  // namespace

// Codes the windows that are predicted, or those that are not; twice, the second time with what was learned.
void RepeatEncoder::code(Coding& coding, bool is_predicted, bool final) const {
  RepeatTables& tables = coding.attempt.tables;
  CoefficientTables& coefficients = is_predicted ? tables.predicted : tables.tables.coding;
  const int components = tables.tables.basis.components;
  if (!final) {
    std::vector<CodingStatistics> parts(windows_.size());
    tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
      if (tables.predictions[w].used() != is_predicted) return;
      add_plain(coding.wanted[w], transforms_[w]->functions(), windows_[w].points,
                table_.clips[static_cast<std::size_t>(windows_[w].clip)].rate_hz, components, parts[w]);
    });
    CodingStatistics sums;
    for (const CodingStatistics& part : parts) sums.add(part);
    coefficients.spectrum = spectrum_of(sums, components);
  }
  coding.layout = std::make_unique<RepeatLayout>(coding.attempt.clips, tables);
  const std::size_t groups = coding.layout->plain.groups.size();
  coding.groups.resize(groups);
  coding.layers.resize(groups);
  std::vector<CodingStatistics> statistics(groups);
  tbb::parallel_for(std::size_t{0}, groups, [&](std::size_t g) {
    progress_.check_stop();
    const GroupPart part = group_part(*coding.layout, tables, g, is_predicted);
    const auto next = std::make_shared<RepeatGroup>(coding.groups[g] ? *coding.groups[g] : RepeatGroup{});
    next->places.resize(coding.layout->plain.groups[g].count);
    auto& values = next->values[is_predicted ? 1 : 0];
    values.assign(part.size, 0.0);
    std::vector<double> wanted(part.size);
    std::vector<CoefficientBlock> blocks = part.blocks;
    for (std::size_t i = 0; i < part.windows.size(); ++i) {
      const std::size_t w = part.windows[i];
      const auto functions = static_cast<std::size_t>(blocks[i].functions);
      const std::size_t size = functions * static_cast<std::size_t>(components);
      const auto known = static_cast<std::size_t>(transforms_[w]->functions());
      for (std::size_t c = 0; c < static_cast<std::size_t>(components); ++c) {
        std::copy_n(coding.wanted[w].begin() + static_cast<std::ptrdiff_t>(c * known), std::min(functions, known),
                    wanted.begin() + static_cast<std::ptrdiff_t>(part.offsets[i] + c * functions));
      }
      blocks[i].wanted = std::span(wanted).subspan(part.offsets[i], size);
      blocks[i].values = std::span(values).subspan(part.offsets[i], size);
      next->places[w - coding.layout->plain.groups[g].first] = {part.offsets[i], size};
    }
    coding.layers[g][is_predicted ? 1 : 0].clear();
    if (!blocks.empty()) {
      coding.layers[g][is_predicted ? 1 : 0] =
          encode_group(blocks, coefficients, preparation_.rate_weight, statistics[g]);
    }
    coding.groups[g] = next;
  });
  if (final) return;
  CodingStatistics total;
  for (const CodingStatistics& one : statistics) total.add(one);
  if (total.coefficients.empty()) return;
  coefficients.spectrum = spectrum_of(total, components);
  coefficients.start = total.counts.learn();
  coefficients.points = total.reconstruction();
  code(coding, is_predicted, true);
}

void RepeatEncoder::measure(Coding& coding) const {
  RepeatAttempt& attempt = coding.attempt;
  attempt.tables.contacts.resize(clips_.size());
  const RepeatDecoder decoder(
      attempt.clips, attempt.tables, *coding.layout, [&](std::size_t g) { return coding.groups[g]; }, "the stream");
  std::vector<ClipErrorSums> parts(clips_.size());
  tbb::parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
    progress_.check_stop();
    Clip decoded = decoder.decode_without_contacts(c);
    attempt.tables.contacts[c] = code_contacts(contacts_[c], decoded, contact_options);
    hold_contacts(decoded, contact_tracks(attempt.tables.contacts[c], decoded), contact_blending_s);
    parts[c] = clip_error(clips_[c], decoded, 0, clips_[c].frames, 0);
  });
  for (const ClipErrorSums& part : parts) attempt.error.add(part);
}

RepeatAttempt RepeatEncoder::attempt(double step, bool predict) const {
  Coding coding;
  RepeatTables& tables = coding.attempt.tables;
  coding.attempt.clips = table_;
  tables.tables.step = step;
  tables.tables.shell_weight = preparation_.shell_weight;
  tables.tables.reference = aligned_.reference;
  choose_basis(step, tables.tables);
  tables.predictions = predictions_;
  if (!predict) tables.predictions.assign(windows_.size(), {});
  tables.jumps = jumps_;
  const int d = aligned_.reference.dimensions();
  const WindowSynthesis synthesis(tables.tables, table_.skeletons.front());
  coding.projection = projection_onto(synthesis.basis(), metric_) / step;
  tables.tables.coding.spectrum = {.components = tables.tables.basis.components, .level = {}};
  tables.tables.coding.spectrum.level.assign(static_cast<std::size_t>(tables.tables.basis.components) * band_count, 1);
  tables.predicted.spectrum = tables.tables.coding.spectrum;
  coding.wanted.resize(windows_.size());
  const auto own_of = [&](std::size_t w) {
    return window_of(aligned_.vectors[static_cast<std::size_t>(windows_[w].clip)], d, windows_[w]);
  };
  tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    if (!tables.predictions[w].used()) coding.wanted[w] = analyse(w, own_of(w), coding.projection);
  });
  code(coding, false, false);
  if (predict && predicts()) {
    // Against what the decoder will have.
    const RepeatDecoder decoder(
        coding.attempt.clips, tables, *coding.layout, [&](std::size_t g) { return coding.groups[g]; }, "the stream");
    tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
      if (!tables.predictions[w].used()) return;
      std::vector<double> own = own_of(w);
      const std::vector<double> told = decoder.predicted_vectors(w);
      for (std::size_t i = 0; i < own.size(); ++i) own[i] -= told[i];
      coding.wanted[w] = analyse(w, own, coding.projection);
    });
    code(coding, true, false);
  } else {
    tables.predicted.spectrum = tables.tables.coding.spectrum;
    coding.layout = std::make_unique<RepeatLayout>(coding.attempt.clips, tables);
  }
  measure(coding);
  for (const auto& group : coding.layers) {
    ByteWriter out;
    for (const auto& layers : group) {
      for (const Bytes& layer : layers) {
        put_varint(out, layer.size());
        out.put_bytes(layer);
      }
    }
    coding.attempt.groups.push_back(std::move(out).take());
  }
  return std::move(coding.attempt);
}

Bytes write_repeat_stream(const RepeatAttempt& attempt, const MeasuredError& error) {
  BitstreamWriter out(stream_kind("rma"));
  out.set_option("profile", "default");
  out.set_error(error);
  const Bytes clips = pack_clip_table(attempt.clips);
  const Bytes tables = pack_motion_space_tables(attempt.tables.tables);
  const Bytes repeats = pack_repeats(attempt.tables, attempt.clips);
  ByteWriter windows;
  for (const Bytes& group : attempt.groups) put_varint(windows, group.size());
  for (const Bytes& group : attempt.groups) windows.put_bytes(group);
  const std::size_t size = clips.size() + tables.size() + repeats.size() + windows.size();
  out.add_section("clips", clips);
  out.add_section("tables", tables);
  out.add_section("repeats", repeats);
  out.add_section("windows", std::move(windows).take());
  add_padding(out, size, attempt.clips.frames(), numbers_in(attempt.tables));
  return out.finish();
}

}  // namespace kinespace
