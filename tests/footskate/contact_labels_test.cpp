// Labels as text and in a library.
#include "kinespace/footskate/contact_labels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/footskate/skating.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

TEST(ContactLabels, go_through_text) {
  const SampleMotion walk = make_walk();
  const Feet feet = require_feet(walk.clip);
  const FootContacts contacts = contacts_of(walk, feet);
  const std::string text = format_contacts(contacts, walk.clip.skeleton, feet);
  EXPECT_EQ(parse_contacts(text, "text", walk.clip, feet), contacts);
  EXPECT_EQ(parse_contacts("# none\r\n\n", "text", walk.clip, feet), FootContacts{});
  const FootContacts one = {{1, 3, 9}};
  EXPECT_EQ(parse_contacts("  LeftToeBase\t3 6\r\nLeftToeBase 5 9 # more", "text", walk.clip, feet), one);
}

TEST(ContactLabels, that_are_wrong_name_file_and_line) {
  const Clip clip = make_walk().clip;
  const Feet feet = require_feet(clip);
  for (const char* line :
       {"LeftFoot 3", "LeftFoot 9 3", "LeftFoot -1 3", "LeftFoot 0 99999", "Head 0 3", "LeftFoot 1 2.5", "3 4"}) {
    try {
      (void)parse_contacts("LeftFoot 1 2\n" + std::string(line), "labels.txt", clip, feet);
      FAIL() << line;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("labels.txt:2")) << line;
    }
  }
}

TEST(ContactLabels, are_kept_in_a_library_and_decide_there) {
  const test::TemporaryFolder folder;
  Library library = Library::create(folder / "a.kspace");
  EXPECT_FALSE(library_contact_model(library));
  // A walk that somebody says never touches the ground.
  LabelledClip never{.clip = make_walk({.take = {.seed = 5}}).clip, .contacts = {}, .feet = {}};
  put_contact_labels(library, never);
  ASSERT_EQ(labelled_clips(library), std::vector<std::string>{never.clip.name});
  EXPECT_EQ(contact_labels(library, never.clip.name), FootContacts{});
  EXPECT_FALSE(contact_labels(library, "another"));
  const auto model = library_contact_model(library);
  ASSERT_TRUE(model);
  const FootTracks tracks = foot_tracks(never.clip, require_feet(never.clip));
  const auto planted = [&](const ContactModel& m) {
    int sum = 0;
    for (const FootContact& c : m.detect(tracks, estimate_ground(tracks))) sum += c.last_frame - c.first_frame + 1;
    return sum;
  };
  EXPECT_LT(planted(*model), planted(ContactModel::standard()) / 2);
  // The truth again replaces it.
  never.contacts = ContactModel::standard().detect(tracks, estimate_ground(tracks));
  put_contact_labels(library, never);
  EXPECT_EQ(contact_labels(library, never.clip.name), never.contacts);
  EXPECT_EQ(labelled_clips(library).size(), 1U);
}

TEST(ContactLabels, that_are_damaged_are_an_error) {
  const test::TemporaryFolder folder;
  Library library = Library::create(folder / "a.kspace");
  const std::vector<std::byte> noise(40, std::byte{7});
  library.put_artifact("contact labels", "clip", noise);
  EXPECT_THROW((void)library_contact_model(library), Error);
  library.put_artifact("contact labels", "clip", std::span(noise).first(2));
  EXPECT_THROW((void)contact_labels(library, "clip"), Error);
}

}  // namespace
}  // namespace kinespace
