// From what a stream of the paper's profile holds to clips.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "kinespace/codecs/rma/marker_stream.h"
#include "kinespace/codecs/rma/markers.h"
#include "kinespace/codecs/stream/clip_table.h"

namespace kinespace {

class MarkerDecoder {
 public:
  // Throws Error{bad_input} naming `source` when the analysis clips do not fit the table's. Both must outlive it.
  MarkerDecoder(const ClipTable& table, const MarkerStream& stream, const std::string& source);

  // A whole clip. Safe from several threads.
  [[nodiscard]] Clip decode(std::size_t clip) const;
  // The same before its contacts are held to, and seams eased.
  [[nodiscard]] Clip decode_without_contacts(std::size_t clip) const;
  // The first frames of its analysis clips but the first.
  [[nodiscard]] std::vector<int> seams(std::size_t clip) const;

  // The coefficients of an analysis clip, [axis][frame].
  [[nodiscard]] std::vector<double> coefficients(std::size_t analysis_clip) const;
  [[nodiscard]] static RootAlignment alignment(const RootCode& root, int span);

 private:
  const ClipTable& table_;
  const MarkerStream& stream_;
  std::vector<MarkerRig> rigs_;            // by skeleton
  std::vector<std::size_t> first_clip_;    // by input clip, and the end: analysis clips
  std::vector<std::vector<double>> mean_;  // by group, cm
  std::vector<std::vector<double>> axes_;  // by group, [axis][dimension]
};

// A curve as the decoder has it, at every frame; value = least + (q + offset) step.
void decode_curve(const CurveCode& curve, int frames, int span, double least, double step, double offset,
                  std::span<double> out);

// The reference frames of a repeated clip, at every frame, as frames of its primary clip.
[[nodiscard]] std::vector<int> decode_reference(const MarkerClip& clip, int reference_span, int primary_frames);

}  // namespace kinespace
