// Joint freedoms found from motion, and clips as channels of them.
#include "kinespace/codecs/stream/joint_channels.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/stream/pose_vectors.h"
#include "kinespace/motion/amc.h"
#include "kinespace/motion/curves.h"
#include "kinespace/motion/read.h"
#include "tests/codecs/sample_stream.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::data_folder;

constexpr double degree = std::numbers::pi / 180;

double apart_degrees(const Quaterniond& a, const Quaterniond& b) {
  return 2 * std::asin(std::min(1.0, (a.conjugate() * b).vec().norm())) / degree;
}

// A root and one joint below it.
Skeleton two_joints() {
  const std::vector<Channel> turns{Channel::z_rotation, Channel::y_rotation, Channel::x_rotation};
  Skeleton out;
  Joint root{.name = "root", .parent = -1, .channels = turns};
  root.channels.insert(root.channels.begin(), {Channel::x_position, Channel::y_position, Channel::z_position});
  out.joints = {root, Joint{.name = "knee", .parent = 0, .offset = {0, -40, 0}, .channels = turns}};
  return out;
}

class RandomJoints {
 public:
  explicit RandomJoints(unsigned seed) : random_(seed) {}
  Quaterniond rotation() {
    return Quaterniond(normal_(random_), normal_(random_), normal_(random_), normal_(random_)).normalized();
  }
  // A smooth curve of that many degrees.
  std::vector<double> curve(int frames, double degrees) {
    std::vector<double> out(static_cast<std::size_t>(frames));
    const double a = phase_(random_), b = phase_(random_);
    for (int f = 0; f < frames; ++f) {
      out[static_cast<std::size_t>(f)] = degrees * (std::sin(a + 0.05 * f) + 0.4 * std::sin(b + 0.13 * f));
    }
    return out;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> phase_{0, 6.28};
};

Clip clip_of(const std::vector<Quaterniond>& knee) {
  Clip out = make_clip("made", two_joints(), 60, static_cast<int>(knee.size()));
  for (int f = 0; f < out.frames; ++f) {
    out.set_rotation(1, f, knee[static_cast<std::size_t>(f)]);
    out.set_rotation(0, f, Quaterniond(AngleAxisd(0.01 * f, Vector3d::UnitY())));
  }
  return out;
}

// Through the channels and a packed layout.
Clip round_trip(const Clip& clip, const ChannelLayout& found) {
  const ChannelLayout layout = unpack_layout(pack_layout(found), clip.skeleton, "packed");
  const ChannelCurves curves = channel_curves(clip, layout);
  Clip out = make_clip(clip.name, clip.skeleton, clip.rate_hz, clip.frames);
  for (const SideTrack& track : clip_curves(clip).side_tracks) apply_side_track(track, 0, out);
  write_channels(layout, curves.values, 0, clip.frames, out);
  return out;
}

double largest_turn_apart(const Clip& a, const Clip& b) {
  double out = 0;
  for (int j = 0; j < a.skeleton.joint_count(); ++j) {
    for (int f = 0; f < a.frames; ++f)
      out = std::max(out, apart_degrees(a.rotation(j, f).normalized(), b.rotation(j, f)));
  }
  return out;
}

double largest_step(const ChannelCurves& curves) {
  double out = 0;
  for (std::size_t c = 3; c * static_cast<std::size_t>(curves.frames) < curves.values.size(); ++c) {
    const auto channel = curves.channel(static_cast<int>(c));
    for (std::size_t f = 1; f < channel.size(); ++f) out = std::max(out, std::abs(channel[f] - channel[f - 1]));
  }
  return out;
}

TEST(JointChannels, a_hinge_about_any_axis_has_one_channel) {
  RandomJoints random(1);
  for (const double swing : {0.3, 5.0, 60.0, 300.0}) {
    const Quaterniond before = random.rotation(), after = random.rotation();
    std::vector<Quaterniond> knee;
    for (const double a : random.curve(200, swing))
      knee.push_back(before * AngleAxisd(a * degree, Vector3d::UnitX()) * after);
    const Clip clip = clip_of(knee);
    const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
    EXPECT_EQ(layout.joints[1].turns, 1) << swing;
    EXPECT_EQ(layout.channel_count(), 7);
    EXPECT_LT(largest_turn_apart(clip, round_trip(clip, layout)), 1e-3);
    const ChannelCurves curves = channel_curves(clip, layout);
    const auto [least, most] = std::ranges::minmax(curves.channel(6));
    const auto expected = std::ranges::minmax(RandomJoints(7).curve(200, 1));
    EXPECT_GT(most - least, 1.5 * swing * (expected.max - expected.min) / 4);
  }
}

TEST(JointChannels, a_universal_joint_of_any_axes_has_two_channels) {
  RandomJoints random(2);
  for (const double middle : {0.0, 20.0, -35.0}) {
    const Quaterniond before = random.rotation(), after = random.rotation();
    const auto a = random.curve(300, 30), c = random.curve(300, 50);
    std::vector<Quaterniond> knee;
    for (std::size_t f = 0; f < a.size(); ++f) {
      knee.push_back(before * AngleAxisd(a[f] * degree, Vector3d::UnitZ()) *
                     AngleAxisd(middle * degree, Vector3d::UnitY()) * AngleAxisd(c[f] * degree, Vector3d::UnitX()) *
                     after);
    }
    const Clip clip = clip_of(knee);
    const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
    EXPECT_EQ(layout.joints[1].turns, 2) << middle;
    EXPECT_LT(largest_turn_apart(clip, round_trip(clip, layout)), 1e-3);
  }
}

TEST(JointChannels, a_joint_that_never_turns_has_no_channel_and_keeps_its_pose) {
  RandomJoints random(3);
  const Clip clip = clip_of(std::vector<Quaterniond>(50, random.rotation()));
  const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
  EXPECT_EQ(layout.joints[1].turns, 0);
  EXPECT_LT(largest_turn_apart(clip, round_trip(clip, layout)), 1e-3);
}

TEST(JointChannels, a_joint_whose_one_frame_leaves_its_axis_gets_all_turns) {
  RandomJoints random(4);
  std::vector<Quaterniond> knee;
  for (const double a : random.curve(200, 40)) knee.push_back(Quaterniond(AngleAxisd(a * degree, Vector3d::UnitX())));
  knee[77] = knee[77] * AngleAxisd(0.5 * degree, Vector3d::UnitY()) * AngleAxisd(0.5 * degree, Vector3d::UnitZ());
  const Clip clip = clip_of(knee);
  const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
  EXPECT_EQ(layout.joints[1].turns, 3);
  EXPECT_LT(largest_turn_apart(clip, round_trip(clip, layout)), 1e-6);
  // A wider tolerance lets it pass.
  EXPECT_EQ(find_channel_layout(std::span(&clip, 1), {.tolerance_degrees = 1}).joints[1].turns, 1);
}

TEST(JointChannels, clips_of_one_layout_move_as_all_of_them_do) {
  RandomJoints random(5);
  std::vector<Clip> clips;
  for (const Vector3d& axis : {Vector3d::UnitX().eval(), Vector3d::UnitY().eval()}) {
    std::vector<Quaterniond> knee;
    for (const double a : random.curve(100, 30)) knee.push_back(Quaterniond(AngleAxisd(a * degree, axis)));
    clips.push_back(clip_of(knee));
  }
  EXPECT_EQ(find_channel_layout(std::span(clips).first(1)).joints[1].turns, 1);
  const ChannelLayout both = find_channel_layout(clips);
  EXPECT_GE(both.joints[1].turns, 2);
  for (const Clip& clip : clips) EXPECT_LT(largest_turn_apart(clip, round_trip(clip, both)), 1e-3);
}

TEST(JointChannels, channels_go_on_through_a_pole_and_beyond_half_a_turn) {
  // Pitches through +-90 degrees and rolls on, three times round.
  std::vector<Quaterniond> knee;
  for (int f = 0; f < 600; ++f) {
    knee.push_back(AngleAxisd(1.8 * degree * f, Vector3d::UnitY()) *
                   AngleAxisd(20 * degree * std::sin(0.02 * f), Vector3d::UnitX()) *
                   Quaterniond(AngleAxisd(10 * degree * std::sin(0.05 * f), Vector3d::UnitZ())));
  }
  const Clip clip = clip_of(knee);
  const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
  const ChannelCurves curves = channel_curves(clip, layout);
  EXPECT_LT(largest_step(curves), 5);
  EXPECT_LT(largest_turn_apart(clip, round_trip(clip, layout)), 1e-3);
}

TEST(JointChannels, values_that_are_no_numbers_are_refused) {
  RandomJoints random(6);
  Clip clip = clip_of(std::vector<Quaterniond>(20, random.rotation()));
  const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
  clip.rotations[100] = std::nan("");
  EXPECT_THROW(static_cast<void>(find_channel_layout(std::span(&clip, 1))), Error);
  EXPECT_THROW(static_cast<void>(channel_curves(clip, layout)), Error);
  clip = clip_of(std::vector<Quaterniond>(20, random.rotation()));
  clip.require_translation_track(0).values[3].x() = std::nan("");
  EXPECT_THROW(static_cast<void>(channel_curves(clip, layout)), Error);
  EXPECT_THROW(static_cast<void>(find_channel_layout(std::span(&clip, 1), {.tolerance_degrees = 0})), Error);
}

TEST(JointChannels, damaged_layouts_are_errors_or_layouts) {
  const Clip& clip = test::sample_clips().front();
  const Bytes packed = pack_layout(find_channel_layout(std::span(&clip, 1)));
  int errors = 0;
  const auto open = [&](std::span<const std::byte> bytes) {
    try {
      const ChannelLayout layout = unpack_layout(bytes, clip.skeleton, "damaged");
      EXPECT_EQ(layout.joints.size(), clip.skeleton.rotating_joints().size());
      for (const JointFreedom& joint : layout.joints) EXPECT_NEAR(joint.turn_after().norm(), 1, 1e-12);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("damaged"), std::string::npos);
      ++errors;
    }
  };
  for (std::size_t n = 0; n < packed.size(); ++n) {
    open(std::span(packed).first(n));
    Bytes changed = packed;
    changed[n] ^= std::byte{0x35};
    open(changed);
  }
  EXPECT_GT(errors, static_cast<int>(packed.size()) / 2);
}

