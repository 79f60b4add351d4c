#include "kinespace/codecs/rma/marker_encoder.h"

#include <algorithm>
#include <cmath>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/rma/contact_ik.h"
#include "kinespace/codecs/rma/detail/seam_easing.h"
#include "kinespace/codecs/rma/detail/spline_fit.h"
#include "kinespace/codecs/rma/marker_decoder.h"
#include "kinespace/entropy/adaptive_bits.h"

namespace kinespace {
namespace {

constexpr std::int64_t longest_piece = 2048;  // frames: bounds what a reader holds at once
constexpr int most_axes = 160;

using Rows = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

int frames_of(double seconds, double rate_hz, int least) {
  return static_cast<int>(std::clamp(std::round(seconds * rate_hz), static_cast<double>(least), 512.0));
}

void require_small(double steps, const std::string& clip) {
  if (std::abs(steps) < 1e9) return;
  throw Error(ErrorKind::usage,
              {.file = clip, .found = "a curve of more than 10^9 quantiser steps", .expected = "a larger error"});
}

}  // namespace

CurveCode plain_curve(std::span<const double> curve, int span, double tolerance, double step) {
  const std::vector<int> regular = regular_knots(static_cast<int>(curve.size()), span);
  const std::vector<int> knots = fit_knots(curve, regular, tolerance);
  CurveCode out;
  std::ranges::set_difference(knots, regular, std::back_inserter(out.added));
  for (const int k : knots) {
    const double steps = curve[static_cast<std::size_t>(k)] / step;
    require_small(steps, "");
    out.values.push_back(static_cast<std::int32_t>(std::lround(steps)));
  }
  return out;
}

MarkerEncoder::MarkerEncoder(std::span<const Clip> clips, const Preparation& preparation, const Progress& progress)
    : clips_(clips), progress_(progress), aligned_(align_clips(clips)), table_(marker_clip_table(clips, aligned_)) {
  const double rate = aligned_.rate_hz;
  span_ = preparation.span > 0 ? preparation.span : frames_of(0.067, rate, 5);
  root_span_ = frames_of(0.2, rate, 6);
  reference_span_ = frames_of(0.15, rate, 4);
  roots_ = fit_roots(aligned_, preparation.root_cm, root_span_);
  fill_markers();
  progress_.check_stop();
  analysis_ = analyse_repeats(markers_, {.find_repeats = preparation.repeats});
  progress_.check_stop();
  split_clips();
  spaces_.resize(static_cast<std::size_t>(analysis_.grouping.groups));
  parallel_for(std::size_t{0}, spaces_.size(), [&](std::size_t g) {
    const auto ranges = analysis_.grouping.ranges(static_cast<int>(g), markers_);
    spaces_[g] = fit_group_space(markers_, ranges, {.axes = std::min(most_axes, markers_.dimensions)});
  });
  contacts_.resize(clips_.size());
  if (preparation.contacts) {
    parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) { contacts_[c] = find_contacts(clips_[c]); });
  }
  progress_.check_stop();
}

std::vector<RootCode> fit_roots(const AlignedClips& clips, double tolerance_cm, int span) {
  constexpr double cm_per_radian = 20;  // how far a turn moves joints
  std::vector<RootCode> out(clips.vectors.size());
  parallel_for(std::size_t{0}, out.size(), [&](std::size_t c) {
    const RootAlignment exact = root_alignment(clips.vectors[c], clips.degrees[c]);
    RootCode& root = out[c];
    root.degrees = exact.degrees;
    root.frames = exact.frames;
    for (int k = 0; k < RootAlignment::curve_count(exact.degrees); ++k) {
      const double step = RootCode::step[static_cast<std::size_t>(k)];
      root.curves.push_back(
          plain_curve(exact.curve(k), span, k < 3 ? tolerance_cm : tolerance_cm / cm_per_radian, step));
    }
  });
  return out;
}

