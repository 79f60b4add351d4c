// What a page of `kinespace view` knows of a library, as JSON. viewer/src/data.ts says what each key is and reads it.
//
// The page gets the library's own numbers and no poses: the functions of the motion spaces, and of each clip its scores,
// warps and travel, from which it plays any level of detail (viewer/src/motion.ts). Blocks of numbers stand in base64:
// 32-bit floats, or whole numbers as zigzag varints (storage/varint.h).
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "cli/json_output.h"
#include "kinespace/base/progress.h"
#include "kinespace/kernels/device.h"
#include "kinespace/library/library_view.h"

namespace kinespace::cli {

struct ViewOptions {
  std::vector<std::string> clips;       // these, and the nearest of each; none: all
  std::size_t most_bytes = 30'000'000;  // of the data in the page
  int nearest = 5;                      // how many of the nearest clips of each are found; 0: none
  bool originals = false;               // also where joints were in the files that clips came from
};

// Of so many clips at most the nearest ones are found: each takes a query with DTW.
inline constexpr std::size_t most_clips_with_nearest = 300;

struct ViewData {
  struct Motion {
    std::size_t clip = 0;  // its place in the library's list
    std::string json;
  };
  std::string overview;         // one JSON object: spaces, skeletons, levels, and every clip's name, labels and place
  std::vector<Motion> motions;  // of the clips that the page plays
  std::size_t clips = 0;        // of the library
  std::size_t with_nearest = 0;
  std::size_t with_original = 0;

  [[nodiscard]] std::size_t bytes() const;
};

// Which clips: those that were named and then the nearest of each; of a library that is too large for the page those
// that are spread evenly over its list. Throws Error{usage} naming a clip that is not there, or what does not fit.
[[nodiscard]] ViewData view_data(LibraryView& library, const ViewOptions& options, const Compute& compute,
                                 const Progress& progress);

}  // namespace kinespace::cli
