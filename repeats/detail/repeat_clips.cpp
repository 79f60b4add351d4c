#include "kinespace/repeats/detail/repeat_clips.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "kinespace/base/parallel.h"
#include "kinespace/repeats/detail/reference_warp.h"

namespace kinespace {
namespace {

bool is_repeated(const RepeatClip& clip) {
  return clip.kind == RepeatClip::Kind::repeated;
}

// Seconds, and share of the table's typical distance.
constexpr double warp_reach_s = 0.05, jump_cost = 0.05;

RepeatClip clip_of_pixels(const SelfDistance& distances, int group, int first, int last) {
  const int run = distances.run(first);
  return {.group = group, .first = distances.frame(first, run), .last = distances.frame(last, run)};
}

// The frame of the primary clip that each frame of a repeated clip refers to as the path has it, between pixels too.
std::vector<std::int64_t> path_references(const SelfDistance& distances, const RepeatClip& clip,
                                          const RepeatClip& primary, int primary_pixel, const Repetition& repetition) {
  std::vector<std::int64_t> out(static_cast<std::size_t>(clip.frames()));
  const int stride = distances.stride();
  const auto& pixels = repetition.reference;
  for (std::size_t f = 0; f < out.size(); ++f) {
    const std::size_t pixel = f / static_cast<std::size_t>(stride);
    const double part = static_cast<double>(f % static_cast<std::size_t>(stride)) / stride;
    const double here = static_cast<double>(pixels[pixel]);
    const double next = pixel + 1 < pixels.size() ? static_cast<double>(pixels[pixel + 1]) : here + 1;
    const double offset = (here + part * (next - here) - primary_pixel) * stride;
    out[f] = std::clamp<std::int64_t>(std::llround(offset), 0, primary.frames() - 1);
  }
  return out;
}

// Gives a clip the frames up to `last`, or from `first` on: a repeated one goes on in its primary clip at the same
// pace, up to that clip's ends, which [least, most] are.
void extend(RepeatClip& clip, std::int64_t first, std::int64_t last, FrameSpan primary) {
  if (is_repeated(clip)) {
    std::vector<std::int64_t> reference;
    for (std::int64_t f = first; f < last; ++f) {
      const std::int64_t inside = std::clamp(f, clip.first, clip.last - 1);
      const std::int64_t at = clip.reference[static_cast<std::size_t>(inside - clip.first)] + f - inside;
      reference.push_back(std::clamp(at, primary.first, primary.last - 1));
    }
    clip.reference = std::move(reference);
  }
  clip.first = first;
  clip.last = last;
}

}  // namespace

ClipCollector::ClipCollector(const FrameTable& table, double shortest_s)
    : table_(table), shortest_(std::llround(shortest_s * table.rate_hz)) {}

void ClipCollector::add(const GroupTable& in, std::span<const PrimaryChoice> choices) {
  std::vector<std::vector<RepeatClip>> found(choices.size());
  parallel_for(std::size_t{0}, choices.size(), [&](std::size_t c) { found[c] = clips_of(in, choices[c]); });
  std::vector<std::vector<RepeatClip>> held(static_cast<std::size_t>(in.distances.run_count()));
  for (std::size_t c = 0; c < choices.size(); ++c) {
    const int number = static_cast<int>(primaries_.size());
    primaries_.push_back({found[c].front().first, found[c].front().last});
    for (std::size_t k = 0; k < found[c].size(); ++k) {
      const int pixel = k == 0 ? choices[c].first : choices[c].repetitions[k - 1].first;
      found[c][k].primary = number;
      held[static_cast<std::size_t>(in.distances.run(pixel))].push_back(std::move(found[c][k]));
    }
  }
  for (int run = 0; run < in.distances.run_count(); ++run) {
    add_run(in.group, in.distances.run_frames(run), std::move(held[static_cast<std::size_t>(run)]));
  }
}

// The primary clip, then its repetitions.
std::vector<RepeatClip> ClipCollector::clips_of(const GroupTable& in, const PrimaryChoice& choice) const {
  std::vector<RepeatClip> out;
  out.push_back(clip_of_pixels(in.distances, in.group, choice.first, choice.last));
  const FrameSpan range{out[0].first, out[0].last};
  out[0].kind = RepeatClip::Kind::primary;
  const Eigen::MatrixXf primary = in.space.project(table_, std::span(&range, 1));
  // How far a path at the table's rate may be off; what a jump in the reference must save.
  const auto jump = static_cast<float>(std::pow(jump_cost * in.distances.typical(), 2));
  const WarpOptions warp{.reach = in.distances.stride() + std::llround(warp_reach_s * table_.rate_hz), .jump = jump};
  for (const Repetition& repetition : choice.repetitions) {
    RepeatClip clip = clip_of_pixels(in.distances, in.group, repetition.first, repetition.last);
    clip.kind = RepeatClip::Kind::repeated;
    const FrameSpan own{clip.first, clip.last};
    clip.reference = warp_references(in.space.project(table_, std::span(&own, 1)), primary,
                                     path_references(in.distances, clip, out[0], choice.first, repetition), warp);
    for (std::int64_t& frame : clip.reference) frame += out[0].first;
    out.push_back(std::move(clip));
  }
  return out;
}

void ClipCollector::add_unique(int group, std::span<const FrameSpan> ranges) {
  for (const FrameSpan& range : ranges) add_run(group, range, {});
}

// Fills what the clips of a range leave free.
void ClipCollector::add_run(int group, FrameSpan range, std::vector<RepeatClip> held) {
  std::sort(held.begin(), held.end(), [](const RepeatClip& a, const RepeatClip& b) { return a.first < b.first; });
  const auto referred = [this](const RepeatClip& clip) {
    return is_repeated(clip) ? primaries_[static_cast<std::size_t>(clip.primary)] : FrameSpan{};
  };
  std::int64_t at = range.first;
  for (std::size_t c = 0; c <= held.size(); ++c) {
    const std::int64_t next = c < held.size() ? held[c].first : range.last;
    const bool alone = held.empty();
    if (next - at >= shortest_ || (next > at && alone)) {
      clips_.push_back({.group = group, .first = at, .last = next});
    } else if (next > at && c > 0) {
      extend(clips_.back(), clips_.back().first, next, referred(clips_.back()));
    } else if (next > at) {
      extend(held[c], at, held[c].last, referred(held[c]));
    }
    if (c == held.size()) break;
    at = held[c].last;
    clips_.push_back(std::move(held[c]));
  }
}

std::vector<RepeatClip> ClipCollector::finish() && {
  std::sort(clips_.begin(), clips_.end(), [](const RepeatClip& a, const RepeatClip& b) { return a.first < b.first; });
  std::vector<int> index(primaries_.size(), -1);
  for (std::size_t c = 0; c < clips_.size(); ++c) {
    if (clips_[c].kind != RepeatClip::Kind::primary) continue;
    index[static_cast<std::size_t>(clips_[c].primary)] = static_cast<int>(c);
    clips_[c].primary = -1;
  }
  for (RepeatClip& clip : clips_) {
    if (is_repeated(clip)) clip.primary = index[static_cast<std::size_t>(clip.primary)];
  }
  return std::move(clips_);
}

}  // namespace kinespace
