// encode and decode as a user runs them, on the sample clips.
#include <cmath>
#include <filesystem>
#include <memory>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "kinespace/codecs/registry.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/cli/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;

class CodecCommands : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    write_sample_clips(*folder_ / "clips");
    write_text(*folder_ / "other.bvh", walking_bvh(200, 1));
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string at(const std::string& name) { return (*folder_ / name.c_str()).string(); }
  static std::string clip(const std::string& name) { return at("clips/" + name + ".bvh"); }

  static json run(const std::vector<std::string>& arguments) {
    std::vector<std::string> all = arguments;
    all.emplace_back("--json");
    const CommandResult result = run_command(all);
    EXPECT_EQ(result.code, 0) << result.err;
    return result.code == 0 ? json::parse(result.out) : json::object();
  }
  // The message of a run that must fail.
  static std::string fails(const std::vector<std::string>& arguments, int code) {
    const CommandResult result = run_command(arguments);
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    return result.err;
  }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> CodecCommands::folder_;

TEST_F(CodecCommands, every_codec_brings_a_clip_there_and_back) {
  for (const Codec* codec : all_codecs()) {
    const std::string name(codec->name());
    const json encoded = run({"encode", clip("walk_normal_001"), "-o", at(name + ".ksm"), "--codec", name});
    for (const char* key : {"codec", "clips", "frames", "bytes", "bytes_per_frame", "ratio", "mean_joint_error_cm",
                            "max_joint_error_cm", "shell_error_cm", "encode_frames_per_s"}) {
      EXPECT_TRUE(encoded.contains(key)) << name << " " << key;
    }
    EXPECT_EQ(encoded["codec"], name);
    EXPECT_EQ(encoded["bytes"], std::filesystem::file_size(at(name + ".ksm")));
    const json decoded = run({"decode", at(name + ".ksm"), "-o", at(name + ".bvh")});
    EXPECT_EQ(decoded["frames"], encoded["frames"]);
    const MotionError error = compare(read_clip(clip("walk_normal_001")), read_clip(at(name + ".bvh")));
    // What the header says, but for the text's rounding.
    EXPECT_NEAR(error.mean_joint_error_cm, encoded["mean_joint_error_cm"], 1e-3) << name;
    EXPECT_LE(error.max_joint_error_cm, encoded["max_joint_error_cm"].get<double>() + 1e-3) << name;
  }
}

