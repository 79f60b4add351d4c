// One attempt of the default profile: coding at a step with the windows and predictions that are planned.
#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "kinespace/codecs/rma/contact_ik.h"
#include "kinespace/codecs/rma/detail/repeat_encoder.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/measured_stream.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
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
  tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
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
    tbb::parallel_for(std::size_t{0}, windows_.size(), [&](std::size_t w) {
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
