// What a clip keeps of its feet when it goes into a motion space: when each joint of a foot stands, and where.
//
// A level of detail of a few functions has the motion, but its feet float by some centimetres where those of the
// original stand. These few bytes a contact (about 16) put them back: footskate/foot_planter.h.
//
// A contact's places are the corners of a polyline that stays within 0.25 cm of where the joint was: held feet go where
// those of the original went, and a foot that slid in the original slides no more than it did. Places are kept in steps
// of 0.5 mm.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/base/bytes.h"
#include "kinespace/footskate/contacts.h"
#include "kinespace/motion/curves.h"

namespace kinespace {

struct KeptPlace {
  int frame = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // cm, from the clip's start and turned to its heading (Placement)
};

struct KeptContact {
  int slot = 0;                   // of Feet::foot_joints
  std::vector<KeptPlace> places;  // two or more, frames ascending: the first and the last frame of the contact

  [[nodiscard]] int first_frame() const { return places.front().frame; }
  [[nodiscard]] int last_frame() const { return places.back().frame; }
};

struct KeptFeet {
  std::array<Leg, 2> legs;  // left, right
  // About which the knees bend, in the frame of the hip joint: unit length, or zero where a leg never bends.
  std::array<Eigen::Vector3d, 2> knee_axes{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  // Under the lowest that any joint of a foot came in the original, as Ground::at has it but in the clip's frame.
  double floor_cm = 0;
  Eigen::Vector2d floor_gradient = Eigen::Vector2d::Zero();
  double slide_cm_s = 0;              // foot_slide_cm_s of the original
  std::vector<KeptContact> contacts;  // by slot, then by time; those of one slot do not touch

  [[nodiscard]] FootContacts frames() const;
};

// Below this rate a foot stands and leaves between two frames, and contacts cannot be told.
inline constexpr double least_contact_rate_hz = 20;

// Of longer clips no feet are kept: finding them takes memory that grows with the clip.
inline constexpr int most_frames_with_feet = 120'000;

// The feet of a clip as it was read; `placement` is that of its curves. nullopt where there is nothing to plant: no legs
// that can be told, fewer frames a second than least_contact_rate_hz, more frames than most_frames_with_feet, or no foot
// that ever stands.
[[nodiscard]] std::optional<KeptFeet> keep_feet(const Clip& clip, const Placement& placement);

// As bytes, and back. Reading throws Error{bad_input} naming `source` for joints that are no leg of the skeleton and
// contacts that are not frames of the clip.
[[nodiscard]] Bytes pack_feet(const KeptFeet& feet);
[[nodiscard]] KeptFeet unpack_feet(std::span<const std::byte> bytes, int frames, const Skeleton& skeleton,
                                   const std::string& source);

}  // namespace kinespace