// The markers in the alignment that the decoder has.
void MarkerEncoder::fill_markers() {
  markers_.rate_hz = aligned_.rate_hz;
  markers_.dimensions = aligned_.rigs.front().dimensions();
  for (const Clip& clip : clips_) {
    markers_.starts.push_back(markers_.frames);
    markers_.frames += clip.frames;
  }
  const auto d = static_cast<std::size_t>(markers_.dimensions);
  markers_.values.resize(d * static_cast<std::size_t>(markers_.frames));
  parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
    std::vector<double> markers(d * static_cast<std::size_t>(clips_[c].frames));
    clip_markers(aligned_, c, MarkerDecoder::alignment(roots_[c], root_span_), 0, clips_[c].frames, markers.data());
    std::ranges::transform(markers, markers_.values.begin() + static_cast<std::ptrdiff_t>(d) * markers_.starts[c],
                           [](double v) { return static_cast<float>(v); });
  });
}

void MarkerEncoder::split_clips() {
  std::vector<int> new_index;
  for (const RepeatClip& clip : analysis_.clips) {
    new_index.push_back(static_cast<int>(pieces_.size()));
    if (clip.kind != RepeatClip::Kind::unique || clip.frames() <= longest_piece) {
      pieces_.push_back(clip);
      continue;
    }
    const std::int64_t parts = (clip.frames() + longest_piece - 1) / longest_piece;
    for (std::int64_t p = 0; p < parts; ++p) {
      RepeatClip piece = clip;
      piece.first = clip.first + clip.frames() * p / parts;
      piece.last = clip.first + clip.frames() * (p + 1) / parts;
      pieces_.push_back(std::move(piece));
    }
  }
  for (RepeatClip& piece : pieces_) {
    if (piece.primary >= 0) piece.primary = new_index[static_cast<std::size_t>(piece.primary)];
  }
}

int MarkerEncoder::axes_for(std::size_t group, double variance) const {
  const GroupSpace& space = spaces_[group];
  double kept = 0;
  for (int a = 0; a < space.axis_count(); ++a) {
    kept += space.variances(a);
    if (kept >= variance / 100 * space.total_variance) return a + 1;
  }
  return space.axis_count();
}

double MarkerEncoder::mean_axes(double variance) const {
  double sum = 0;
  for (std::size_t g = 0; g < spaces_.size(); ++g) {
    for (const FrameSpan& range : analysis_.grouping.ranges(static_cast<int>(g), markers_)) {
      sum += static_cast<double>(range.frames()) * axes_for(g, variance);
    }
  }
  return sum / static_cast<double>(markers_.frames);
}

double MarkerEncoder::variance_for(double left_cm) const {
  double total = 0;
  for (std::size_t g = 0; g < spaces_.size(); ++g) {
    double frames = 0;
    for (const FrameSpan& range : analysis_.grouping.ranges(static_cast<int>(g), markers_)) {
      frames += static_cast<double>(range.frames());
    }
    total += spaces_[g].total_variance * frames / static_cast<double>(markers_.frames);
  }
  const double left = left_cm * left_cm * markers_.dimensions / 3;
  return 100 * std::clamp(1 - left / std::max(total, 1e-12), 0.3, 1 - 1e-12);
}

MarkerGroup MarkerEncoder::quantise_group(std::size_t group, double variance) const {
  const GroupSpace& space = spaces_[group];
  MarkerGroup out;
  for (const double m : space.mean) {
    require_small(m / MarkerGroup::mean_step_cm, "");
    out.mean.push_back(static_cast<std::int32_t>(std::lround(m / MarkerGroup::mean_step_cm)));
  }
  const int axes = axes_for(group, variance);
  for (int a = 0; a < axes; ++a) {
    for (int k = 0; k < space.dimensions(); ++k) {
      out.axes.push_back(static_cast<std::int16_t>(std::lround(space.axes(k, a) * MarkerGroup::axis_steps)));
    }
  }
  for (auto& steps : out.steps) steps.resize(static_cast<std::size_t>(axes));
  return out;
}

// The curves of one clip while the ranges of its axes are not known yet.
struct MarkerEncoder::Curves {
  std::vector<double> values;           // [axis][frame]
  std::vector<std::vector<int>> knots;  // by axis
};

