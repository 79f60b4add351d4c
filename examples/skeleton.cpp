#include "examples/performance.h"
#include "examples/sample_motions.h"

namespace kinespace {
namespace {

using Eigen::Vector3d;

std::vector<Channel> channels_of(bool root) {
  std::vector<Channel> rotations = {Channel::z_rotation, Channel::x_rotation, Channel::y_rotation};
  if (root) rotations.insert(rotations.begin(), {Channel::x_position, Channel::y_position, Channel::z_position});
  return rotations;
}

int add(Skeleton& skeleton, std::string name, int parent, const Vector3d& offset) {
  skeleton.joints.push_back({.name = std::move(name),
                             .parent = parent,
                             .offset = offset,
                             .channels = channels_of(parent < 0),
                             .end_site = std::nullopt});
  return skeleton.joint_count() - 1;
}

// Offsets below are those of the left side, shares of the height; `mirror` is -1 for the right.
void add_arm(Skeleton& skeleton, const std::string& side, int chest, double h, double mirror) {
  const int shoulder = add(skeleton, side + "Shoulder", chest, h * Vector3d(mirror * 0.020, 0.083, 0.004));
  const int arm = add(skeleton, side + "Arm", shoulder, h * Vector3d(mirror * 0.085, -0.005, -0.004));
  const int fore_arm = add(skeleton, side + "ForeArm", arm, h * Vector3d(mirror * 0.186, 0, 0));
  const int hand = add(skeleton, side + "Hand", fore_arm, h * Vector3d(mirror * 0.146, 0, 0));
  skeleton.joints[hand].end_site = h * Vector3d(mirror * 0.108, 0, 0);
}

void add_leg(Skeleton& skeleton, const std::string& side, double h, double mirror) {
  const int up_leg = add(skeleton, side + "UpLeg", 0, h * Vector3d(mirror * 0.050, -0.015, 0));
  const int leg = add(skeleton, side + "Leg", up_leg, h * Vector3d(0, -0.245, 0));
  const int foot = add(skeleton, side + "Foot", leg, h * Vector3d(0, -0.246, 0));
  const int toe = add(skeleton, side + "ToeBase", foot, h * Vector3d(0, -0.039, 0.075));
  skeleton.joints[toe].end_site = h * Vector3d(0, 0, 0.040);
}

}  // namespace

std::string_view to_string(Side side) {
  switch (side) {
    case Side::left:
      return "left";
    case Side::right:
      return "right";
    case Side::both:
      break;
  }
  return "both";
}

Skeleton sample_skeleton(double height_cm) {
  samples::require_range("height_cm", height_cm, 50, 300);
  const double h = height_cm;
  Skeleton out;
  const int hips = add(out, "Hips", -1, h * Vector3d(0, 0.545, 0));
  const int spine = add(out, "Spine", hips, h * Vector3d(0, 0.055, 0));
  const int spine1 = add(out, "Spine1", spine, h * Vector3d(0, 0.065, 0));
  const int spine2 = add(out, "Spine2", spine1, h * Vector3d(0, 0.075, 0));
  const int neck = add(out, "Neck", spine2, h * Vector3d(0, 0.115, 0));
  const int head = add(out, "Head", neck, h * Vector3d(0, 0.050, 0));
  out.joints[head].end_site = h * Vector3d(0, 0.095, 0);
  add_arm(out, "Left", spine2, h, 1);
  add_arm(out, "Right", spine2, h, -1);
  add_leg(out, "Left", h, 1);
  add_leg(out, "Right", h, -1);
  return out;
}

}  // namespace kinespace
