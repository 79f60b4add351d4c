// mesh-harmonics, standard profile: settings and the search for the target.
//
// The step of the key-frame's grid goes with the error that is asked for: finer details cost more bits than they bring,
// since residuals mend what matters. 400 functions serve most targets: fewer leave more to the residuals, more cost
// time. Where 400 leave too much (cloth, small errors), more are taken as long as that lowers the estimated size.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh/rigid.h"
#include "kinespace/mesh_codecs/harmonics_analysis.h"
#include "kinespace/mesh_codecs/step_search.h"

namespace kinespace {
namespace {

constexpr int usual_functions = 400;

class Search {
 public:
  Search(const MeshSequence& mesh, const MeshCodecOptions& options) : mesh_(mesh), options_(options) {
    settings_.key = cluster_frames(mesh, {.clusters = 1}).medoid[0];
    spread_ = std::sqrt(squared_spread(mesh) / (3.0 * mesh.vertices * mesh.frames));
    if (options.coarse_vertices > 0 && options.coarse_vertices < mesh.vertices) {
      decimation_ = decimate(mesh, {.vertices = options.coarse_vertices, .frame = settings_.key});
      decimation_->triangles = canonical_triangles(decimation_->triangles);
    }
    coded_ = decimation_ ? static_cast<int>(decimation_->kept.size()) : mesh.vertices;
    settings_.functions = std::min(options.bases > 0 ? options.bases : usual_functions, coded_);
  }

  [[nodiscard]] Bytes for_error(double kg) {
    const Analysed found = settled(kg);
    const auto trial = closest(*found.analysis, kg, found.step);
    if (trial) return found.analysis->finish(*trial);
    if (spread_ == 0) return found.analysis->finish(found.analysis->encode(smallest()));
    throw Error(ErrorKind::usage,
                {.found = fmt::format("a kg of {} percent", kg),
                 .expected = fmt::format("{:.4g} or more for this sequence", found.analysis->encode(smallest()).kg),
                 .remedy = decimation_ ? "ask for more coarse vertices, or none" : ""});
  }

  // The key-frame's step follows from the error, which is found in turns with it.
  [[nodiscard]] Bytes for_bytes(std::int64_t bytes) {
    double kg = MeshCodecOptions::usual_kg;
    Analysed best;
    HarmonicsAnalysis::Trial best_trial;
    std::int64_t least = std::numeric_limits<std::int64_t>::max();
    constexpr int most_rounds = 4;
    for (int round = 0; round < most_rounds; ++round) {
      // The first round only says about which error the bytes allow.
      Analysed now = round == 0 ? analysed(kg, settings_.functions) : settled(kg);
      const HarmonicsAnalysis& analysis = *now.analysis;
      if (analysis.fixed_bytes() >= bytes) {
        least = std::min(least, analysis.fixed_bytes());
        kg = std::min(kg * 6, 50.0);
        continue;
      }
      options_.progress.at("coding", static_cast<double>(round) / most_rounds);
      auto trial = trial_of_bytes(analysis, bytes, now.step);
      const std::int64_t size = analysis.size(trial);
      least = std::min(least, size);
      const double next = std::clamp(trial.kg, 0.001, 50.0);
      if (size <= bytes && (!best.analysis || trial.kg < best_trial.kg)) {
        best = std::move(now);
        best_trial = std::move(trial);
      }
      const bool near = std::abs(std::log(next / kg)) < 0.2;
      if (round > 0 && best.analysis && near) break;
      kg = next;
    }
    if (best.analysis) return best.analysis->finish(best_trial);
    throw Error(ErrorKind::usage, {.found = fmt::format("{} bytes for the stream", bytes),
                                   .expected = fmt::format("about {} or more for this sequence", least)});
  }

 private:
  // A step of nothing, for sequences that are one point.
  [[nodiscard]] double smallest() const { return std::max(diagonal(mesh_) * 1e-8, 1e-20); }
  [[nodiscard]] double rms(double kg) const { return std::max(kg / 100 * spread_, smallest()); }

