// The encoder of the paper's profile (lin2011, sections 3 to 5), in steps that a search for a target repeats: prepare
// once, then attempt with settings.
#pragma once

#include <span>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/codecs/rma/marker_clips.h"
#include "kinespace/codecs/rma/marker_stream.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/repeats/repeats.h"

namespace kinespace {

struct MarkerSettings {
  double variance = 95;      // percent that the groups' axes keep
  double control_cm = 2.5;   // what a curve may be off before a control point is added
  double primary_cm = 0.5;   // expected error of the quantiser (equation 8)
  double repeated_cm = 0.6;  // the same of repeated clips
  int primary_bits = 0;      // 0: adaptive; else so many bits for every axis
  int repeated_bits = 0;
  bool contacts = true;
};

struct MarkerAttempt {
  MarkerStream stream;
  Bytes bytes;  // of the stream's numbers
  ClipErrorSums error;
};

class MarkerEncoder {
 public:
  struct Preparation {
    bool repeats = true;
    bool contacts = true;
    int span = 0;          // frames between regular control points; 0: 67 ms, at least 5 frames
    double root_cm = 0.8;  // what the alignment may be off
  };
  // Throws Error as Codec::encode does.
  MarkerEncoder(std::span<const Clip> clips, const Preparation& preparation, const Progress& progress);

  [[nodiscard]] MarkerAttempt attempt(const MarkerSettings& settings) const;
  // The share of variance (percent) that leaves the markers so many cm off, as root mean square.
  [[nodiscard]] double variance_for(double left_cm) const;
  [[nodiscard]] const ClipTable& table() const { return table_; }
  [[nodiscard]] const RepeatAnalysis& analysis() const { return analysis_; }
  // The mean number of axes of a frame at a share of variance.
  [[nodiscard]] double mean_axes(double variance) const;

 private:
  struct Curves;
  void fill_markers();
  void split_clips();
  [[nodiscard]] int axes_for(std::size_t group, double variance) const;
  [[nodiscard]] MarkerGroup quantise_group(std::size_t group, double variance) const;
  void code_clips(const MarkerSettings& settings, bool repeated, MarkerStream& stream) const;
  void measure(MarkerAttempt& attempt, bool contacts) const;

  std::span<const Clip> clips_;
  const Progress& progress_;
  AlignedClips aligned_;
  ClipTable table_;
  int span_ = 8;
  int root_span_ = 16;
  int reference_span_ = 16;
  std::vector<RootCode> roots_;
  FrameTable markers_;
  RepeatAnalysis analysis_;
  std::vector<RepeatClip> pieces_;  // the analysis' clips, long unique ones in parts
  std::vector<GroupSpace> spaces_;  // with many axes
  std::vector<std::vector<ContactTrack>> contacts_;
};

// Alignments fitted to so many cm, control points at least every `span` frames.
[[nodiscard]] std::vector<RootCode> fit_roots(const AlignedClips& clips, double tolerance_cm, int span);

// The knots' values of one curve as steps: value = (q + offset) step about a minimum of its own.
[[nodiscard]] CurveCode plain_curve(std::span<const double> curve, int span, double tolerance, double step);

}  // namespace kinespace
