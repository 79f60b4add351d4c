#include "kinespace/synthesis/windows.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/synthesis/detail/library_clips.h"

namespace kinespace {
namespace {

constexpr std::size_t clips_per_block = 64;

// A stretch of a library's clip before it has rows.
struct SampledStretch {
  std::size_t clip = 0;
  double start_s = 0;
  WindowSamples samples;
};

void sample_clip(const RegisteredSpace& space, const EncodedClip& encoded, std::size_t clip,
                 const WindowOptions& options, std::vector<SampledStretch>& out) {
  const ClipCurves curves = decode(space, encoded);
  for (const EncodedRun& run : encoded.runs) {
    const int first = run.sequences.front().first;
    const int last = run.sequences.back().last;
    const double start_s = first / encoded.rate_hz;
    SampledStretch stretch{clip, start_s, window_samples(curves, first, last, start_s, options)};
    if (stretch.samples.rows() >= options.samples()) out.push_back(std::move(stretch));
  }
}

// The library is read by one thread, the clips are decoded by all.
std::vector<SampledStretch> sample_clips(LibraryView& library, std::int64_t space_id, const std::vector<ClipRow>& clips,
                                         const WindowOptions& options, const Progress& progress) {
  const RegisteredSpace& space = library.space(space_id);
  std::vector<SampledStretch> out;
  for (std::size_t start = 0; start < clips.size(); start += clips_per_block) {
    progress.check_stop();
    progress.at("index", 0.5 * static_cast<double>(start) / static_cast<double>(clips.size()));
    const std::size_t count = std::min(clips_per_block, clips.size() - start);
    std::vector<EncodedClip> encoded;
    for (std::size_t i = 0; i < count; ++i) encoded.push_back(library.encoded(clips[start + i]));
    std::vector<std::vector<SampledStretch>> sampled(count);
    parallel_for(std::size_t{0}, count,
                 [&](std::size_t i) { sample_clip(space, encoded[i], start + i, options, sampled[i]); });
    for (auto& stretches : sampled) std::ranges::move(stretches, std::back_inserter(out));
  }
  return out;
}

bool overlaps_better(const std::vector<Match>& better, const Match& match) {
  // Windows that share an end alone do not overlap.
  constexpr double touch = 1e-6;
  return std::ranges::any_of(better, [&](const Match& b) {
    return b.clip == match.clip && b.start_s < match.end_s - touch && match.start_s < b.end_s - touch;
  });
}

// The window that a range asks for, checked.
double range_length(const ClipCurves& curves, const TimeRange& range, const WindowOptions& options) {
  const double to_s = range.to_s.value_or(range.from_s + options.length_s);
  const double end_s = (curves.frames() - 1) / curves.rate_hz;
  constexpr double rounding = 1e-6;
  if (!(range.from_s >= 0 && to_s > range.from_s && to_s <= end_s + rounding)) {
    throw Error(ErrorKind::usage, {.file = curves.name,
                                   .found = fmt::format("a window from {} to {} s", range.from_s, to_s),
                                   .expected = fmt::format("one within the clip, 0 to {:.3f} s", end_s),
                                   .remedy = "take a shorter or an earlier one (--from, --to)"});
  }
  return to_s - range.from_s;
}

}  // namespace

void WindowQueryOptions::validate() const {
  if (k < 1) throw Error(ErrorKind::usage, {.found = fmt::format("k = {}", k), .expected = "1 or more"});
}

WindowIndex::WindowIndex(WindowSpace space, VectorSearch search, std::vector<Stretch> stretches,
                         std::vector<ClipRow> clips)
    : space_(std::move(space)),
      search_(std::move(search)),
      stretches_(std::move(stretches)),
      clips_(std::move(clips)) {}

WindowIndex WindowIndex::build(LibraryView& library, std::int64_t space_id, const WindowOptions& options,
                               const Progress& progress) {
  options.validate();
  std::vector<ClipRow> clips = library.library().clips();
  std::erase_if(clips, [&](const ClipRow& row) { return row.space_id != space_id; });
  std::vector<SampledStretch> sampled = sample_clips(library, space_id, clips, options, progress);
  std::vector<WindowSamples> samples;
  std::vector<Stretch> stretches;
  std::int64_t rows = 0;
  for (SampledStretch& s : sampled) {
    stretches.push_back({.first_row = rows, .clip = s.clip, .start_s = s.start_s});
    rows += s.samples.rows() - options.samples() + 1;
    samples.push_back(std::move(s.samples));
  }
  const MotionSpace& motions = library.space(space_id).plain();
  WindowSpace space = WindowSpace::fit(samples, motions.skeleton(), motions.references(), options);
  progress.at("index", 0.7);
  RowMatrix<float> vectors(rows, space.dimensions());
  parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
    const RowMatrix<float> part = space.vectors(samples[i]);
    vectors.middleRows(stretches[i].first_row, part.rows()) = part;
  });
  // The vectors are components already, the leading ones first.
  VectorSearch search(std::move(vectors), {.rotate = false});
  progress.at("index", 1);
  return {std::move(space), std::move(search), std::move(stretches), std::move(clips)};
}

