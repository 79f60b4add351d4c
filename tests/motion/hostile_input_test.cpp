// Damaged files: every one is an error with a place in it, or a valid clip; never a crash, a hang or much memory.
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "kinespace/motion/amc.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/kinematics.h"
#include "tests/motion/sample_clips.h"
#include "tests/support/allocation_meter.h"

namespace kinespace::test {
namespace {

using Parse = Clip (*)(std::string_view);

Clip parse_as_bvh(std::string_view text) {
  return parse_bvh(text, "h.bvh", {.strict = true});
}
Clip parse_as_mended_bvh(std::string_view text) {
  return parse_bvh(text, "h.bvh");
}
Clip parse_as_asf(std::string_view text) {
  return parse_amc(small_amc, parse_asf(text, "h.asf"), "h.amc");
}
Clip parse_as_amc(std::string_view text) {
  return parse_amc(text, parse_asf(small_asf, "h.asf"), "h.amc");
}

// What the text turned out to be; anything else than a clip or a good message fails the test.
enum class Outcome { clip, error };

Outcome outcome_of(Parse parse, const std::string& text) {
  try {
    const Clip clip = parse(text);
    EXPECT_EQ(what_is_wrong_with(clip), "");
    for (const auto& position : joint_positions(clip).values) EXPECT_TRUE(position.allFinite());
    return Outcome::clip;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_FALSE(error.details().file.empty());
    EXPECT_GE(error.details().line, 1);
    EXPECT_FALSE(error.details().found.empty() || error.details().expected.empty()) << error.what();
    return Outcome::error;
  }
}

struct Case {
  const char* name;
  std::string_view text;
  Parse parse;
};
class HostileInput : public testing::TestWithParam<Case> {};

TEST_P(HostileInput, every_prefix_is_an_error_or_a_valid_clip) {
  const auto& [name, text, parse] = GetParam();
  int clips = 0;
  for (std::size_t length = 0; length < text.size(); ++length) {
    SCOPED_TRACE(length);
    if (outcome_of(parse, std::string(text.substr(0, length))) == Outcome::clip) ++clips;
    if (HasFailure()) return;
  }
  EXPECT_GE(clips, 1) << "without the last newline it is a clip";
  // Only a cut in the last word or behind it can go unseen; an AMC may also end behind its first frame, a BVH that may be
  // mended within any frame but the first.
  if (parse != parse_as_mended_bvh) {
    EXPECT_LE(clips, 20);
  }
}

TEST_P(HostileInput, every_flipped_bit_is_an_error_or_a_valid_clip) {
  const auto& [name, text, parse] = GetParam();
  std::string damaged(text);
  for (std::size_t at = 0; at < text.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      SCOPED_TRACE(testing::Message() << at << " bit " << bit);
      damaged[at] = static_cast<char>(static_cast<unsigned char>(text[at]) ^ (1U << bit));
      outcome_of(parse, damaged);
      if (HasFailure()) return;
    }
    damaged[at] = text[at];
  }
}

TEST_P(HostileInput, every_byte_left_out_or_doubled_is_an_error_or_a_valid_clip) {
  const auto& [name, text, parse] = GetParam();
  for (std::size_t at = 0; at < text.size(); ++at) {
    SCOPED_TRACE(at);
    outcome_of(parse, std::string(text.substr(0, at)) + std::string(text.substr(at + 1)));
    outcome_of(parse, std::string(text.substr(0, at + 1)) + std::string(text.substr(at)));
    if (HasFailure()) return;
  }
}

// One random edit of the kind that finds bugs in parsers.
void mutate(std::string& text, std::mt19937& random) {
  static constexpr std::string_view words[] = {"{",
                                               "}",
                                               "\n",
                                               "\r",
                                               " ",
                                               "-",
                                               "nan",
                                               "1e308",
                                               "-1e-308",
                                               "99999999999999999999",
                                               "0",
                                               "CHANNELS 6",
                                               "JOINT x",
                                               "End Site",
                                               "Frames: 2147483647",
                                               "OFFSET",
                                               "begin",
                                               "end",
                                               "dof rx ry rz tx ty tz",
                                               "root",
                                               "hip",
                                               ":bonedata\n",
                                               ":hierarchy\n",
                                               "#",
                                               "(",
                                               "\0x",
                                               "1e",
                                               "+",
                                               ".",
                                               "\xff\xfe"};
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
  const std::size_t at = below(text.size() + 1);
  const std::size_t length = std::min<std::size_t>(below(random() % 2 == 0 ? 4 : 200), text.size() - at);
  switch (random() % 6) {
    case 0:
      if (at < text.size()) text[at] = static_cast<char>(random());
      break;
    case 1:
      text.erase(at, length);
      break;
    case 2:
      text.insert(at, text.substr(below(text.size() + 1), length));
      break;
    case 3:
      text.insert(at, words[below(std::size(words))]);
      break;
    case 4:
      text.replace(at, length, words[below(std::size(words))]);
      break;
    default:
      text.resize(at);
      break;
  }
}

TEST_P(HostileInput, random_edits_make_an_error_or_a_valid_clip_in_bounded_memory) {
  const auto& [name, text, parse] = GetParam();
  std::mt19937 random(20240607);
  int clips = 0;
  for (int i = 0; i < 30000; ++i) {
    SCOPED_TRACE(i);
    std::string damaged(text);
    for (auto edits = 1 + random() % 4; edits > 0; --edits) mutate(damaged, random);
    const AllocationMeter meter;
    if (outcome_of(parse, damaged) == Outcome::clip) ++clips;
    ASSERT_LT(meter.peak(), 1u << 20) << damaged;
    if (HasFailure()) return;
  }
  EXPECT_GT(clips, 30) << "edits that leave nothing to parse test nothing";
}

INSTANTIATE_TEST_SUITE_P(Formats, HostileInput,
                         testing::Values(Case{"bvh", small_bvh, parse_as_bvh},
                                         Case{"mended_bvh", small_bvh, parse_as_mended_bvh},
                                         Case{"asf", small_asf, parse_as_asf}, Case{"amc", small_amc, parse_as_amc}),
                         [](const auto& suite) { return suite.param.name; });

}  // namespace
}  // namespace kinespace::test
