// The picture of a repeated motion analysis: the self-distance table of one group with its similar-posture paths and
// the clips chosen (lin2011, figures 6 and 7), as SVG.
//
// Time runs to the right and down, in seconds of the group's frames one after the other. Dark pixels are like postures;
// white lines part stretches that do not follow each other. Below the diagonal the table is as it is; above it paths
// are orange, and what repeated clips refer to is green. Bars along both axes show the clips: primary blue, repeated
// green, unique pink. The table itself is an image (PNG) inside the SVG. The same input gives the same text.
#pragma once

#include <string>

#include "kinespace/repeats/repeats.h"

namespace kinespace {

struct RepeatPictureOptions {
  int group = -1;     // -1: the one with most frames
  int size_px = 900;  // 200 to 4000: of the table; larger tables are drawn coarser
  void validate() const;
};

// `options` are those of the analysis. Of a group with more frames than one table takes, the first table is drawn.
// Throws Error{usage} when the analysis has no such group or is not of this table.
[[nodiscard]] std::string repeat_picture_svg(const FrameTable& table, const RepeatAnalysis& analysis,
                                             const RepeatOptions& options = {},
                                             const RepeatPictureOptions& picture = {});

}  // namespace kinespace