double WindowIndex::length_s() const {
  return (space_.options().samples() - 1) / space_.options().rate_hz;
}

std::vector<float> WindowIndex::vector_of(const ClipCurves& curves, double start_s) const {
  // Curves beyond the window shape the spline, so that a window of the library's clip is the one in the index.
  const WindowSamples all = window_samples(curves, 0, curves.frames() - 1, start_s, space_.options());
  const int samples = space_.options().samples();
  if (!(start_s >= 0) || all.rows() < samples) {
    throw Error(ErrorKind::usage, {.file = curves.name,
                                   .found = fmt::format("{:.3f} s of motion from {} s on",
                                                        (curves.frames() - 1) / curves.rate_hz - start_s, start_s),
                                   .expected = fmt::format("a window of {:.3f} s", length_s())});
  }
  const RowMatrix<float> vector = space_.vectors(all.topRows(samples));
  return {vector.data(), vector.data() + vector.size()};
}

std::vector<std::uint8_t> WindowIndex::allowed_rows(double start_s, const WindowQueryOptions& options,
                                                    const std::string& except) const {
  if (options.labels.empty() && except.empty()) return {};
  std::vector<std::uint8_t> out(static_cast<std::size_t>(windows()), 1);
  for (std::size_t s = 0; s < stretches_.size(); ++s) {
    const Stretch& stretch = stretches_[s];
    const std::int64_t end = s + 1 < stretches_.size() ? stretches_[s + 1].first_row : windows();
    const ClipRow& clip = clips_[stretch.clip];
    const bool wanted = has_labels(clip, options.labels);
    for (std::int64_t row = stretch.first_row; row < end; ++row) {
      const double at = stretch.start_s + static_cast<double>(row - stretch.first_row) / space_.options().rate_hz;
      const bool own = !except.empty() && clip.name == except && std::abs(at - start_s) < length_s() - 1e-6;
      out[static_cast<std::size_t>(row)] = wanted && !own ? 1 : 0;
    }
  }
  return out;
}

Match WindowIndex::match_of(const Neighbour& neighbour) const {
  const auto after = std::ranges::upper_bound(stretches_, neighbour.row, {}, &Stretch::first_row);
  const Stretch& stretch = *(after - 1);
  const ClipRow& clip = clips_[stretch.clip];
  const double start =
      stretch.start_s + static_cast<double>(neighbour.row - stretch.first_row) / space_.options().rate_hz;
  const double distance = std::sqrt(neighbour.squared);
  return {.clip = clip.name,
          .distance = distance,
          .vector_distance = distance,
          .start_s = start,
          .end_s = start + length_s(),
          .labels = clip.labels};
}

std::vector<Match> WindowIndex::nearest(const ClipCurves& curves, double start_s, const WindowQueryOptions& options,
                                        const std::string& except) const {
  options.validate();
  if (curves.values.cols() != space_.curves()) {
    throw Error(ErrorKind::bad_input, {.file = curves.name,
                                       .found = fmt::format("{} curves", curves.values.cols()),
                                       .expected = fmt::format("{}, those of the library's clips", space_.curves())});
  }
  const std::vector<float> query = vector_of(curves, start_s);
  const std::vector<std::uint8_t> allowed = allowed_rows(start_s, options, except);
  const auto wanted = static_cast<std::size_t>(options.k);
  VectorSearch::Scratch scratch;
  // The list without overlaps of a longer list is that of all windows as far as it goes: ask for more until it is
  // enough.
  for (std::int64_t asked = options.overlapping ? options.k : 8 * std::int64_t{options.k};; asked *= 4) {
    const int k = static_cast<int>(std::clamp<std::int64_t>(asked, 1, std::max<std::int64_t>(1, windows())));
    const auto found = search_.nearest(query, k, scratch, allowed);
    std::vector<Match> out;
    for (const Neighbour& neighbour : found) {
      if (out.size() == wanted) break;
      Match match = match_of(neighbour);
      if (options.overlapping || !overlaps_better(out, match)) out.push_back(std::move(match));
    }
    const bool all = std::ssize(found) < k || k == windows();
    if (out.size() == wanted || all || options.overlapping) return out;
  }
}

std::vector<Match> nearest_windows(LibraryView& library, const ClipCurves& curves, const Skeleton& skeleton,
                                   const TimeRange& range, const WindowQueryOptions& query, WindowOptions windows,
                                   const std::string& except) {
  query.validate();
  windows.length_s = range_length(curves, range, windows);
  windows.validate();
  const auto space_id = library.space_for(skeleton);
  if (!space_id) return {};
  return WindowIndex::build(library, *space_id, windows).nearest(curves, range.from_s, query, except);
}

std::vector<Match> nearest_windows(LibraryView& library, const Clip& clip, const TimeRange& range,
                                   const WindowQueryOptions& query, WindowOptions windows, const std::string& except) {
  return nearest_windows(library, clip_curves(clip), clip.skeleton, range, query, windows, except);
}

}  // namespace kinespace
