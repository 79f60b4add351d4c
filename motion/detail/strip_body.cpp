#include "kinespace/motion/detail/strip_body.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

bool contains_word(const std::string& name, std::string_view word) {
  const auto found = std::ranges::search(name, word, {}, [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : int{c}; });
  return !found.empty();
}

// The names that `name` has with one mark of the side `from` put for `to`: whole words ("left"), and a single letter
// that stands at an end or beside a separator ("L_Arm", "arm.l", "lfemur").
std::vector<std::string> mirrored_names(const std::string& name, const std::array<std::string_view, 4>& from,
                                        const std::array<std::string_view, 4>& to) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < from.size(); ++k) {
    for (std::size_t at = name.find(from[k]); at != std::string::npos; at = name.find(from[k], at + 1)) {
      const std::size_t end = at + from[k].size();
      const auto separates = [](char c) { return c == '_' || c == '.' || c == '-' || c == ':' || c == ' '; };
      const bool alone = at == 0 || end == name.size() || separates(name[at - 1]) || separates(name[end]);
      if (from[k].size() > 1 || alone) out.push_back(name.substr(0, at) + std::string(to[k]) + name.substr(end));
    }
  }
  return out;
}

BodySide side_of(const Skeleton& skeleton, const std::string& name) {
  constexpr std::array<std::string_view, 4> left = {"left", "Left", "l", "L"};
  constexpr std::array<std::string_view, 4> right = {"right", "Right", "r", "R"};
  const auto is_joint = [&](const std::string& other) { return skeleton.find(other) >= 0; };
  if (std::ranges::any_of(mirrored_names(name, left, right), is_joint)) return BodySide::left;
  if (std::ranges::any_of(mirrored_names(name, right, left), is_joint)) return BodySide::right;
  return BodySide::middle;
}

}  // namespace

std::vector<BodySide> body_sides(const Skeleton& skeleton) {
  std::vector<BodySide> out;
  for (const Joint& joint : skeleton.joints) {
    BodySide side = side_of(skeleton, joint.name);
    if (side == BodySide::middle && joint.parent >= 0) side = out[static_cast<std::size_t>(joint.parent)];
    out.push_back(side);
  }
  return out;
}

StickBody stick_body(const Skeleton& skeleton) {
  StickBody out{.sides = body_sides(skeleton), .root = skeleton.travel_root()};
  if (skeleton.rest_height() > 0) out.height = skeleton.rest_height();
  for (int j = out.root; j < skeleton.joint_count(); ++j) {
    const Joint& joint = skeleton.joints[static_cast<std::size_t>(j)];
    const BodySide side = out.sides[static_cast<std::size_t>(j)];
    if (j > out.root) out.bones.push_back({joint.parent, j, side});
    if (contains_word(joint.name, "head")) out.head = j;
    if (!joint.end_site) continue;
    const int end = skeleton.joint_count() + static_cast<int>(out.ends.size());
    out.ends.emplace_back(j, *joint.end_site);
    if (j == out.head) {
      out.crown = end;
    } else {
      out.bones.push_back({j, end, side});
    }
  }
  return out;
}

std::vector<Eigen::Vector3d> stick_points(const Clip& clip, const StickBody& body, int frame) {
  std::vector<JointFrame> frames;
  world_frames(clip, frame, frames);
  std::vector<Eigen::Vector3d> out;
  for (const JointFrame& f : frames) out.push_back(f.position);
  for (const auto& [joint, offset] : body.ends) {
    const JointFrame& f = frames[static_cast<std::size_t>(joint)];
    out.push_back(f.position + f.rotation * offset);
  }
  return out;
}

}  // namespace kinespace
