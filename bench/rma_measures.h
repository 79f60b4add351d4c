// What `bench rma` measures of a coded collection.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

// Clips in the streams that they are coded in.
struct CodedSet {
  std::string name;
  std::vector<std::string> names;  // by stream
  std::vector<std::vector<Clip>> streams;

  [[nodiscard]] double frames() const;
  // 32-bit floats of three numbers for the root and three for each rotating joint.
  [[nodiscard]] double raw_bytes() const;
  // One of the streams by itself.
  [[nodiscard]] CodedSet only(std::size_t stream) const;
};

struct CodedFigures {
  double ratio = 0;
  double bytes = 0;
  double mean_error_cm = 0;
  double encode_frames_per_s = 0;
  double decode_frames_per_s = 0;
  std::vector<Bytes> streams;
};

[[nodiscard]] CodedFigures code_set(const CodedSet& set, std::string_view codec, const CodecOptions& options);

struct DecodedFigures {
  double slide_cm_s = 0;           // of planted feet, decoded
  double original_slide_cm_s = 0;  // the same feet in the original
  double seam_ratio =
      0;  // the largest change of joint speed where coded pieces meet over the 99.9th percentile elsewhere
};
[[nodiscard]] DecodedFigures judge_set(const CodedSet& set, const CodedFigures& coded);

}  // namespace kinespace