void MarkerEncoder::code_clips(const MarkerSettings& settings, bool repeated, MarkerStream& stream) const {
  const MarkerDecoder decoder(table_, stream, "the stream");
  const auto d = static_cast<Eigen::Index>(markers_.dimensions);
  std::vector<Curves> all(pieces_.size());
  parallel_for(std::size_t{0}, pieces_.size(), [&](std::size_t c) {
    MarkerClip& clip = stream.clips[c];
    if (clip.repeats() != repeated) return;
    progress_.check_stop();
    const MarkerGroup& group = stream.groups[static_cast<std::size_t>(clip.group)];
    const Eigen::Index n = clip.frames;
    const Eigen::Index axes = group.axis_count();
    Eigen::VectorXf mean(d);
    Eigen::MatrixXf basis(d, axes);
    for (Eigen::Index k = 0; k < d; ++k) {
      mean(k) = static_cast<float>(group.mean[static_cast<std::size_t>(k)] * MarkerGroup::mean_step_cm);
      for (Eigen::Index a = 0; a < axes; ++a) {
        basis(k, a) = static_cast<float>(group.axes[static_cast<std::size_t>(a * d + k)] / MarkerGroup::axis_steps);
      }
    }
    const Rows frames(markers_.values.data() + pieces_[c].first * d, n, d);
    const Eigen::MatrixXf h = (frames.rowwise() - mean.transpose()) * basis;
    Curves& curves = all[c];
    curves.values.resize(static_cast<std::size_t>(n * axes));
    for (Eigen::Index a = 0; a < axes; ++a) {
      for (Eigen::Index f = 0; f < n; ++f) curves.values[static_cast<std::size_t>(a * n + f)] = h(f, a);
    }
    if (repeated) {
      const int primary_frames = stream.clips[static_cast<std::size_t>(clip.primary)].frames;
      const std::vector<double> primary = decoder.coefficients(static_cast<std::size_t>(clip.primary));
      const std::vector<int> reference = decode_reference(clip, stream.reference_span, primary_frames);
      for (Eigen::Index a = 0; a < axes; ++a) {
        for (Eigen::Index f = 0; f < n; ++f) {
          curves.values[static_cast<std::size_t>(a * n + f)] -=
              primary[static_cast<std::size_t>(a * primary_frames + reference[static_cast<std::size_t>(f)])];
        }
      }
    }
    const std::vector<int> regular = regular_knots(clip.frames, stream.span);
    for (Eigen::Index a = 0; a < axes; ++a) {
      const auto curve = std::span(curves.values).subspan(static_cast<std::size_t>(a * n), static_cast<std::size_t>(n));
      curves.knots.push_back(fit_knots(curve, regular, settings.control_cm));
    }
  });

  // The ranges of the axes, and with them steps.
  const std::size_t which = repeated ? 1 : 0;
  std::vector<std::vector<double>> range(stream.groups.size());
  for (std::size_t g = 0; g < range.size(); ++g) {
    range[g].resize(static_cast<std::size_t>(stream.groups[g].axis_count()), 0.0);
  }
  const auto value_at = [&](std::size_t c, std::size_t a, int frame) {
    return all[c].values[a * static_cast<std::size_t>(stream.clips[c].frames) + static_cast<std::size_t>(frame)];
  };
  for (std::size_t c = 0; c < all.size(); ++c) {
    for (std::size_t a = 0; a < all[c].knots.size(); ++a) {
      double low = value_at(c, a, 0);
      double high = low;
      for (const int k : all[c].knots[a]) {
        low = std::min(low, value_at(c, a, k));
        high = std::max(high, value_at(c, a, k));
      }
      double& widest = range[static_cast<std::size_t>(stream.clips[c].group)][a];
      widest = std::max(widest, high - low);
    }
  }
  const double tolerance = repeated ? settings.repeated_cm : settings.primary_cm;
  const int fixed_bits = repeated ? settings.repeated_bits : settings.primary_bits;
  for (std::size_t g = 0; g < range.size(); ++g) {
    for (std::size_t a = 0; a < range[g].size(); ++a) {
      AxisSteps& steps = stream.groups[g].steps[which][a];
      steps.range = AxisSteps::range_code(std::max(range[g][a], 0.01 * tolerance));
      steps.bits = fixed_bits > 0 ? fixed_bits : adaptive_bits(steps.range_cm(), tolerance);
    }
  }
  const int minimum_bits = repeated ? 6 : 8;
  parallel_for(std::size_t{0}, pieces_.size(), [&](std::size_t c) {
    MarkerClip& clip = stream.clips[c];
    if (clip.repeats() != repeated) return;
    const std::vector<int> regular = regular_knots(clip.frames, stream.span);
    const auto& steps = stream.groups[static_cast<std::size_t>(clip.group)].steps[which];
    for (std::size_t a = 0; a < steps.size(); ++a) {
      CurveCode curve;
      std::ranges::set_difference(all[c].knots[a], regular, std::back_inserter(curve.added));
      double low = value_at(c, a, 0);
      for (const int k : all[c].knots[a]) low = std::min(low, value_at(c, a, k));
      const double minimum_step = steps[a].minimum_step_cm(minimum_bits);
      require_small(low / minimum_step, "");
      curve.minimum = static_cast<std::int32_t>(std::floor(low / minimum_step));
      const UniformQuantiser quantiser{.least = curve.minimum * minimum_step, .step = steps[a].step_cm()};
      for (const int k : all[c].knots[a]) {
        curve.values.push_back(static_cast<std::int32_t>(quantiser.quantise(value_at(c, a, k))));
      }
      clip.curves.push_back(std::move(curve));
    }
  });
}

