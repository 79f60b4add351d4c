// Stretches inside the clips of a library that are nearest to a stretch of motion.
//
// Every clip is cut in windows as long as the query, one starting every 1 / rate_hz (WindowOptions); windows that lie
// across a break of a recording are left out. Their vectors (synthesis/window_space.h) are searched exactly
// (synthesis/vector_search.h): the list is that of comparing with every window, equal distances by the clip that was
// added first, then by time.
//
// Good matches come in flocks: the window that starts a frame later is nearly as near. By default the best of all that
// overlap in one clip stands for them; the full list can be had.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/library/library_view.h"
#include "kinespace/synthesis/retrieval.h"
#include "kinespace/synthesis/vector_search.h"
#include "kinespace/synthesis/window_space.h"

namespace kinespace {

struct WindowQueryOptions {
  int k = 10;                       // matches wanted, >= 1
  bool overlapping = false;         // give windows that overlap a better one in the same clip, too
  std::vector<std::string> labels;  // only windows of clips that have all of these

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// A stretch of a clip, in seconds from its start.
struct TimeRange {
  double from_s = 0;
  std::optional<double> to_s = std::nullopt;  // none: from_s plus the length of a window
};

// The windows of all clips of one joint tree, ready to be searched. For a library of 160 000 frames it takes a few
// seconds to make and 1 kB a window to keep; a query takes well below a millisecond.
class WindowIndex {
 public:
  // Of the clips that are in the motion space `space_id` (LibraryView::space_for). Throws Error{usage} when none of
  // them is as long as a window.
  [[nodiscard]] static WindowIndex build(LibraryView& library, std::int64_t space_id, const WindowOptions& options = {},
                                         const Progress& progress = {});

  // The windows nearest to that which starts at `start_s` of a clip; Match::distance is the L2 distance of the vectors.
  // `except`: the name of the library's clip that the query is from; what overlaps the query there is left out. Throws
  // Error{usage} when the clip ends before the window, and Error{bad_input} for curves of another number of joints.
  [[nodiscard]] std::vector<Match> nearest(const ClipCurves& curves, double start_s,
                                           const WindowQueryOptions& options = {},
                                           const std::string& except = {}) const;

  [[nodiscard]] std::int64_t windows() const { return search_.size(); }
  [[nodiscard]] const WindowSpace& space() const { return space_; }
  [[nodiscard]] const VectorSearch& search() const { return search_; }

 private:
  // Windows of one clip between two breaks: rows first_row, first_row + 1, ... of the search.
  struct Stretch {
    std::int64_t first_row = 0;
    std::size_t clip = 0;  // of clips_
    double start_s = 0;    // of the first window
  };
  WindowIndex(WindowSpace space, VectorSearch search, std::vector<Stretch> stretches, std::vector<ClipRow> clips);
  [[nodiscard]] std::vector<float> vector_of(const ClipCurves& curves, double start_s) const;
  [[nodiscard]] std::vector<std::uint8_t> allowed_rows(double start_s, const WindowQueryOptions& options,
                                                       const std::string& except) const;
  [[nodiscard]] Match match_of(const Neighbour& neighbour) const;
  [[nodiscard]] double length_s() const;

  WindowSpace space_;
  VectorSearch search_;
  std::vector<Stretch> stretches_;  // by first_row
  std::vector<ClipRow> clips_;
};

// One query: makes the index for windows as long as `range` and searches it. No clips of that joint tree: no matches.
// Throws Error{usage} when the range is not within the clip, or shorter or longer than WindowOptions::length_s may be.
[[nodiscard]] std::vector<Match> nearest_windows(LibraryView& library, const Clip& clip, const TimeRange& range = {},
                                                 const WindowQueryOptions& query = {}, WindowOptions windows = {},
                                                 const std::string& except = {});
// The same for curves of a skeleton, as LibraryView::curves gives them.
[[nodiscard]] std::vector<Match> nearest_windows(LibraryView& library, const ClipCurves& curves,
                                                 const Skeleton& skeleton, const TimeRange& range = {},
                                                 const WindowQueryOptions& query = {}, WindowOptions windows = {},
                                                 const std::string& except = {});

}  // namespace kinespace
