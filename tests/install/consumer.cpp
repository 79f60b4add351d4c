// A program of a user's: it sees only the installed headers and libraries, and has headers of its own that are named alike.
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <kinespace/kinespace.h>

#include "base/error.h"
#include "motion/clip.h"

static_assert(KINESPACE_VERSION_MAJOR + KINESPACE_VERSION_MINOR + KINESPACE_VERSION_PATCH > 0);

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  using kinespace::Channel;
  kinespace::Skeleton skeleton;
  skeleton.joints.push_back({.name = "Hips",
                             .channels = {Channel::x_position, Channel::y_position, Channel::z_position,
                                          Channel::z_rotation, Channel::x_rotation, Channel::y_rotation}});
  skeleton.joints.push_back({.name = "Head",
                             .parent = 0,
                             .offset = {0, 60, 0},
                             .channels = {Channel::z_rotation, Channel::x_rotation, Channel::y_rotation},
                             .end_site = Eigen::Vector3d(0, 10, 0)});
  const kinespace::Clip written = kinespace::make_clip("nod", skeleton, 30, 4);
  const std::filesystem::path file = std::filesystem::path(argv[1]) / "nod.bvh";
  kinespace::write_clip(file, written);
  const kinespace::MotionError error = kinespace::compare(written, kinespace::read_clip(file));
  std::printf("%d joints, %d frames, %g cm\n", error.joints, error.frames, error.max_joint_error_cm);
  return error.joints == 2 && error.frames == 4 && error.max_joint_error_cm < 1e-4 ? user::Clip{}.code : 1;
}
