#include "cli/foot_figures.h"

namespace kinespace::cli {

Json foot_figures(const std::optional<FootMotion>& motion) {
  if (!motion) {
    return {
        {"slide_cm_s", nullptr}, {"lowest_speed_cm_s", nullptr}, {"penetration_cm", nullptr}, {"hover_cm", nullptr}};
  }
  return {{"slide_cm_s", or_null(motion->slide_cm_s)},
          {"lowest_speed_cm_s", or_null(motion->lowest_speed_cm_s)},
          {"penetration_cm", motion->penetration_cm},
          {"hover_cm", motion->hover_cm}};
}

Json foot_figures(const Clip& clip) {
  const auto feet = find_feet(clip);
  if (!feet) return foot_figures(std::optional<FootMotion>());
  const FootTracks tracks = foot_tracks(clip, *feet);
  return foot_figures(foot_motion(tracks, foot_level(tracks)));
}

}  // namespace kinespace::cli
