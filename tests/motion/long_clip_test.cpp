// A clip of a million frames: its text is read once, front to back, and costs memory in proportion to it. All counted:
// what a machine makes of it is its own affair.
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/motion/amc.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/detail/bvh_hierarchy.h"
#include "tests/motion/sample_clips.h"
#include "tests/motion/watched_text.h"
#include "tests/support/allocation_meter.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

std::string long_bvh(int frames) {
  std::string text =
      "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
      "JOINT b\n{\nOFFSET 0 10 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n}\n}\nMOTION\nFrames: " +
      std::to_string(frames) + "\nFrame Time: 0.008333\n";
  for (int f = 0; f < frames; ++f) {
    const std::string whole = std::to_string(f % 1000);
    text.append(whole)
        .append(".25 91.5 0 ")
        .append(whole)
        .append(".125 -2.5 30.0625 10 ")
        .append(whole)
        .append(" -7\n");
  }
  return text;
}

std::string long_amc(int frames) {
  std::string text = ":FULLY-SPECIFIED\n:DEGREES\n";
  for (int f = 0; f < frames; ++f) {
    const std::string whole = std::to_string(f % 1000);
    text.append(std::to_string(f + 1)).append("\nroot 0 ").append(whole).append(".5 0 10 -20.25 ").append(whole);
    text.append("\nfemur 5 -6 7.5\ntibia ").append(whole).append("\n");
  }
  return text;
}

// What reading one text takes.
struct Reading {
  Clip clip;
  std::size_t peak_bytes = 0;
  std::size_t all_bytes = 0;
  std::size_t pieces = 0;
};

template <typename Parse>
Reading measured(const std::string& text, const Parse& parse) {
  const AllocationMeter meter;
  Reading reading;
  reading.clip = parse(text);
  reading.peak_bytes = meter.peak();
  reading.all_bytes = meter.all_bytes();
  reading.pieces = meter.pieces();
  return reading;
}

// Twice the frames may take twice the bytes (a vector that grows by doubling takes up to thrice) and hardly a piece
// more; whatever is copied or kept anew for each frame takes more. And the text is gone over `passes` times.
template <typename Parse>
Clip expect_work_in_proportion(const std::string& half, const std::string& whole, std::size_t passes,
                               const Parse& parse) {
  const Reading of_half = measured(half, parse);
  Reading of_whole = measured(whole, parse);
  if (AllocationMeter::counts()) {
    EXPECT_LT(of_whole.peak_bytes, 4 * whole.size());
    EXPECT_LT(of_whole.all_bytes, 3 * of_half.all_bytes);
    EXPECT_LE(of_whole.pieces, of_half.pieces + 16);
  }
  const WatchedText watched(whole);
  static_cast<void>(parse(watched.text()));
  EXPECT_LE(watched.opened(), passes * watched.parts() + 8);
  return std::move(of_whole.clip);
}

