// Contacts learnt from labelled clips: for every frame the labels of the nearest labelled keyframes, averaged
// (ikemoto 2006; yoo2019, section 6.3).
//
// A frame is planted when at least half of its 5 nearest keyframes are, by weights of 1 / (distance^2 + 0.02^2):
// thinned labels are not evenly dense. Where even the nearest one is farther than 0.25 leg lengths (no labelled clip
// shows anything like it), and for feet without toe joints, the rule of height and speed decides (contacts_by_rule).
// What keyframes plant must be within 8 % of the leg length of the ground's level and not fast, so that no foot is
// planted in mid-air. Ends are then fitted (fit_ends). What the rule plants for 200 ms or longer is planted too, but
// for 50 ms at its ends, unless most of it has a keyframe within 0.1: a foot that rests on the ground stands, whatever
// the body does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/footskate/contacts.h"
#include "kinespace/footskate/keyframes.h"

namespace kinespace {

// A keyframe and whether ankle and toe stand.
struct LabelledKeyframe {
  Keyframe keyframe{};
  std::uint8_t planted = 0;  // bit 0: the ankle, bit 1: the toe
};

// A clip with all its contacts known.
struct LabelledClip {
  Clip clip;
  FootContacts contacts;
  FeetNames feet;
};

class ContactModel {
 public:
  // Keyframes in any order.
  explicit ContactModel(std::vector<LabelledKeyframe> keyframes) : keyframes_(std::move(keyframes)) {}

  // The model that comes with the library, learnt from the sample motions (examples/contact_table.cpp writes it):
  // walks, runs, turns, jumps, gestures and stands of bodies of 140, 175 and 205 cm at 30, 60 and 120 Hz.
  [[nodiscard]] static const ContactModel& standard();

  // All keyframes of the clips, thinned: of keyframes nearer than `apart` to one that is kept and with its labels one
  // is enough.
  [[nodiscard]] static ContactModel train(std::span<const LabelledClip> clips, double apart = 0.2);

  // This model with the keyframes of another one added.
  [[nodiscard]] ContactModel with(const ContactModel& more) const;

  [[nodiscard]] FootContacts detect(const FootTracks& tracks, const Ground& ground) const;

  // How far each frame of the clip is from the nearest keyframe, in leg lengths (the larger of both feet): what the
  // labelling loop goes by. Infinite for an empty model.
  [[nodiscard]] std::vector<double> distances(const FootTracks& tracks, const Ground& ground) const;

  // The keyframes as bytes, 16 bits a number, and back. Reading throws Error{bad_input} naming `source`.
  [[nodiscard]] Bytes to_bytes() const;
  [[nodiscard]] static ContactModel from_bytes(std::span<const std::byte> bytes, const std::string& source);

  [[nodiscard]] const std::vector<LabelledKeyframe>& keyframes() const { return keyframes_; }

 private:
  std::vector<LabelledKeyframe> keyframes_;
};

}  // namespace kinespace
