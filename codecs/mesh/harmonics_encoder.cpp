// mesh-harmonics, standard profile: settings and the search for the target.
//
// The step of the key-frame's grid goes with the error that is asked for: finer details cost more bits than they bring,
// since residuals mend what matters. 400 functions serve all: fewer leave more to the residuals, more cost time.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "base/error.h"
#include "codecs/mesh/harmonics_analysis.h"
#include "codecs/mesh/step_search.h"
#include "mesh/rigid.h"

namespace kinespace {
namespace {

constexpr double usual_kg = 0.5;
constexpr int usual_functions = 400;
constexpr double first_step = 6;  // of coefficients, over the root mean square error: where the search begins

double rms_spread(const MeshSequence& mesh) {
  double sum = 0;
  for (int f = 0; f < mesh.frames; ++f) {
    const Points x = frame_points(mesh, f);
    sum += (x.rowwise() - x.colwise().mean()).squaredNorm();
  }
  return std::sqrt(sum / (3.0 * mesh.vertices * mesh.frames));
}

class Search {
 public:
  Search(const MeshSequence& mesh, const MeshCodecOptions& options) : mesh_(mesh), options_(options) {
    settings_.key = cluster_frames(mesh, {.clusters = 1}).medoid[0];
    spread_ = rms_spread(mesh);
    if (options.coarse_vertices > 0 && options.coarse_vertices < mesh.vertices) {
      decimation_ = decimate(mesh, {.vertices = options.coarse_vertices, .frame = settings_.key});
      decimation_->triangles = canonical_triangles(decimation_->triangles);
    }
    const int coded = decimation_ ? static_cast<int>(decimation_->kept.size()) : mesh.vertices;
    settings_.functions = std::min(options.bases > 0 ? options.bases : usual_functions, coded);
  }

  [[nodiscard]] Bytes for_error(double kg) {
    analyse(kg);
    const double scale =
        100 / (std::max(spread_, smallest()) * std::sqrt(3.0 * analysis_->coded_vertices() * mesh_.frames));
    settle_transform(kg / scale);
    const auto estimated = [&](double step) { return scale * std::sqrt(analysis_->estimate(step).squared_error); };
    const double step = largest_step(first_step * rms(kg), smallest(), kg, 0.02, 10, estimated);
    const auto trial = closest(kg, std::max(step, smallest()));
    if (trial) return analysis_->finish(*trial);
    if (spread_ == 0) return analysis_->finish(analysis_->encode(smallest()));
    throw Error(ErrorKind::usage,
                {.found = fmt::format("a kg of {} percent", kg),
                 .expected = fmt::format("{:.4g} or more for this sequence", analysis_->encode(smallest()).kg),
                 .remedy = decimation_ ? "ask for more coarse vertices, or none" : ""});
  }

  [[nodiscard]] Bytes for_bytes(std::int64_t bytes) {
    double kg = usual_kg;
    Bytes best, smallest_stream;
    for (int round = 0; round < 4; ++round) {
      analyse(kg);
      const double room = static_cast<double>(bytes - analysis_->fixed_bytes());
      if (room > 0) {
        const auto inverse = [&](double fineness) {
          return static_cast<double>(analysis_->estimate(1 / fineness).bytes);
        };
        const double fineness = largest_step(1 / (first_step * rms(kg)), 1e-30, room, 0.02, 10, inverse);
        auto trial = analysis_->encode(fineness > 0 ? 1 / fineness : 1e3 * rms(50));
        Bytes stream = analysis_->finish(trial);
        if (static_cast<std::int64_t>(stream.size()) > bytes && fineness > 0) {
          trial = analysis_->encode(1.06 / fineness);
          stream = analysis_->finish(trial);
        }
        if (smallest_stream.empty() || stream.size() < smallest_stream.size()) smallest_stream = stream;
        const double next = std::clamp(trial.kg, 0.001, 50.0);
        if (static_cast<std::int64_t>(stream.size()) <= bytes && (best.empty() || trial.kg < best_kg_)) {
          best_kg_ = trial.kg;
          best = std::move(stream);
        }
        if (!best.empty() && std::abs(std::log(next / kg)) < 0.2) break;
        kg = next;
      } else {
        kg = std::min(kg * 6, 50.0);
      }
    }
    if (best.empty()) {
      throw Error(ErrorKind::usage, {.found = fmt::format("{} bytes for the stream", bytes),
                                     .expected = fmt::format("about {} or more for this sequence",
                                                             smallest_stream.empty()
                                                                 ? analysis_->fixed_bytes()
                                                                 : static_cast<std::int64_t>(smallest_stream.size()))});
    }
    return best;
  }

 private:
  // A step of nothing, for sequences that are one point.
  [[nodiscard]] double smallest() const { return std::max(diagonal(mesh_) * 1e-8, 1e-20); }
  [[nodiscard]] double rms(double kg) const { return std::max(kg / 100 * spread_, smallest()); }
  void analyse(double kg) {
    settings_.key_step = std::max(harmonics_key_steps * rms(kg), smallest());
    analysis_.emplace(mesh_, decimation_, settings_, options_.progress);
  }
  // The trial that comes closest to the target from below, begun at a step that nearly does; none when no step does.
  [[nodiscard]] std::optional<HarmonicsAnalysis::Trial> closest(double kg, double step) const {
    constexpr int most_trials = 12;
    constexpr double closeness = 0.015, aim = 0.993;
    std::optional<HarmonicsAnalysis::Trial> best;
    double bad = std::numeric_limits<double>::infinity(), bad_error = bad;
    for (int i = 0; i < most_trials; ++i) {
      auto trial = analysis_->encode(step);
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
  void settle_transform(double error) {
    const double step = first_step * error / std::sqrt(3.0 * analysis_->coded_vertices() * mesh_.frames);
    const auto price = [&](FrameTransform transform) {
      analysis_->set_transform(transform);
      const auto attempt = analysis_->estimate(std::max(step, smallest()));
      // At a slope of 6 dB for a bit and coefficient the rate hardly counts; take squared error at equal bytes.
      return static_cast<double>(attempt.bytes) * std::pow(attempt.squared_error + 1e-300, 0.35);
    };
    const double components = price(FrameTransform::components);
    if (price(FrameTransform::cosines) > components) analysis_->set_transform(FrameTransform::components);
  }

  const MeshSequence& mesh_;
  const MeshCodecOptions& options_;
  HarmonicsSettings settings_;
  std::optional<Decimation> decimation_;
  std::optional<HarmonicsAnalysis> analysis_;
  double spread_ = 0;
  double best_kg_ = 0;
};

}  // namespace

Bytes encode_harmonics(const MeshSequence& mesh, const MeshCodecOptions& options) {
  Search search(mesh, options);
  return options.bytes ? search.for_bytes(*options.bytes) : search.for_error(options.kg.value_or(usual_kg));
}

}  // namespace kinespace