TEST_F(CodecCommands, targets_are_kept_to) {
  EXPECT_LE(run({"encode", at("clips"), "-o", at("t.ksm"), "--error", "0.4"})["mean_joint_error_cm"], 0.4);
  EXPECT_LE(run({"encode", at("clips"), "-o", at("t.ksm"), "--max-error", "2"})["max_joint_error_cm"], 2);
  EXPECT_LE(run({"encode", at("clips"), "-o", at("t.ksm"), "--bytes", "9000"})["bytes"], 9000);
  EXPECT_NE(fails({"encode", at("clips"), "-o", at("t2.ksm"), "--bytes", "60"}, 2).find("60 bytes"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(at("t2.ksm")));
}

TEST_F(CodecCommands, a_clip_a_time_range_and_a_level_come_out_alone) {
  run({"encode", at("clips"), "-o", at("all.ksm"), "--error", "0.3"});
  run({"decode", at("all.ksm"), "-o", at("one.bvh"), "--clip", "run_fast_001"});
  run({"decode", at("all.ksm"), "-o", at("part.bvh"), "--clip", "run_fast_001", "--from", "0.5", "--to", "1"});
  const Clip whole = read_clip(at("one.bvh"));
  const Clip part = read_clip(at("part.bvh"));
  const int first = static_cast<int>(std::lround(0.5 * whole.rate_hz));
  EXPECT_EQ(part.frames, static_cast<int>(std::lround(0.5 * whole.rate_hz)) + 1);
  EXPECT_LT(compare(slice(whole, first, part.frames), part).max_joint_error_cm, 1e-3);
  run({"decode", at("all.ksm"), "-o", at("coarse.bvh"), "--clip", "run_fast_001", "--level", "2"});
  EXPECT_GT(compare(read_clip(clip("run_fast_001")), read_clip(at("coarse.bvh"))).mean_joint_error_cm, 0.3);
}

TEST_F(CodecCommands, a_basis_from_a_library_makes_the_stream_of_a_clip_small) {
  ASSERT_EQ(run_command({"build", at("clips"), "-o", at("sample.kspace")}).code, 0);
  const json alone = run({"encode", clip("walk_normal_001"), "-o", at("alone.ksm"), "--error", "0.3"});
  const std::vector<std::string> encode{"encode",  clip("walk_normal_001"), "-o", at("with.ksm"), "--error", "0.3",
                                        "--basis", at("sample.kspace")};
  const json with = run(encode);
  EXPECT_LE(with["mean_joint_error_cm"], 0.3);
  EXPECT_LT(with["bytes"].get<double>(), 0.6 * alone["bytes"].get<double>());
  // The basis stays in the library, so that the same clip gives the same bytes.
  const std::string bytes = read_text(at("with.ksm"));
  EXPECT_EQ(run(encode)["bytes"], with["bytes"]);
  EXPECT_EQ(read_text(at("with.ksm")), bytes);

  run({"decode", at("with.ksm"), "-o", at("with.bvh"), "--basis", at("sample.kspace")});
  EXPECT_LE(compare(read_clip(clip("walk_normal_001")), read_clip(at("with.bvh"))).mean_joint_error_cm, 0.301);

  EXPECT_NE(fails({"decode", at("with.ksm"), "-o", at("x.bvh")}, 2).find("--basis"), std::string::npos);
  write_text(at("clips2.bvh"), read_text(clip("run_fast_001")));
  ASSERT_EQ(run_command({"build", at("clips2.bvh"), "-o", at("another.kspace")}).code, 0);
  EXPECT_NE(fails({"decode", at("with.ksm"), "-o", at("x.bvh"), "--basis", at("another.kspace")}, 2).find("basis"),
            std::string::npos);
  EXPECT_NE(fails({"encode", at("other.bvh"), "-o", at("y.ksm"), "--basis", at("sample.kspace")}, 2).find("no clips"),
            std::string::npos);
  EXPECT_NE(
      fails({"encode", clip("walk_normal_001"), "-o", at("y.ksm"), "--codec", "pca", "--basis", at("sample.kspace")}, 2)
          .find("basis"),
      std::string::npos);
}

TEST_F(CodecCommands, wrong_use_is_told_in_one_line) {
  EXPECT_NE(fails({"encode", clip("walk_normal_001"), at("other.bvh"), "-o", at("y.ksm")}, 2).find("another tree"),
            std::string::npos);
  EXPECT_NE(fails({"encode", clip("walk_normal_001"), "-o", at("y.ksm"), "--set", "stop=2"}, 2).find("stop"),
            std::string::npos);
  EXPECT_NE(fails({"encode", clip("walk_normal_001"), "-o", at("y.ksm"), "--set", "step"}, 2).find("NAME=VALUE"),
            std::string::npos);
  fails({"encode", clip("walk_normal_001"), "-o", at("y.ksm"), "--error", "1", "--bytes", "500"}, 2);
  fails({"encode", clip("walk_normal_001"), "-o", at("y.ksm"), "--codec", "zip"}, 2);
  EXPECT_NE(fails({"decode", clip("walk_normal_001"), "-o", at("y")}, 1).find("walk_normal_001.bvh"),
            std::string::npos);
  run({"encode", clip("walk_normal_001"), "-o", at("good.ksm")});
  EXPECT_NE(fails({"decode", at("good.ksm"), "-o", at("y"), "--clip", "nobody"}, 2).find("nobody"), std::string::npos);
  EXPECT_NE(fails({"decode", at("good.ksm"), "-o", at("y"), "--from", "90"}, 2).find("90"), std::string::npos);
  const std::string text = read_text(at("good.ksm"));
  write_text(at("bad.ksm"), text.substr(0, text.size() / 4));
  EXPECT_NE(fails({"decode", at("bad.ksm"), "-o", at("y")}, 1).find("bad.ksm"), std::string::npos);
}

}  // namespace
}  // namespace kinespace::test
