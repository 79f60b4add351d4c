#include "kinespace/footskate/kept_feet.h"

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/base/error.h"
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/motion/curves.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

Clip turned_walk() {
  return make_walk({.speed_m_s = 1.3, .take = {.heading_deg = 70}}).clip;
}

KeptFeet feet_of(const Clip& clip) {
  return keep_feet(clip, clip_curves(clip).placement).value();
}

TEST(KeptFeet, hold_every_contact_where_the_joint_was) {
  const Clip clip = turned_walk();
  const Placement placement = clip_curves(clip).placement;
  const KeptFeet feet = feet_of(clip);
  ASSERT_GE(feet.contacts.size(), 6U);
  const FootTracks tracks = foot_tracks(clip, require_feet(clip));
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(placement.heading_rad, Eigen::Vector3d::UnitY()));
  for (const KeptContact& c : feet.contacts) {
    for (const KeptPlace& p : c.places) {
      const Eigen::Vector3d world = placement.start_cm + turn * p.place;
      EXPECT_LT((world - tracks.at[c.slot][p.frame]).norm(), 1e-6);
    }
  }
  EXPECT_EQ(feet.slide_cm_s, foot_slide_cm_s(tracks, feet.frames()).value());
}

TEST(KeptFeet, are_some_bytes_a_contact_and_come_back_to_half_a_millimetre) {
  const Clip clip = turned_walk();
  const KeptFeet feet = feet_of(clip);
  const Bytes bytes = pack_feet(feet);
  EXPECT_LT(bytes.size(), 50 + 24 * feet.contacts.size());
  const KeptFeet back = unpack_feet(bytes, clip.frames, clip.skeleton, "here");
  EXPECT_EQ(back.frames(), feet.frames());
  for (std::size_t i = 0; i < feet.contacts.size(); ++i) {
    ASSERT_EQ(back.contacts[i].places.size(), feet.contacts[i].places.size());
    for (std::size_t p = 0; p < feet.contacts[i].places.size(); ++p) {
      EXPECT_LT((back.contacts[i].places[p].place - feet.contacts[i].places[p].place).norm(), 0.05);
    }
  }
  EXPECT_EQ(pack_feet(back), bytes);
}

TEST(KeptFeet, nothing_is_kept_where_nothing_can_be_told) {
  const Clip slow = make_walk({.take = {.rate_hz = 12}}).clip;
  EXPECT_FALSE(keep_feet(slow, {}));
  Skeleton chair;
  chair.joints = {Joint{.name = "seat", .parent = -1, .channels = {Channel::x_rotation}}};
  EXPECT_FALSE(keep_feet(make_clip("chair", chair, 60, 100), {}));
  EXPECT_FALSE(keep_feet(make_clip("one frame", sample_skeleton(), 60, 1), {}));
}

TEST(KeptFeet, damage_is_refused) {
  const Clip clip = turned_walk();
  const Bytes good = pack_feet(feet_of(clip));
  const auto read = [&](const Bytes& bytes) { return unpack_feet(bytes, clip.frames, clip.skeleton, "here"); };
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_THROW(static_cast<void>(read(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)))), Error)
        << size;
  }
  Bytes longer = good;
  longer.push_back(std::byte{0});
  EXPECT_THROW(static_cast<void>(read(longer)), Error);
  // Any byte may be any other: what is read then is sound, or nothing is.
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (const int value : {0, 1, 0x7f, 0x80, 0xff}) {
      Bytes damaged = good;
      damaged[at] = static_cast<std::byte>(value);
      try {
        for (const KeptContact& c : read(damaged).contacts) {
          EXPECT_LT(c.last_frame(), clip.frames);
          EXPECT_GT(c.last_frame(), c.first_frame());
        }
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      }
    }
  }
}

TEST(KeptFeet, hostile_counts_take_no_memory) {
  const Clip clip = turned_walk();
  const Bytes good = pack_feet(feet_of(clip));
  ByteWriter out;
  out.put_bytes(std::span(good).first(4 + 3 + 4 + 3 + 16));  // legs, axes, floor and slide
  put_varint(out, std::uint64_t{1} << 62);
  EXPECT_THROW(static_cast<void>(unpack_feet(out.bytes(), clip.frames, clip.skeleton, "here")), Error);
  ByteWriter places;
  places.put_bytes(std::span(good).first(4 + 3 + 4 + 3 + 16));
  put_varint(places, 1);
  put_varint(places, std::uint64_t{1} << 62);
  for (int i = 0; i < 20; ++i) places.put(std::uint8_t{0});
  EXPECT_THROW(static_cast<void>(unpack_feet(places.bytes(), clip.frames, clip.skeleton, "here")), Error);
}

}  // namespace
}  // namespace kinespace