TEST(LongClip, a_bvh_of_a_million_frames_is_read_once_with_memory_in_proportion) {
  const Clip clip = expect_work_in_proportion(long_bvh(500'000), long_bvh(1'000'000), 1,
                                              [](std::string_view text) { return parse_bvh(text, "long.bvh"); });
  EXPECT_EQ(clip.frames, 1'000'000);
  EXPECT_EQ(clip.rate_hz, 120);
  EXPECT_EQ(clip.translation(0, 999'999).x(), 999.25);
}

TEST(LongClip, an_amc_of_a_million_frames_is_counted_and_read_with_memory_in_proportion) {
  const Asf asf = parse_asf(small_asf, "t.asf");
  const Clip clip = expect_work_in_proportion(long_amc(500'000), long_amc(1'000'000), 2,
                                              [&](std::string_view text) { return parse_amc(text, asf, "long.amc"); });
  EXPECT_EQ(clip.frames, 1'000'000);
}

// What reading comes to: the clip, or the error.
std::string outcome(const std::function<Clip()>& read) {
  try {
    const Clip clip = read();
    const auto bytes = std::as_bytes(std::span(clip.rotations));
    std::string out = std::to_string(clip.frames) + " frames " + content_hash(bytes);
    for (const auto& track : clip.translations) out += ' ' + content_hash(std::as_bytes(std::span(track.values)));
    return out;
  } catch (const Error& error) {
    return error.what();
  }
}

// Reading through windows of these sizes comes to what reading the text does, errors and their lines included.
void expect_as_text(const std::filesystem::path& path, const std::string& content, std::size_t least,
                    std::size_t most) {
  write_file_atomically(path, content);
  const std::string expected = outcome([&] { return parse_bvh(content, path.string()); });
  for (std::size_t window = least; window <= most; ++window) {
    EXPECT_EQ(outcome([&] {
                TextSource source(path, window);
                return std::move(parse_bvh(source, {}).front());
              }),
              expected)
        << window;
  }
}

TEST(LongClip, windows_of_any_size_show_the_same_text) {
  const TemporaryFolder folder;
  const std::string text = long_bvh(20);
  const std::size_t head = text.find("0.25 91.5");
  std::vector<std::string> texts = {text};
  for (const std::string end : {"\r\n", "\r", "\n\n", " \n", "\r\n\r\n"}) {
    std::string other = text.substr(0, head);
    for (const char c : text.substr(head)) c == '\n' ? other += end : other += c;
    texts.push_back(other);
  }
  std::string wide = text;
  wide.insert(text.find(' ', head + 300), std::string(500, ' '));
  texts.push_back(wide);
  for (const std::string& content : texts) {
    expect_as_text(folder / "a.bvh", content, head, head + 200);
    for (const char* count : {"Frames: 19", "Frames: 21", "Frames: 9"}) {
      expect_as_text(folder / "a.bvh", replaced(content, "Frames: 20", count), head, head + 100);
    }
    std::string broken = content;
    broken[content.size() - 40] = 'x';
    expect_as_text(folder / "a.bvh", broken, head, head + 100);
    expect_as_text(folder / "a.bvh", content.substr(0, content.size() - 30), head, head + 100);
  }
}

TEST(LongClip, what_stands_before_the_frames_must_fit_a_window) {
  const TemporaryFolder folder;
  const std::string text = long_bvh(20);
  write_file_atomically(folder / "a.bvh", text);
  const std::size_t head = text.find("\n0.25 91.5");
  for (std::size_t window = 1; window <= head; ++window) {
    EXPECT_THAT(outcome([&] {
                  TextSource source(folder / "a.bvh", window);
                  return std::move(parse_bvh(source, {}).front());
                }),
                testing::HasSubstr("bytes before the first frame"))
        << window;
  }
}

TEST(LongClip, a_long_file_is_what_its_text_is) {
  const TemporaryFolder folder;
  const std::string path = folder / "long.bvh";
  const std::string text = long_bvh(900'000);
  ASSERT_GT(text.size(), 30'000'000U) << "more than one window";
  std::string blank = text;
  blank.insert(text.find('\n', text.size() / 2), std::string(40'000'000, '\n'));
  std::string broken = text;
  broken[text.size() - 40] = 'x';
  for (const std::string& content :
       {text, blank, broken, text.substr(0, text.size() * 3 / 4), replaced(text, "Frames: 900000", "Frames: 899998"),
        replaced(text, "Frames: 900000", "Frames: 2000000000")}) {
    write_file_atomically(path, content);
    EXPECT_EQ(outcome([&] { return read_bvh(path); }), outcome([&] { return parse_bvh(content, path); }));
  }
}

TEST(LongClip, a_file_costs_the_memory_of_its_numbers_and_a_window) {
  const TemporaryFolder folder;
  const std::string path = folder / "long.bvh";
  write_file_atomically(path, long_bvh(1'000'000));
  const AllocationMeter meter;
  const Clip clip = read_bvh(path);
  const std::size_t numbers = sizeof(double) * (clip.rotations.size() + 3 * static_cast<std::size_t>(clip.frames));
  EXPECT_LT(meter.peak(), numbers + (20 << 20));

  const AllocationMeter writing;
  write_bvh(folder / "again.bvh", clip);
  EXPECT_LT(writing.peak(), 1 << 20);
}

TEST(LongClip, a_text_that_is_gone_over_again_is_noticed) {
  const std::string text(std::size_t{1} << 20, 'x');
  const WatchedText watched(text);
  for (const int times : {1, 2, 3}) {
    EXPECT_EQ(std::count(watched.text().begin(), watched.text().end(), 'x'), std::ssize(text));
    EXPECT_EQ(watched.opened(), static_cast<std::size_t>(times) * watched.parts());
  }
}

TEST(LongClip, a_constant_joint_costs_no_track) {
  std::string text =
      "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
      "JOINT b\n{\nOFFSET 0 10 0\nCHANNELS 3 Xposition Yposition Zposition\n}\n}\nMOTION\nFrames: 1000\nFrame Time: "
      "1\n";
  for (int f = 0; f < 1000; ++f) text += (f < 999 ? "0 0 0" : "0 0 1") + std::string(" 10 4 -7\n");
  const Clip clip = parse_bvh(text, "t.bvh");
  ASSERT_EQ(clip.translations.size(), 1u);
  EXPECT_EQ(clip.translations[0].joint, 0);
  EXPECT_EQ(clip.translation(0, 998).z(), 0);
  EXPECT_EQ(clip.translation(0, 999).z(), 1);
  EXPECT_EQ(clip.skeleton.joints[1].offset, Eigen::Vector3d(10, 4, -7));
}

}  // namespace
}  // namespace kinespace::test