  // An analysis, and what it takes to meet an error, by its estimate.
  struct Analysed {
    std::unique_ptr<HarmonicsAnalysis> analysis;
    double step = 0;
    std::int64_t bytes = 0;
  };
  // KG of a squared error of what is coded.
  [[nodiscard]] double kg_of(const HarmonicsAnalysis& analysis, double squared_error) const {
    return 100 * std::sqrt(squared_error / (3.0 * analysis.coded_vertices() * mesh_.frames)) /
           std::max(spread_, smallest());
  }
  [[nodiscard]] Analysed analysed(double kg, int functions) {
    settings_.key_step = std::max(harmonics_key_steps * rms(kg), smallest());
    settings_.functions = functions;
    Analysed out{.analysis = std::make_unique<HarmonicsAnalysis>(mesh_, decimation_, settings_, options_.progress)};
    settle_transform(*out.analysis, kg);
    const double step = largest_step(first_step * rms(kg), smallest(), kg, 0.02, 10, [&](double at) {
      const auto attempt = out.analysis->estimate(at);
      out.bytes = out.analysis->fixed_bytes() + attempt.bytes;
      return kg_of(*out.analysis, attempt.squared_error);
    });
    out.step = std::max(step, smallest());
    return out;
  }
  // With as many functions as pay: where they leave out more than the target allows, residuals cost more than half as
  // many functions again, up to a number that still opens in seconds.
  [[nodiscard]] Analysed settled(double kg) {
    constexpr int most_functions = 900;
    constexpr double worth_looking = 0.85, worth_taking = 0.96;
    Analysed best = analysed(kg, settings_.functions);
    while (options_.bases == 0) {
      const int more = std::min({settings_.functions * 3 / 2, most_functions, coded_});
      const bool enough = kg_of(*best.analysis, best.analysis->residual_energy()) < worth_looking * kg;
      if (enough || more <= settings_.functions) break;
      const int before = settings_.functions;
      Analysed next = analysed(kg, more);
      if (static_cast<double>(next.bytes) > worth_taking * static_cast<double>(best.bytes)) {
        settings_.functions = before;
        break;
      }
      best = std::move(next);
    }
    return best;
  }

  [[nodiscard]] HarmonicsAnalysis::Trial trial_of_bytes(const HarmonicsAnalysis& analysis, std::int64_t bytes,
                                                        double step) const {
    const auto room = static_cast<double>(bytes - analysis.fixed_bytes());
    const double fineness = largest_step(1 / step, 1e-30, room, 0.02, 10, [&](double at) {
      return static_cast<double>(analysis.estimate(1 / at).bytes);
    });
    if (fineness == 0) return analysis.encode(1e3 * rms(50));
    auto trial = analysis.encode(1 / fineness);
    return analysis.size(trial) <= bytes ? std::move(trial) : analysis.encode(1.06 / fineness);
  }

  // The trial that comes closest to the target from below, begun at a step that nearly does; none when no step does.
  [[nodiscard]] std::optional<HarmonicsAnalysis::Trial> closest(const HarmonicsAnalysis& analysis, double kg,
                                                                double step) const {
    constexpr int most_trials = 12;
    constexpr double closeness = 0.015, aim = 0.993;
    std::optional<HarmonicsAnalysis::Trial> best;
    double bad = std::numeric_limits<double>::infinity(), bad_error = bad;
    for (int i = 0; i < most_trials; ++i) {
      options_.progress.at("coding", static_cast<double>(i) / most_trials);
      auto trial = analysis.encode(step);
      const double found = trial.kg;
      if (found <= kg) {
        const bool nothing_moves = best && found <= best->kg * 1.002;  // nor is anything coded
        if (!best || trial.attempt.step > best->attempt.step) best = std::move(trial);
        if (nothing_moves || found >= kg * (1 - closeness)) break;
      } else {
        if (step <= smallest()) break;
        bad = step;
        // Steps at which nothing is coded differ in nothing.
        if (!best && found >= bad_error * 0.998) step *= 0.3;
        bad_error = found;
      }
      // The error goes about with the step to the power of 0.9.
      double next = step * std::pow(std::clamp(aim * kg / std::max(found, 1e-300), 0.02, 50.0), 1.1);
      if (best && std::isfinite(bad)) {
        const double good = best->attempt.step;
        if (bad < good * (1 + closeness / 4)) break;
        if (next <= good || next >= bad) next = std::sqrt(good * bad);
      }
      step = std::max(next, smallest());
    }
    return best;
  }
  // Components over time, or cosines where these cost less (cloth).
  void settle_transform(HarmonicsAnalysis& analysis, double kg) const {
    const double step = std::max(first_step * kg / 100 * std::max(spread_, smallest()), smallest());
    const auto price = [&](FrameTransform transform) {
      analysis.set_transform(transform);
      const auto attempt = analysis.estimate(step);
      // At a slope of 6 dB for a bit and coefficient the rate hardly counts; take squared error at equal bytes.
      return static_cast<double>(attempt.bytes) * std::pow(attempt.squared_error + 1e-300, 0.35);
    };
    const double components = price(FrameTransform::components);
    if (price(FrameTransform::cosines) > components) analysis.set_transform(FrameTransform::components);
  }

  const MeshSequence& mesh_;
  const MeshCodecOptions& options_;
  HarmonicsSettings settings_;
  std::optional<Decimation> decimation_;
  int coded_ = 0;  // vertices
  double spread_ = 0;
};

}  // namespace

Bytes encode_harmonics(const MeshSequence& mesh, const MeshCodecOptions& options) {
  Search search(mesh, options);
  return options.bytes ? search.for_bytes(*options.bytes)
                       : search.for_error(options.kg.value_or(MeshCodecOptions::usual_kg));
}

}  // namespace kinespace
