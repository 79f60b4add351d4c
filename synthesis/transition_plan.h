// Transitions between clips of a library, directly or through others (yoo2019, section 6.2).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/library/library_view.h"
#include "kinespace/synthesis/motion_graph.h"
#include "kinespace/synthesis/transition.h"

namespace kinespace {

struct TransitionPlanOptions {
  bool via_graph = false;  // lead through other clips of the library where the direct way is farther (motion_graph.h)
  bool keep_graph = true;  // write a graph that is new back into the library, if it can be written
  TransitionOptions join;
  MotionGraphOptions graph;  // with the options of connections, also of direct ones

  void validate() const;  // throws Error{usage} naming field, value and legal range
};

struct PlannedTransition {
  Transition transition;
  // What is played; a clip that is blended into a neighbour while it plays is joined to it by "~".
  std::vector<std::string> pieces;
  std::vector<std::string> clips;  // the same, each clip by itself
};

// Plays the named clips one after the other. None when the graph has no way between two of them: an answer. Throws
// Error{usage} for an unknown name, Error{bad_input} for clips of different skeletons and for a clip shorter than twice
// the smallest overlap.
[[nodiscard]] std::optional<PlannedTransition> plan_transition(LibraryView& library, std::span<const std::string> clips,
                                                               const TransitionPlanOptions& options = {},
                                                               const Progress& progress = {});

}  // namespace kinespace
