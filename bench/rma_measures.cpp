#include "bench/rma_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/timing.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/codecs/rma/rma_codec.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

struct ClipJudgement {
  double slide = 0;
  double original = 0;
  double planted = 0;  // frames of clips with feet that stand
  std::vector<float> at_seams;
  std::vector<float> elsewhere;
};

ClipJudgement judge(const Clip& original, const Clip& decoded, const std::vector<int>& seams) {
  ClipJudgement out;
  const auto after = compare_skate(original, decoded);
  const auto before = compare_skate(original, original);
  if (after && before && after->foot_slide_cm_s && before->foot_slide_cm_s) {
    out.planted = original.frames;
    out.slide = *after->foot_slide_cm_s * out.planted;
    out.original = *before->foot_slide_cm_s * out.planted;
  }
  const JointPositions p = joint_positions(decoded);
  for (int f = 1; f + 1 < decoded.frames; ++f) {
    // A seam lies between two frames; both are looked at.
    const bool seam = std::ranges::binary_search(seams, f) || std::ranges::binary_search(seams, f + 1);
    for (int j = 0; j < p.joints; ++j) {
      const double change = std::abs((p.at(f + 1, j) - p.at(f, j)).norm() - (p.at(f, j) - p.at(f - 1, j)).norm());
      (seam ? out.at_seams : out.elsewhere).push_back(static_cast<float>(change * decoded.rate_hz));
    }
  }
  return out;
}

}  // namespace

double CodedSet::frames() const {
  double out = 0;
  for (const auto& clips : streams) {
    for (const Clip& clip : clips) out += clip.frames;
  }
  return out;
}

double CodedSet::raw_bytes() const {
  double out = 0;
  for (const auto& clips : streams) {
    for (const Clip& clip : clips) {
      out += kinespace::raw_bytes(clip);
    }
  }
  return out;
}

CodedSet CodedSet::only(std::size_t stream) const {
  return {.name = names[stream], .names = {names[stream]}, .streams = {streams[stream]}};
}

CodedFigures code_set(const CodedSet& set, std::string_view codec, const CodecOptions& options) {
  constexpr int rounds = 3;  // of decoding: others on the machine only slow it down
  CodedFigures out;
  const double encoding = seconds([&] {
    for (const auto& clips : set.streams) out.streams.push_back(encode(codec, clips, options));
  });
  for (std::size_t s = 0; s < set.streams.size(); ++s) {
    double part = 0;
    for (const Clip& clip : set.streams[s]) part += clip.frames / set.frames();
    out.bytes += static_cast<double>(out.streams[s].size());
    out.mean_error_cm += part * Bitstream::parse(out.streams[s], "bench").error().mean_joint_error_cm;
  }
  double decoding = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds; ++round) {
    decoding = std::min(decoding, seconds([&] {
                          for (const Bytes& stream : out.streams) {
                            static_cast<void>(open_stream(stream, "bench")->decode_all());
                          }
                        }));
  }
  out.ratio = set.raw_bytes() / out.bytes;
  out.encode_frames_per_s = set.frames() / encoding;
  out.decode_frames_per_s = set.frames() / decoding;
  return out;
}

DecodedFigures judge_set(const CodedSet& set, const CodedFigures& coded) {
  DecodedFigures out;
  double planted = 0;
  float largest = 0;
  std::vector<float> elsewhere;
  for (std::size_t s = 0; s < set.streams.size(); ++s) {
    const std::vector<Clip> decoded = open_stream(coded.streams[s], "bench")->decode_all();
    const auto seams = rma_seams(coded.streams[s], "bench");
    std::vector<ClipJudgement> parts(decoded.size());
    parallel_for(std::size_t{0}, parts.size(),
                 [&](std::size_t c) { parts[c] = judge(set.streams[s][c], decoded[c], seams[c]); });
    for (const ClipJudgement& part : parts) {
      out.slide_cm_s += part.slide;
      out.original_slide_cm_s += part.original;
      planted += part.planted;
      for (const float change : part.at_seams) largest = std::max(largest, change);
      elsewhere.insert(elsewhere.end(), part.elsewhere.begin(), part.elsewhere.end());
    }
  }
  if (planted > 0) {
    out.slide_cm_s /= planted;
    out.original_slide_cm_s /= planted;
  }
  if (!elsewhere.empty()) {
    const auto rank = static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(elsewhere.size() - 1));
    std::ranges::nth_element(elsewhere, elsewhere.begin() + rank);
    out.seam_ratio = largest / std::max(elsewhere[static_cast<std::size_t>(rank)], 1e-6F);
  }
  return out;
}

}  // namespace kinespace
