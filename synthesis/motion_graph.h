// The graph of a library's motions: which can follow which, and how two that are far apart are joined through others
// (yoo2019, section 6.2; kovar 2002, "Motion graphs").
//
// An arrow from one clip to another is either a connection (connection.h: the end of one goes over into the start of
// the other) or leads to a neighbour (one of the nearest clips in the space, into which the motion is blended while it
// plays, interpolation.h). Kept for each clip are the `connections` best ways out of it, the best way into each of
// `groups` groups of similar clips (so that far motions are few steps away), and its nearest neighbours, with at most
// `largest_cost_cm`. Which connections are the best is exact: pairs are tried by their lower bounds (ConnectionBounds)
// until no other can be better; into a group it is the best of the 4 of lowest bound. Groups of clips that still cannot
// be left or reached are joined by bridges: the best of the 16 connections between the poses nearest on the average,
// until all are joined or nothing below the largest cost is left.
//
// The graph is kept in the library file. Clips that were added since are taken in, with the functions that the graph
// was made with, so that old arrows keep their costs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/base/progress.h"
#include "kinespace/library/library_view.h"
#include "kinespace/synthesis/connection.h"

namespace kinespace {

struct MotionGraphOptions {
  int connections = 4;          // 1 .. 1000
  int groups = 12;              // 1 .. 1000
  int neighbours = 4;           // 0 .. 1000
  double largest_cost_cm = 30;  // > 0
  ConnectionOptions connection;

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

struct GraphArrow {
  enum class Kind : std::uint8_t { connection, neighbour };
  std::int64_t from = 0, to = 0;  // ids of clips
  Kind kind = Kind::connection;
  double cost_cm = 0;
  bool operator==(const GraphArrow&) const = default;
};

// Clips in the order they are played; kinds[i] is how clips[i] goes over into clips[i + 1].
struct GraphPath {
  std::vector<std::int64_t> clips;
  std::vector<GraphArrow::Kind> kinds;
  double cost_cm = 0;  // sum of the arrows
  double weight = 0;   // what was minimised
};

class MotionGraph {
 public:
  // The graph that the library keeps, with all its clips taken in; made when there is none. Says in `changed` whether
  // it is another than the library has.
  [[nodiscard]] static MotionGraph of(LibraryView& library, std::int64_t space_id, const MotionGraphOptions& options,
                                      const Progress& progress = {}, bool* changed = nullptr);
  // The same from nothing, whatever the library keeps.
  [[nodiscard]] static MotionGraph make(LibraryView& library, std::int64_t space_id, const MotionGraphOptions& options,
                                        const Progress& progress = {});
  // Keeps the graph in the library.
  void save(Library& library) const;

  // The lightest path between two clips. An arrow of cost c weighs c^2 / 5 cm + 1 cm, so that a far step gives way to
  // several near ones, and a clip in between 0.5 cm for every second that it plays. None when there is no way: an
  // answer, not an error.
  [[nodiscard]] std::optional<GraphPath> path(std::int64_t from, std::int64_t to) const;

  [[nodiscard]] const std::vector<GraphArrow>& arrows() const { return arrows_; }  // by from, to, kind
  [[nodiscard]] const std::vector<std::int64_t>& clips() const { return clips_; }  // ids, ascending
  [[nodiscard]] const SampleMatrix& functions() const { return functions_; }
  [[nodiscard]] const MotionGraphOptions& options() const { return options_; }

  [[nodiscard]] Bytes pack() const;
  [[nodiscard]] static MotionGraph unpack(std::span<const std::byte> bytes, const std::string& source);

  // What an arrow of that cost weighs.
  [[nodiscard]] static double weight_of(double cost_cm) { return cost_cm * cost_cm / 5 + 1; }

 private:
  MotionGraph() = default;
  void take_in(LibraryView& library, std::int64_t space_id, const Progress& progress);

  MotionGraphOptions options_;
  std::string key_;         // of the library's artifact
  SampleMatrix functions_;  // of the connections
  std::vector<std::int64_t> clips_;
  std::vector<std::int64_t> templates_;  // one clip a group
  std::vector<double> durations_s_;
  std::vector<GraphArrow> arrows_;
};

}  // namespace kinespace
