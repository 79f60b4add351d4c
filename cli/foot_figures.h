// How feet move, as the subcommands print it: the same figures of the same names wherever a motion is written or looked at.
#pragma once

#include <optional>

#include "cli/json_output.h"
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/motion/clip.h"

namespace kinespace::cli {

// {slide_cm_s, lowest_speed_cm_s, penetration_cm, hover_cm}; all null where nothing is known of feet.
[[nodiscard]] Json foot_figures(const std::optional<FootMotion>& motion);
// Of a clip, by its own legs and ground.
[[nodiscard]] Json foot_figures(const Clip& clip);

}  // namespace kinespace::cli