TEST(JointChannels, sample_clips_come_back_with_their_travel) {
  for (const Clip& clip : std::span(test::sample_clips()).first(4)) {
    const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
    const Clip back = round_trip(clip, layout);
    EXPECT_LT(largest_turn_apart(clip, back), 1e-3) << clip.name;
    EXPECT_LT(clip_error(clip, back, 0, clip.frames, 0).largest, 1e-2) << clip.name;
  }
}

TEST(JointChannels, recordings_have_the_channels_of_their_skeleton_files) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  for (const std::string subject : {"01", "02"}) {
    const auto folder = data / "cmu" / subject;
    const Asf asf = read_asf(folder / (subject + ".asf"));
    std::vector<Clip> clips;
    for (const char* take : {"_01.amc", "_02.amc", "_03.amc"}) clips.push_back(read_clip(folder / (subject + take)));
    const ChannelLayout layout = find_channel_layout(clips);
    int declared = 6, moving = 6;
    for (std::size_t j = 1; j < layout.joints.size(); ++j) {
      const JointFreedom& joint = layout.joints[j];
      const std::string& name = asf.skeleton.joints[static_cast<std::size_t>(joint.joint)].name;
      const int dofs = static_cast<int>(asf.bones[static_cast<std::size_t>(joint.joint)].dofs.size());
      declared += dofs;
      moving += joint.turns;
      // The files hold dofs that stand still: the collar bones' and the fingers'.
      const bool still = name.ends_with("clavicle") || name.ends_with("fingers");
      EXPECT_EQ(joint.turns, still ? 0 : dofs) << subject << " " << name;
    }
    EXPECT_EQ(declared, 62);
    EXPECT_EQ(layout.channel_count(), moving);
    EXPECT_LT(pack_layout(layout).size(), 200U);
    for (const Clip& clip : clips) {
      EXPECT_LT(largest_turn_apart(clip, round_trip(clip, layout)), 1e-3) << clip.name;
    }
  }
}

TEST(JointChannels, recordings_with_a_moving_joint_above_the_travel_root_come_back) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(data / "bandai2")) {
    if (is_motion_file(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  for (std::size_t i = 0; i < files.size(); i += 600) {
    const Clip clip = read_clip(files[i]);
    const Clip back = round_trip(clip, find_channel_layout(std::span(&clip, 1)));
    EXPECT_LT(clip_error(clip, back, 0, clip.frames, 0).largest, 5e-2) << clip.name;
  }
}

}  // namespace
}  // namespace kinespace
