#include "kinespace/codecs/rma/marker_decoder.h"

#include <algorithm>
#include <cmath>

#include "kinespace/base/error.h"
#include "kinespace/codecs/rma/contact_ik.h"
#include "kinespace/codecs/rma/detail/seam_easing.h"
#include "kinespace/codecs/rma/detail/spline_fit.h"
#include "kinespace/codecs/rma/marker_clips.h"
#include "kinespace/codecs/rma/seams.h"

namespace kinespace {
namespace {

constexpr double smoothing_s = 0.06;  // to either side of a seam

std::vector<int> knots_of(const CurveCode& curve, int frames, int span) {
  std::vector<int> out;
  const std::vector<int> regular = regular_knots(frames, span);
  out.reserve(regular.size() + curve.added.size());
  std::ranges::merge(regular, curve.added, std::back_inserter(out));
  return out;
}

}  // namespace

void decode_curve(const CurveCode& curve, int frames, int span, double least, double step, double offset,
                  std::span<double> out) {
  const std::vector<int> knots = knots_of(curve, frames, span);
  std::vector<double> values;
  values.reserve(knots.size());
  for (const std::int32_t q : curve.values) values.push_back(least + (q + offset) * step);
  evaluate_spline(knots, values, out);
}

std::vector<int> decode_reference(const MarkerClip& clip, int reference_span, int primary_frames) {
  const std::vector<int> knots = regular_knots(clip.frames, reference_span);
  std::vector<int> out(static_cast<std::size_t>(clip.frames), clip.reference.front());
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    const std::int64_t length = knots[i + 1] - knots[i];
    const std::int64_t way = clip.reference[i + 1] - clip.reference[i];
    for (std::int64_t f = 0; f <= length; ++f) {
      // Rounded to the nearest.
      const std::int64_t at = clip.reference[i] + (2 * way * f + (way >= 0 ? length : -length)) / (2 * length);
      out[static_cast<std::size_t>(knots[i] + f)] =
          static_cast<int>(std::clamp<std::int64_t>(at, 0, primary_frames - 1));
    }
  }
  return out;
}

MarkerDecoder::MarkerDecoder(const ClipTable& table, const MarkerStream& stream, const std::string& source)
    : table_(table), stream_(stream) {
  for (const Skeleton& skeleton : table.skeletons) rigs_.emplace_back(skeleton);
  std::size_t at = 0;
  for (const ClipEntry& entry : table.clips) {
    first_clip_.push_back(at);
    std::int64_t frames = 0;
    while (frames < entry.frames && at < stream.clips.size()) frames += stream.clips[at++].frames;
    if (frames == entry.frames) continue;
    throw Error(ErrorKind::bad_input, {.file = source,
                                       .found = "clips that run across others",
                                       .expected = "clips that cover each clip of the stream (damaged)"});
  }
  first_clip_.push_back(at);
  for (const MarkerGroup& group : stream.groups) {
    std::vector<double> mean, axes;
    for (const std::int32_t m : group.mean) mean.push_back(m * MarkerGroup::mean_step_cm);
    for (const std::int16_t a : group.axes) axes.push_back(a / MarkerGroup::axis_steps);
    mean_.push_back(std::move(mean));
    axes_.push_back(std::move(axes));
  }
}

