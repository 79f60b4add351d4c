// All that a game, a tool or a script asks of a library of motions, in one place.
//
//   kinespace::MotionEngine engine("moves.kspace");
//   const kinespace::Clip take = kinespace::read_clip("take.bvh");
//   const auto near = engine.nearest(take, {.k = 3});                                    // what is this like?
//   const auto player = engine.play("walk_normal_001");                                  // pose by pose, any detail
//   std::vector<float> rotations(4 * static_cast<std::size_t>(player.joints()));
//   const auto root = player.pose(1.25, 5, rotations);                                   // 5 functions, from afar
//   const auto mix = engine.blend({"walk_slow_001", "walk_fast_001"}, {.weights = {{0.3, 0.7}}});
//   const auto on = engine.transition({"walk_normal_001", "run_fast_002"});              // one into the other
//   const auto far = engine.transition({"stand_calm_001", "run_fast_002"}, {.via_graph = true});   // through others
//   const auto whole = engine.fill(take, {.first_frame = 30, .last_frame = 75});         // frames that are missing
//   if (on) kinespace::write_clip("out.bvh", on->transition.clip);
//
// Each call is a thin layer over the header that is named beside it, where its options, errors and results are
// explained. An engine is for one thread at a time; players may be used by many.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kinespace/library/library_view.h"
#include "kinespace/synthesis/filling.h"
#include "kinespace/synthesis/interpolation.h"
#include "kinespace/synthesis/player.h"
#include "kinespace/synthesis/retrieval.h"
#include "kinespace/synthesis/transition_plan.h"

namespace kinespace {

class MotionEngine {
 public:
  explicit MotionEngine(const std::filesystem::path& library) : library_(library) {}

  // The nearest clips, best first (synthesis/retrieval.h).
  [[nodiscard]] std::vector<Match> nearest(const Clip& motion, const QueryOptions& options = {});
  // A clip of the library, decoded with the first so many functions; -1: all.
  [[nodiscard]] Clip motion(const std::string& clip, int functions = -1);
  // Poses at any time and level of detail (synthesis/player.h).
  [[nodiscard]] Player play(const std::string& clip, const PlayerOptions& options = {});
  // A blend, or a Bezier curve through the clips (synthesis/interpolation.h).
  [[nodiscard]] Blend blend(const std::vector<std::string>& clips, const BlendOptions& options = {});
  // The clips one after the other; nothing when there is no way (synthesis/transition_plan.h).
  [[nodiscard]] std::optional<PlannedTransition> transition(const std::vector<std::string>& clips,
                                                            const TransitionPlanOptions& options = {});
  // Missing frames, estimated, with how sure that is (synthesis/filling.h). The first call learns from the library.
  [[nodiscard]] FillResult fill(const Clip& clip, FrameRange missing);

  [[nodiscard]] LibraryView& library() { return library_; }

 private:
  LibraryView library_;
  std::map<std::int64_t, std::shared_ptr<const PlaybackBasis>> bases_;  // by space
  std::map<std::string, FillModel> fill_models_;                        // by joint tree
};

}  // namespace kinespace