void MarkerEncoder::measure(MarkerAttempt& attempt, bool contacts) const {
  MarkerStream& stream = attempt.stream;
  const MarkerDecoder decoder(table_, stream, "the stream");
  std::vector<ClipSeams> seams;
  for (std::size_t c = 0; c < clips_.size(); ++c) seams.push_back({.seams = decoder.seams(c), .breaks = {}});
  const EasedError eased = measure_eased(
      clips_, seams,
      [&](std::size_t c) {
        Clip decoded = decoder.decode_without_contacts(c);
        if (contacts) {
          stream.contacts[c] = code_contacts(contacts_[c], decoded);
          hold_contacts(decoded, contact_tracks(stream.contacts[c], decoded));
        }
        return decoded;
      },
      progress_);
  stream.seam_limit_cm_s = eased.limit_cm_s;
  attempt.error.add(eased.error);
}

MarkerAttempt MarkerEncoder::attempt(const MarkerSettings& settings) const {
  MarkerAttempt out;
  MarkerStream& stream = out.stream;
  stream.span = span_;
  stream.root_span = root_span_;
  stream.reference_span = reference_span_;
  stream.reference = aligned_.reference;
  for (std::size_t g = 0; g < spaces_.size(); ++g) stream.groups.push_back(quantise_group(g, settings.variance));
  for (const RepeatClip& piece : pieces_) {
    MarkerClip clip{.kind = static_cast<MarkerClip::Kind>(piece.kind),
                    .group = piece.group,
                    .frames = static_cast<int>(piece.frames()),
                    .primary = piece.primary,
                    .reference = {},
                    .curves = {}};
    if (clip.repeats()) {
      const std::int64_t start = pieces_[static_cast<std::size_t>(piece.primary)].first;
      for (const int k : regular_knots(clip.frames, reference_span_)) {
        clip.reference.push_back(static_cast<std::int32_t>(piece.reference[static_cast<std::size_t>(k)] - start));
      }
    }
    stream.clips.push_back(std::move(clip));
  }
  stream.roots = roots_;
  stream.contacts.resize(clips_.size());
  code_clips(settings, false, stream);
  code_clips(settings, true, stream);
  measure(out, settings.contacts);
  out.bytes = pack_marker_stream(stream);
  return out;
}

}  // namespace kinespace
