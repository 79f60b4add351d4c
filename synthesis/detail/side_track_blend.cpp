#include "kinespace/synthesis/detail/side_track_blend.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace kinespace {
namespace {

using Value = std::array<double, 4>;

Value rest_of(int joint, int dimensions, const Skeleton& skeleton) {
  if (dimensions == 4) return {1, 0, 0, 0};
  const Eigen::Vector3d& offset = skeleton.joints[static_cast<std::size_t>(joint)].offset;
  return {offset.x(), offset.y(), offset.z(), 0};
}

Value value_at(const SideTrack& track, double frame) {
  const auto d = static_cast<std::size_t>(track.dimensions);
  const auto after = std::ranges::upper_bound(track.frames, frame) - track.frames.begin();
  const auto high = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after, 0, std::ssize(track.frames) - 1));
  const std::size_t low = high == 0 ? 0 : high - 1;
  const double span = track.frames[high] - track.frames[low];
  const double b = span > 0 ? std::clamp((frame - track.frames[low]) / span, 0.0, 1.0) : 0;
  Value out{};
  for (std::size_t k = 0; k < d; ++k) out[k] = (1 - b) * track.values[low * d + k] + b * track.values[high * d + k];
  return out;
}

const SideTrack* find_track(const ClipCurves& clip, int joint, int dimensions) {
  const auto found = std::ranges::find_if(
      clip.side_tracks, [&](const SideTrack& t) { return t.joint == joint && t.dimensions == dimensions; });
  return found == clip.side_tracks.end() ? nullptr : &*found;
}

void add(Value& sum, Value value, double weight, int dimensions) {
  double dot = 0;
  for (std::size_t k = 0; k < value.size(); ++k) dot += sum[k] * value[k];
  if (dimensions == 4 && dot < 0) weight = -weight;  // the same rotation, on the side of the sum
  for (std::size_t k = 0; k < value.size(); ++k) sum[k] += weight * value[k];
}

}  // namespace

std::vector<SideTrack> blend_side_tracks(std::span<const ClipCurves> clips,
                                         std::span<const std::vector<FramePart>> parts, const Skeleton& skeleton) {
  std::map<std::pair<int, int>, SideTrack> tracks;
  for (const ClipCurves& clip : clips) {
    for (const SideTrack& track : clip.side_tracks) {
      tracks[{track.dimensions == 4 ? 0 : 1, track.joint}] = {.joint = track.joint, .dimensions = track.dimensions};
    }
  }
  std::vector<SideTrack> out;
  for (auto& [key, track] : tracks) {
    for (std::size_t f = 0; f < parts.size(); ++f) {
      Value sum{};
      for (const FramePart& part : parts[f]) {
        const SideTrack* own = find_track(clips[part.clip], track.joint, track.dimensions);
        const double frame = part.time_s * clips[part.clip].rate_hz;
        add(sum, own ? value_at(*own, frame) : rest_of(track.joint, track.dimensions, skeleton), part.weight,
            track.dimensions);
      }
      track.frames.push_back(static_cast<int>(f));
      track.values.insert(track.values.end(), sum.begin(), sum.begin() + track.dimensions);
    }
    out.push_back(std::move(track));
  }
  return out;
}

}  // namespace kinespace
