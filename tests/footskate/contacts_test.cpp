// Contacts against the truth of the sample motions.
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/footskate/skating.h"

namespace kinespace {
namespace {

using test::Agreement;

// Over clips of another seed, height and speed than those learnt from.
class UnseenMotions : public testing::TestWithParam<double> {};

TEST_P(UnseenMotions, contacts_agree_with_the_truth) {
  for (const double height : {155.0, 190.0}) {
    Agreement all;
    for (const SampleMotion& motion : test::unseen_motions(GetParam(), height)) {
      const Feet feet = require_feet(motion.clip);
      const FootTracks tracks = foot_tracks(motion.clip, feet);
      const FootContacts found = ContactModel::standard().detect(tracks, estimate_ground(tracks));
      all.add(found, contacts_of(motion, feet), motion.clip.frames);
    }
    EXPECT_GE(all.f1(), 0.97) << height;
  }
}

TEST_P(UnseenMotions, contacts_are_found_though_the_feet_skate) {
  Agreement all;
  for (const SampleMotion& motion : test::unseen_motions(GetParam())) {
    const Clip clip = test::with_path_scaled(motion.clip, 1.15);
    const Feet feet = require_feet(clip);
    const FootTracks tracks = foot_tracks(clip, feet);
    all.add(ContactModel::standard().detect(tracks, estimate_ground(tracks)), contacts_of(motion, feet), clip.frames);
  }
  EXPECT_GE(all.f1(), 0.95);
}

INSTANTIATE_TEST_SUITE_P(Rates, UnseenMotions, testing::Values(30, 60, 120));

TEST(ContactModel, standard_table_is_what_the_sample_motions_give) {
  std::ifstream file(std::string(KINESPACE_SOURCE_DIR) + "/footskate/standard_contacts.inc");
  const std::string kept{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  ASSERT_FALSE(kept.empty());
  EXPECT_LT(kept.size(), 200000U);
  EXPECT_TRUE(kept == standard_contact_table()) << "run kinespace-contact-table footskate/standard_contacts.inc";
}

TEST(ContactModel, goes_through_bytes_and_refuses_what_is_damaged) {
  const Bytes bytes = ContactModel::standard().to_bytes();
  const ContactModel back = ContactModel::from_bytes(bytes, "test");
  ASSERT_EQ(back.keyframes().size(), ContactModel::standard().keyframes().size());
  EXPECT_EQ(back.to_bytes(), bytes);
  for (const std::size_t size : {std::size_t{0}, std::size_t{3}, std::size_t{50}, bytes.size() - 1}) {
    EXPECT_THROW((void)ContactModel::from_bytes(std::span(bytes).first(size), "test"), Error) << size;
  }
}

TEST(ContactModel, learns_what_it_is_told) {
  // Everything planted never: a model of only this clip finds nothing in it.
  const Clip clip = make_walk().clip;
  const ContactModel never = ContactModel::train(std::vector<LabelledClip>{{clip, {}, {}}});
  const FootTracks tracks = foot_tracks(clip, require_feet(clip));
  EXPECT_TRUE(never.detect(tracks, estimate_ground(tracks)).empty());
  EXPECT_FALSE(ContactModel::standard().detect(tracks, estimate_ground(tracks)).empty());
}

TEST(ContactModel, distances_are_small_where_it_was_taught_and_infinite_without_keyframes) {
  const Clip clip = make_walk({.speed_m_s = 1.7, .take = {.seed = 99}}).clip;
  const FootTracks tracks = foot_tracks(clip, require_feet(clip));
  const Ground ground = estimate_ground(tracks);
  const ContactModel taught = ContactModel::train(std::vector<LabelledClip>{{clip, {}, {}}}, 0.05);
  for (const double d : taught.distances(tracks, ground)) EXPECT_LT(d, 0.051);
  for (const double d : ContactModel({}).distances(tracks, ground)) EXPECT_TRUE(std::isinf(d));
}

TEST(Contacts, none_in_a_flight) {
  // The middle of a jump: nothing touches.
  const SampleMotion jump = make_jump({.rise_cm = 40});
  const Feet feet = require_feet(jump.clip);
  int first = jump.clip.frames;
  int last = 0;
  const FootContacts truth = contacts_of(jump, feet);
  std::vector<char> down(jump.clip.frames, 0);
  for (int slot = 0; slot < 4; ++slot) {
    const auto planted = planted_frames(truth, slot, jump.clip.frames);
    for (int f = 0; f < jump.clip.frames; ++f) down[f] = static_cast<char>(down[f] | planted[f]);
  }
  for (int f = 0; f < jump.clip.frames; ++f) {
    if (down[f] != 0) continue;
    first = std::min(first, f);
    last = std::max(last, f);
  }
  ASSERT_GT(last - first, 10);
  const Clip flight = slice(jump.clip, first + 3, last - first - 6);
  const FootTracks tracks = foot_tracks(flight, feet);
  EXPECT_TRUE(ContactModel::standard().detect(tracks, Ground{}).empty());
}

TEST(Contacts, by_the_rule_agree_on_clean_walks) {
  Agreement all;
  for (const SampleMotion& motion : test::unseen_motions()) {
    if (motion.labels.front() == "run") continue;
    const Feet feet = require_feet(motion.clip);
    const FootTracks tracks = foot_tracks(motion.clip, feet);
    all.add(contacts_by_rule(tracks, estimate_ground(tracks)), contacts_of(motion, feet), motion.clip.frames);
  }
  EXPECT_GE(all.f1(), 0.97);
}

TEST(Contacts, ends_are_moved_to_where_the_joint_leaves) {
  const SampleMotion walk = make_walk({.take = {.rate_hz = 60, .variation = 0}});
  const Feet feet = require_feet(walk.clip);
  const FootTracks tracks = foot_tracks(walk.clip, feet);
  for (const FootContact& truth : contacts_of(walk, feet)) {
    if (truth.first_frame < 6 || truth.last_frame + 7 > walk.clip.frames) continue;
    for (const int off : {-4, 0, 4}) {
      const FootContacts fitted = fit_ends(tracks, {{truth.slot, truth.first_frame - off, truth.last_frame + off}});
      ASSERT_EQ(fitted.size(), 1U);
      EXPECT_NEAR(fitted[0].first_frame, truth.first_frame, 2);
      EXPECT_NEAR(fitted[0].last_frame, truth.last_frame, 2);
    }
  }
}

}  // namespace
}  // namespace kinespace
