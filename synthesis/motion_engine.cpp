#include "kinespace/synthesis/motion_engine.h"

namespace kinespace {

std::vector<Match> MotionEngine::nearest(const Clip& motion, const QueryOptions& options) {
  return nearest_motions(library_, motion, options);
}

Clip MotionEngine::motion(const std::string& clip, int functions) {
  return library_.clip(library_.require_clip(clip), functions);
}

Player MotionEngine::play(const std::string& clip, const PlayerOptions& options) {
  const ClipRow row = library_.require_clip(clip);
  std::shared_ptr<const PlaybackBasis>& basis = bases_[row.space_id];
  if (!basis) basis = std::make_shared<const PlaybackBasis>(library_.space(row.space_id));
  return {basis, library_.encoded(row), options};
}

Blend MotionEngine::blend(const std::vector<std::string>& clips, const BlendOptions& options) {
  return make_blend(library_, clips, options);
}

std::optional<PlannedTransition> MotionEngine::transition(const std::vector<std::string>& clips,
                                                          const TransitionPlanOptions& options) {
  return plan_transition(library_, clips, options);
}

FillResult MotionEngine::fill(const Clip& clip, FrameRange missing) {
  const std::string tree = clip.skeleton.tree_hash();
  auto model = fill_models_.find(tree);
  if (model == fill_models_.end()) {
    model = fill_models_.emplace(tree, FillModel::build(library_, clip.skeleton)).first;
  }
  return kinespace::fill(model->second, clip, missing);
}

}  // namespace kinespace
