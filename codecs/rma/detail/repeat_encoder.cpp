#include "kinespace/codecs/rma/detail/repeat_encoder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "kinespace/base/parallel.h"
#include "kinespace/codecs/pose_space/time_blocks.h"
#include "kinespace/codecs/rma/contact_ik.h"
#include "kinespace/codecs/rma/detail/spline_fit.h"
#include "kinespace/codecs/rma/marker_clips.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/measured_stream.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

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
  if (preparation_.repeats) analysis_ = analyse_repeats(marker_table(aligned_), {}, progress_);
  progress_.check_stop();
  contacts_.resize(clips_.size());
  if (!preparation_.contacts) return;
  parallel_for(std::size_t{0}, clips_.size(),
               [&](std::size_t c) { contacts_[c] = find_contacts(clips_[c], slow_contacts); });
}

// Moments of the pose vectors and the metric, and with them the exact basis.
void RepeatEncoder::add_statistics() {
  const PoseMetric mean = mean_pose_metric(clips_, aligned_.vectors, aligned_.reference);
  metric_ = mean.combined(preparation_.shell_weight);
  exact_ = karhunen_loeve(metric_, pose_moments(aligned_.vectors, aligned_.reference.dimensions()));
}

void RepeatEncoder::cut(std::size_t clip, double step) {
  const int d = aligned_.reference.dimensions();
  const int planned = std::min(planned_components, d);
  RowMatrix z = (exact_.basis.transpose() * metric_).topRows(planned) * pose_curves(aligned_.vectors[clip], d);
  ClipEntry& entry = table_.clips[clip];
  const std::vector<int> jumps = find_jumps(z, 1, aligned_.vectors[clip].jumps);
  z /= step;
  entry.blocks = plan_blocks({z.data(), static_cast<std::size_t>(z.size())}, planned, entry.frames, entry.rate_hz,
                             jumps, {.longest_frames = longest_block});
  entry.finer.assign(entry.blocks.size(), 0);
}

void RepeatEncoder::plan(double step) {
  parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) { cut(c, step); });
  windows_.clear();
  first_of_clip_.assign(1, 0);
  jumps_.clear();
  for (std::size_t c = 0; c < clips_.size(); ++c) {
    const int d = aligned_.reference.dimensions();
    const PoseCurves x = pose_curves(aligned_.vectors[c], d);
    const RowMatrix analysis = (exact_.basis.transpose() * metric_).topRows(std::min(planned_components, d));
    const std::vector<int> jumps = find_jumps(analysis * x, 1, aligned_.vectors[c].jumps);
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
  parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t i) {
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
  const RowMatrix z = projection * PoseCurves(vectors.data(), projection.cols(), window.points);
  const WindowTransform& transform = *transforms_[w];
  std::vector<double> out(static_cast<std::size_t>(z.rows()) * static_cast<std::size_t>(transform.functions()));
  transform.analyse(z.data(), z.cols(), static_cast<int>(z.rows()), out.data());
  return out;
}

// [dimension][points] of a window's own frames.
std::vector<double> RepeatEncoder::own_vectors(std::size_t w) const {
  const WindowPlace& window = windows_[w];
  const PoseVectors& vectors = aligned_.vectors[static_cast<std::size_t>(window.clip)];
  const int dimensions = aligned_.reference.dimensions();
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(dimensions) * static_cast<std::size_t>(window.points));
  for (int k = 0; k < dimensions; ++k) {
    const auto curve =
        vectors.curve(k).subspan(static_cast<std::size_t>(window.first), static_cast<std::size_t>(window.points));
    out.insert(out.end(), curve.begin(), curve.end());
  }
  return out;
}

void RepeatEncoder::find_predictions(double step) {
  predictions_.assign(windows_.size(), {});
  if (analysis_.clips.empty()) return;
  constexpr double overhead_bits = 24;
  const int d = aligned_.reference.dimensions();
  const Eigen::MatrixXd projection = (exact_.basis.transpose() * metric_).topRows(std::min(planned_components, d));
  std::vector<WindowPrediction> candidates(windows_.size());
  std::vector<double> gain(windows_.size(), 0.0);
  parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    candidates[w] = candidate(w);
    if (!candidates[w].used()) return;
    std::vector<double> own = own_vectors(w);
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
    // Windows of a clip follow one another in time.
    const auto of_clip =
        std::span(windows_).subspan(first_of_clip_[clip], first_of_clip_[clip + 1] - first_of_clip_[clip]);
    const auto nearest = std::ranges::partition_point(
        of_clip, [&](const WindowPlace& place) { return place.first + place.points <= first; });
    for (auto r = first_of_clip_[clip] + static_cast<std::size_t>(nearest - of_clip.begin());
         r < first_of_clip_[clip + 1] && windows_[r].first <= last; ++r) {
      possible = possible && r != w && !predictions_[r].used();
      rests_on.push_back(r);
    }
    if (!possible) continue;
    predictions_[w] = p;
    for (const std::size_t r : rests_on) referred[r] = true;
  }
}

// One attempt of the default profile: coding at a step with the windows and predictions that are planned.

namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

bool RepeatEncoder::predicts() const {
  return std::ranges::any_of(predictions_, &WindowPrediction::used);
}

