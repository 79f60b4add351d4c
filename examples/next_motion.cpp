// What a game does with a library of motions, frame by frame:
//
//   next-motion LIB.kspace FROM TO
//
// Plays FROM with the detail that a camera's distance asks for, finds out how it goes over into TO - directly or
// through other motions - and writes the whole as next-motion.bvh.
#include <cstdio>
#include <string>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/motion/read.h"
#include "kinespace/synthesis/motion_engine.h"

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: next-motion LIB.kspace FROM TO\n");
    return 2;
  }
  try {
    kinespace::MotionEngine engine(argv[1]);
    const std::string from = argv[2], to = argv[3];

    // A character that walks away from the camera: fewer functions, the farther it is. Nothing is allocated here.
    const kinespace::Player player = engine.play(from, {.loop = true});
    std::vector<float> rotations(4 * static_cast<std::size_t>(player.joints()));  // w x y z of each joint
    for (int frame = 0; frame < 3; ++frame) {
      const int functions = 15 - 5 * frame;
      const Eigen::Vector3f hips = player.pose(frame / 60.0, functions, rotations);
      std::printf("%2d functions: hips at %.1f %.1f %.1f cm\n", functions, hips.x(), hips.y(), hips.z());
    }

    const auto next = engine.transition({from, to}, {.via_graph = true});
    if (!next) {
      std::printf("no way from %s to %s\n", from.c_str(), to.c_str());
      return 0;
    }
    for (const std::string& clip : next->clips) std::printf("%s\n", clip.c_str());
    kinespace::write_clip("next-motion.bvh", next->transition.clip);
    return 0;
  } catch (const kinespace::Error& error) {
    std::fprintf(stderr, "next-motion: %s\n", error.what());
    return static_cast<int>(error.kind());
  }
}
