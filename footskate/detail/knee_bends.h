// How far legs are bent so that ankles are near where they shall be and no knee jerks.
//
// The knee as a function of the reach (from hip to ankle) has an infinite slope at full extension: a step of the ankle
// by a millimetre throws it by a centimetre. So over all frames the change d of the knee's angle is what makes
//
//   sum over frames  ((r(bend + d) - wished) / give)^2  +  (d'' / 15 rad s^-2)^2
//
// least: where a leg is bent its ankle goes where it shall, where it is nearly straight the ankle gives by millimetres
// along the leg and the knee stays smooth. Second differences are by time, so that it is the same at any rate.
#pragma once

#include <vector>

#include "kinespace/footskate/two_bone_ik.h"

namespace kinespace {

struct LegWish {
  KneeHinge hinge;       // as the leg is
  double reach = 0;      // as it shall be, cm
  bool changes = false;  // false: the leg stays as it is, whatever is wished
};

// The bend for every frame, radians: of KneeHinge. `give_cm` > 0.
[[nodiscard]] std::vector<double> bends_for(const std::vector<LegWish>& wishes, double rate_hz, double give_cm);

}  // namespace kinespace