// What is coded: components that take more off the error than their bits and entries are worth.
void RepeatEncoder::choose_basis(double step, PoseSpaceTables& tables) const {
  constexpr double bits_of_value = 7;
  constexpr double bits_of_entry = 3;
  constexpr double worth = 0.12;
  const int d = aligned_.reference.dimensions();
  const Eigen::MatrixXd projection = exact_.basis.transpose() * metric_;
  std::vector<Eigen::VectorXd> gains(windows_.size());
  parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    gains[w] = Eigen::VectorXd::Zero(d);
    const std::vector<double> own = own_vectors(w);
    const std::vector<double> z = analyse(w, own, projection);
    const std::size_t functions = z.size() / static_cast<std::size_t>(d);
    for (int c = 0; c < d; ++c) {
      for (std::size_t k = 0; k < functions; ++k) {
        const double size = std::abs(z[static_cast<std::size_t>(c) * functions + k]) / step;
        if (size > surely_zero) gains[w](c) += size * size - 1.0 / 12 - worth * bits_of_value;
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
  tables.basis = sent_basis(exact_, kept, step,
                            metric_at_rest(aligned_.reference, table_.skeletons.front(), preparation_.shell_weight));
}

struct RepeatEncoder::Coding {
  RepeatAttempt attempt;
  Eigen::MatrixXd projection;  // onto the basis that is sent, in steps
  std::unique_ptr<RepeatLayout> layout;
  std::vector<std::shared_ptr<RepeatGroup>> groups;
  std::vector<std::array<std::vector<Bytes>, 2>> layers;  // by group
  std::vector<std::vector<double>> wanted;                // by window
};

// Codes the windows that are predicted, or those that are not; twice, the second time with what was learned.
void RepeatEncoder::code(Coding& coding, bool is_predicted, bool final) const {
  RepeatTables& tables = coding.attempt.tables;
  CoefficientTables& coefficients = is_predicted ? tables.predicted : tables.tables.coding;
  const int components = tables.tables.basis.components;
  if (!final) {
    std::vector<CodingStatistics> parts(windows_.size());
    parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
      if (tables.predictions[w].used() != is_predicted) return;
      parts[w].add_plain(coding.wanted[w], transforms_[w]->functions(), windows_[w].points,
                         table_.clips[static_cast<std::size_t>(windows_[w].clip)].rate_hz, components);
    });
    CodingStatistics sums;
    for (const CodingStatistics& part : parts) sums.add(part);
    coefficients.spectrum = Spectrum::of(sums, components);
  }
  coding.layout = std::make_unique<RepeatLayout>(coding.attempt.clips, tables);
  const std::size_t groups = coding.layout->plain.groups.size();
  coding.groups.resize(groups);
  coding.layers.resize(groups);
  std::vector<CodingStatistics> statistics(groups);
  parallel_for(std::size_t{0}, groups, [&](std::size_t g) {
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
  coefficients.spectrum = Spectrum::of(total, components);
  coefficients.start = total.counts.learn();
  coefficients.points = total.reconstruction();
  code(coding, is_predicted, true);
}

void RepeatEncoder::measure(Coding& coding) const {
  RepeatAttempt& attempt = coding.attempt;
  attempt.tables.contacts.resize(clips_.size());
  const RepeatDecoder decoder(
      attempt.clips, attempt.tables, *coding.layout, [&](std::size_t g) { return coding.groups[g]; }, "the stream");
  std::vector<ClipSeams> seams;
  for (std::size_t c = 0; c < clips_.size(); ++c) seams.push_back(decoder.seams(c));
  const EasedError eased = measure_eased(
      clips_, seams,
      [&](std::size_t c) {
        Clip decoded = decoder.decode_without_contacts(c);
        attempt.tables.contacts[c] = code_contacts(contacts_[c], decoded, slow_contacts);
        hold_contacts(decoded, contact_tracks(attempt.tables.contacts[c], decoded), contact_blending_s);
        return decoded;
      },
      progress_);
  attempt.tables.seam_limit_cm_s = eased.limit_cm_s;
  attempt.error.add(eased.error);
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
  const WindowSynthesis synthesis(tables.tables, table_.skeletons.front());
  coding.projection = projection_onto(synthesis.basis(), metric_) / step;
  tables.tables.coding.spectrum = {.components = tables.tables.basis.components, .level = {}};
  tables.tables.coding.spectrum.level.assign(static_cast<std::size_t>(tables.tables.basis.components) * band_count, 1);
  tables.predicted.spectrum = tables.tables.coding.spectrum;
  coding.wanted.resize(windows_.size());
  const auto own_of = [&](std::size_t w) { return own_vectors(w); };
  parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
    if (!tables.predictions[w].used()) coding.wanted[w] = analyse(w, own_of(w), coding.projection);
  });
  code(coding, false, false);
  if (predict && predicts()) {
    // Against what the decoder will have.
    const RepeatDecoder decoder(
        coding.attempt.clips, tables, *coding.layout, [&](std::size_t g) { return coding.groups[g]; }, "the stream");
    parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
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
  coding.wanted.clear();
  measure(coding);
  for (const auto& group : coding.layers) {
    ByteWriter out;
    for (const auto& layers : group) {
      for (const Bytes& layer : layers) {
        put_part(out, layer);
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
  const Bytes tables = pack_pose_space_tables(attempt.tables.tables);
  const Bytes repeats = pack_repeats(attempt.tables, attempt.clips);
  Bytes windows = pack_parts(attempt.groups);
  const std::size_t size = clips.size() + tables.size() + repeats.size() + windows.size();
  out.add_section("clips", clips);
  out.add_section("tables", tables);
  out.add_section("repeats", repeats);
  out.add_section("windows", std::move(windows));
  add_padding(out, size, attempt.clips.frames(), numbers_in(attempt.tables));
  return out.finish();
}

}  // namespace kinespace