std::vector<double> MarkerDecoder::coefficients(std::size_t analysis_clip) const {
  const MarkerClip& clip = stream_.clips[analysis_clip];
  const MarkerGroup& group = stream_.groups[static_cast<std::size_t>(clip.group)];
  const auto frames = static_cast<std::size_t>(clip.frames);
  const auto axes = static_cast<std::size_t>(group.axis_count());
  std::vector<double> out(axes * frames);
  const auto& steps = group.steps[clip.repeats() ? 1 : 0];
  for (std::size_t a = 0; a < axes; ++a) {
    const CurveCode& curve = clip.curves[a];
    const double least = curve.minimum * steps[a].minimum_step_cm(clip.repeats() ? 6 : 8);
    decode_curve(curve, clip.frames, stream_.span, least, steps[a].step_cm(), 0.5,
                 std::span(out).subspan(a * frames, frames));
  }
  if (!clip.repeats()) return out;
  const std::vector<double> primary = coefficients(static_cast<std::size_t>(clip.primary));
  const int primary_frames = stream_.clips[static_cast<std::size_t>(clip.primary)].frames;
  const std::vector<int> reference = decode_reference(clip, stream_.reference_span, primary_frames);
  for (std::size_t a = 0; a < axes; ++a) {
    const double* from = primary.data() + a * static_cast<std::size_t>(primary_frames);
    for (std::size_t f = 0; f < frames; ++f) out[a * frames + f] += from[reference[f]];
  }
  return out;
}

RootAlignment MarkerDecoder::alignment(const RootCode& root, int span) {
  RootAlignment out{.degrees = root.degrees, .frames = root.frames, .curves = {}};
  const auto frames = static_cast<std::size_t>(root.frames);
  out.curves.resize(root.curves.size() * frames);
  for (std::size_t k = 0; k < root.curves.size(); ++k) {
    decode_curve(root.curves[k], root.frames, span, 0, RootCode::step[k], 0,
                 std::span(out.curves).subspan(k * frames, frames));
  }
  return out;
}

std::vector<int> MarkerDecoder::seams(std::size_t clip) const {
  std::vector<int> out;
  int first = 0;
  for (std::size_t p = first_clip_[clip]; p + 1 < first_clip_[clip + 1]; ++p) {
    out.push_back(first += stream_.clips[p].frames);
  }
  return out;
}

Clip MarkerDecoder::decode_without_contacts(std::size_t clip) const {
  const ClipEntry& entry = table_.clips[clip];
  const MarkerRig& rig = rigs_[static_cast<std::size_t>(entry.skeleton)];
  const auto d = static_cast<std::size_t>(rig.dimensions());
  const std::vector<int> inner = seams(clip);
  std::vector<int> first{0};
  first.insert(first.end(), inner.begin(), inner.end());
  first.push_back(entry.frames);
  // Frames come in rising order but for a few back at a seam, so two analysis clips at a time are enough.
  std::vector<std::vector<double>> parts(first.size() - 1);
  std::size_t current = 0;
  const auto raw = [&](int frame, std::span<double> out) {
    while (frame >= first[current + 1]) ++current;
    while (frame < first[current]) --current;
    if (parts[current].empty()) {
      parts[current] = coefficients(first_clip_[clip] + current);
      if (current >= 2) parts[current - 2] = {};
    }
    const MarkerClip& piece = stream_.clips[first_clip_[clip] + current];
    const auto group = static_cast<std::size_t>(piece.group);
    const auto frames = static_cast<std::size_t>(piece.frames);
    const double* values = parts[current].data() + (frame - first[current]);
    std::ranges::copy(mean_[group], out.begin());
    const std::size_t axes = parts[current].size() / frames;
    for (std::size_t a = 0; a < axes; ++a) {
      const double h = values[a * frames];
      const double* axis = axes_[group].data() + a * d;
      for (std::size_t k = 0; k < d; ++k) out[k] += h * axis[k];
    }
  };
  SeamSmoother smoother(static_cast<int>(d), entry.frames, inner, smoothing_s * entry.rate_hz, raw);
  return clip_from_markers(entry, table_.skeletons[static_cast<std::size_t>(entry.skeleton)], rig, stream_.reference,
                           alignment(stream_.roots[clip], stream_.root_span), [&](int frame, std::span<double> out) {
                             raw(frame, out);
                             smoother.apply(frame, out);
                           });
}

Clip MarkerDecoder::decode(std::size_t clip) const {
  Clip out = decode_without_contacts(clip);
  hold_contacts(out, contact_tracks(stream_.contacts[clip], out));
  ease_seams(out, seams(clip), stream_.seam_limit_cm_s);
  return out;
}

}  // namespace kinespace
