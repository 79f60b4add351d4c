#include "codecs/rma/repeat_clips.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace kinespace {
namespace {

bool is_repeated(const RepeatClip& clip) {
  return clip.kind == RepeatClip::Kind::repeated;
}

int run_of(const SelfDistance& distances, int pixel) {
  return distances.run(pixel);
}

RepeatClip clip_of_pixels(const SelfDistance& distances, int group, int first, int last) {
  const int run = run_of(distances, first);
  return {.group = group, .first = distances.frame(first, run), .last = distances.frame(last, run)};
}

// The frame, between pixels too, that each frame of a repeated clip refers to.
std::vector<std::int64_t> frame_references(const SelfDistance& distances, const RepeatClip& clip,
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
    out[f] = std::clamp<std::int64_t>(primary.first + std::llround(offset), primary.first, primary.last - 1);
  }
  return out;
}

// Gives a clip the frames up to `last`, or from `first` on: a repeated one goes on in its primary clip at the same
// pace, up to that clip's ends, which [least, most] are.
void extend(RepeatClip& clip, std::int64_t first, std::int64_t last, FrameRange primary) {
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
    : shortest_(std::llround(shortest_s * table.rate_hz)) {}

void ClipCollector::add(int group, const SelfDistance& distances, std::span<const PrimaryChoice> choices) {
  std::vector<std::vector<RepeatClip>> held(static_cast<std::size_t>(distances.run_count()));
  const auto hold = [&](RepeatClip clip, int pixel) {
    held[static_cast<std::size_t>(run_of(distances, pixel))].push_back(std::move(clip));
  };
  for (const PrimaryChoice& choice : choices) {
    RepeatClip primary = clip_of_pixels(distances, group, choice.first, choice.last);
    primary.kind = RepeatClip::Kind::primary;
    primary.primary = static_cast<int>(primaries_.size());
    primaries_.push_back({primary.first, primary.last});
    for (const Repetition& repetition : choice.repetitions) {
      RepeatClip clip = clip_of_pixels(distances, group, repetition.first, repetition.last);
      clip.kind = RepeatClip::Kind::repeated;
      clip.primary = primary.primary;
      clip.reference = frame_references(distances, clip, primary, choice.first, repetition);
      hold(std::move(clip), repetition.first);
    }
    hold(std::move(primary), choice.first);
  }
  for (int run = 0; run < distances.run_count(); ++run) {
    add_run(group, distances.run_frames(run), std::move(held[static_cast<std::size_t>(run)]));
  }
}

void ClipCollector::add_unique(int group, std::span<const FrameRange> ranges) {
  for (const FrameRange& range : ranges) add_run(group, range, {});
}

// Fills what the clips of a range leave free.
void ClipCollector::add_run(int group, FrameRange range, std::vector<RepeatClip> held) {
  std::sort(held.begin(), held.end(), [](const RepeatClip& a, const RepeatClip& b) { return a.first < b.first; });
  const auto referred = [this](const RepeatClip& clip) {
    return is_repeated(clip) ? primaries_[static_cast<std::size_t>(clip.primary)] : FrameRange{};
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
