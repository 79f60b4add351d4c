#include "kinespace/synthesis/transition_plan.h"

#include <algorithm>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/synthesis/detail/library_clips.h"
#include "kinespace/synthesis/interpolation.h"

namespace kinespace {
namespace {

using Kind = GraphArrow::Kind;

void require_length(const LibraryView& library, const ClipRow& row, double shortest_s) {
  const double duration = static_cast<double>(row.frames - 1) / row.rate_hz;
  if (duration / 2 >= shortest_s) return;
  throw Error(ErrorKind::bad_input,
              {.file = library.library().path().string(),
               .found = fmt::format("{} of {:.2f} s", row.name, duration),
               .expected = fmt::format("clips of at least {:.2f} s: twice the smallest overlap", 2 * shortest_s),
               .remedy = "use a longer clip, or a smaller overlap"});
}

// A graph that is new goes into the file. A library that cannot be written (no rights, in use) keeps the one it has:
// nothing but time is lost.
void keep(const MotionGraph& graph, const LibraryView& library) {
  try {
    Library file = Library::open(library.library().path());
    graph.save(file);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::machine) throw;
  }
}

// The clips from the first name to the last and how each goes over into the next; none when there is no way.
std::optional<GraphPath> way_through(LibraryView& library, const std::vector<ClipRow>& rows,
                                     const ConnectionSpace& space, const MotionGraph& graph) {
  GraphPath out{.clips = {rows.front().id}};
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    auto path = graph.path(rows[i].id, rows[i + 1].id);
    const auto direct =
        space.connect(space.end_of(library.curves(rows[i])), space.start_of(library.curves(rows[i + 1])));
    const bool near = direct && direct->cost_cm <= graph.options().largest_cost_cm &&
                      (!path || MotionGraph::weight_of(direct->cost_cm) <= path->weight);
    if (near || (path && path->clips.size() == 1)) {  // one clip after itself is a direct way too
      path = GraphPath{.clips = {rows[i].id, rows[i + 1].id}, .kinds = {Kind::connection}};
    }
    if (!path) return std::nullopt;
    out.clips.insert(out.clips.end(), path->clips.begin() + 1, path->clips.end());
    out.kinds.insert(out.kinds.end(), path->kinds.begin(), path->kinds.end());
  }
  return out;
}

// Clips that lead from neighbour to neighbour as one motion: each alone at first and at last, so that it is entered and
// left as the first and the last clip are.
ClipCurves neighbours_as_one(const RegisteredSpace& space, std::span<const ClipCurves> clips,
                             const Skeleton& skeleton) {
  constexpr double alone = 0.3;
  const BezierWeights weights = BezierWeights::through_motions(
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(clips.size()), 1), static_cast<int>(clips.size()));
  const BlendedMotion blended = blend_motions(clips, skeleton, [&](double share) {
    const double x = std::clamp((share - alone) / (1 - 2 * alone), 0.0, 1.0);
    return weights.at(x * x * (3 - 2 * x) * weights.segments());
  });
  ClipCurves curves = clip_curves(blended.clip);
  curves.name.clear();
  for (const ClipCurves& clip : clips) curves.name += (curves.name.empty() ? "" : "~") + clip.name;
  space.apply_references(curves.values);
  return curves;
}

}  // namespace

void TransitionPlanOptions::validate() const {
  join.validate();
  graph.validate();
}

std::optional<PlannedTransition> plan_transition(LibraryView& library, std::span<const std::string> clips,
                                                 const TransitionPlanOptions& options, const Progress& progress) {
  options.validate();
  if (clips.size() < 2) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} clip", clips.size()), .expected = "two clips or more"});
  }
  const std::vector<ClipRow> rows = clips_of_one_tree(library, clips);
  for (const ClipRow& row : rows) require_length(library, row, options.graph.connection.shortest_s);
  const RegisteredSpace& motions = library.space(rows.front().space_id);
  const Skeleton& skeleton = library.skeleton(rows.front().skeleton_id);
  const ConnectionSpace space(motions, options.graph.connection);

  GraphPath way;
  if (options.via_graph) {
    bool changed = false;
    const MotionGraph graph = MotionGraph::of(library, rows.front().space_id, options.graph, progress, &changed);
    if (changed && options.keep_graph) keep(graph, library);
    auto found = way_through(library, rows, space, graph);
    if (!found) return std::nullopt;
    way = *std::move(found);
  } else {
    for (const ClipRow& row : rows) way.clips.push_back(row.id);
    way.kinds.assign(rows.size() - 1, Kind::connection);
  }

  PlannedTransition out;
  std::vector<ClipCurves> pieces, group;
  std::vector<std::optional<FootContacts>> contacts;  // of each piece, where the library keeps them
  for (std::size_t i = 0; i < way.clips.size(); ++i) {
    const ClipRow row = library.library().clip(way.clips[i]);
    out.clips.push_back(row.name);
    group.push_back(library.curves(row));
    if (i < way.kinds.size() && way.kinds[i] == Kind::neighbour) continue;
    const auto feet = group.size() == 1 ? library.feet(row) : std::nullopt;
    contacts.push_back(feet ? std::optional(feet->frames()) : std::nullopt);
    pieces.push_back(group.size() == 1 ? std::move(group.front()) : neighbours_as_one(motions, group, skeleton));
    out.pieces.push_back(pieces.back().name);
    group.clear();
  }
  if (pieces.size() == 1) {  // neighbours all the way: a blend, with nothing to join
    out.transition.clip = clip_from_curves(pieces.front(), skeleton);
  } else {
    out.transition = make_transition(space, pieces, skeleton, options.join, contacts);
  }
  return out;
}

}  // namespace kinespace
