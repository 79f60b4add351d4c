#include "cli/synthesis_output.h"

#include "cli/foot_figures.h"
#include "cli/session.h"
#include "kinespace/base/file.h"
#include "kinespace/footskate/cleanup.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {

void write_synthesis(const SynthesisOutput& output, Clip clip, const std::vector<StripBand>& bands, Json& result,
                     Session& session) {
  StripOptions strip{.title = clip.name, .bands = bands};
  Json feet;
  if (output.clean_feet) {
    const CleanResult cleaned = clean(clip);
    const CleanReport& report = cleaned.report;
    const auto joints = report.feet.foot_joints();
    for (const Plant& plant : report.plants) {
      strip.marks.push_back({.joint = joints[plant.contact.slot],
                             .first_frame = plant.contact.first_frame,
                             .last_frame = plant.contact.last_frame,
                             .position_cm = plant.place});
    }
    strip.floor_cm = report.ground.height_cm;
    feet = {{"plants", report.plants.size()},
            {"foot_slide_before_cm_s", or_null(report.foot_slide_before_cm_s)},
            {"foot_slide_after_cm_s", or_null(report.foot_slide_after_cm_s)},
            {"floor_penetration_cm", report.floor_penetration_cm}};
    session.doubt_result(doubts_about(report), output.strict);
    clip = cleaned.clip;
  }
  Session::check_stop();
  write_clip(output.file, clip);
  if (output.picture) write_strip(*output.picture, clip, strip);
  result["output"] = output.file.string();
  result["frames"] = clip.frames;
  result["rate_hz"] = clip.rate_hz;
  result["duration_s"] = clip.duration_s();
  result["feet"] = foot_figures(clip);
  result.update(feet.is_null() ? Json::object() : feet);
}

}  // namespace kinespace::cli
