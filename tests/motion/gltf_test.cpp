#include "kinespace/motion/gltf.h"

#include <clocale>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "kinespace/base/file.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"
#include "tests/motion/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;

// A .glb taken apart by hand: its JSON, and its numbers by accessor.
class Glb {
 public:
  explicit Glb(const std::string& bytes) {
    const auto word = [&](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, bytes.data() + at, 4);
      return value;
    };
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(word(8), bytes.size());
    root = json::parse(bytes.substr(20, word(12)));
    numbers_ = bytes.substr(20 + word(12) + 8);
  }

  [[nodiscard]] std::vector<float> floats(const json& accessor_index) const {
    const json& accessor = root["accessors"][accessor_index.get<std::size_t>()];
    const json& view = root["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    EXPECT_EQ(accessor["componentType"], 5126);
    std::vector<float> out(view["byteLength"].get<std::size_t>() / 4);
    std::memcpy(out.data(), numbers_.data() + view.value("byteOffset", std::size_t{0}), out.size() * 4);
    return out;
  }

  // World positions in metres of all nodes below the scene's first one, at a key frame of the animation.
  [[nodiscard]] std::vector<Eigen::Vector3d> positions(std::size_t frame) const {
    std::vector<json> nodes = root["nodes"];
    for (const json& channel : root["animations"][0]["channels"]) {
      const json& sampler = root["animations"][0]["samplers"][channel["sampler"].get<std::size_t>()];
      EXPECT_EQ(sampler["interpolation"], "LINEAR");
      const auto values = floats(sampler["output"]);
      const std::string path = channel["target"]["path"];
      const std::size_t width = path == "rotation" ? 4 : 3;
      json value = json::array();
      for (std::size_t c = 0; c < width; ++c) value.push_back(values[frame * width + c]);
      nodes[channel["target"]["node"].get<std::size_t>()][path] = value;
    }
    std::vector<Eigen::Vector3d> out(nodes.size(), Eigen::Vector3d::Constant(NAN));
    walk(nodes, root["scenes"][0]["nodes"][0], Eigen::Isometry3d::Identity(), out);
    return out;
  }

  json root;

 private:
  static void walk(const std::vector<json>& nodes, std::size_t index, const Eigen::Isometry3d& above,
                   std::vector<Eigen::Vector3d>& out) {
    const json& node = nodes[index];
    const std::vector<double> t = node.value("translation", std::vector<double>{0, 0, 0});
    const std::vector<double> r = node.value("rotation", std::vector<double>{0, 0, 0, 1});
    const Eigen::Isometry3d here =
        above * Eigen::Translation3d(t[0], t[1], t[2]) * Eigen::Quaterniond(r[3], r[0], r[1], r[2]);
    out[index] = here.translation();
    for (const std::size_t child : node.value("children", std::vector<std::size_t>{})) walk(nodes, child, here, out);
  }

  std::string numbers_;
};

TEST(Gltf, nodes_stand_where_the_joints_do_in_metres) {
  const Clip clip = random_clip(1, 20);
  const Glb glb(format_gltf(clip, GltfForm::binary));
  const JointPositions want = joint_positions(clip);
  for (int f = 0; f < clip.frames; ++f) {
    const auto got = glb.positions(static_cast<std::size_t>(f));
    for (int j = 0; j < want.joints; ++j) {
      ASSERT_LT((got[static_cast<std::size_t>(j)] * 100 - want.at(f, j)).norm(), 1e-4)
          << "frame " << f << " joint " << j;
      EXPECT_EQ(glb.root["nodes"][static_cast<std::size_t>(j)]["name"],
                clip.skeleton.joints[static_cast<std::size_t>(j)].name);
    }
  }
}

TEST(Gltf, end_sites_are_nodes) {
  const Clip clip = random_clip(1, 2);
  const Glb glb(format_gltf(clip, GltfForm::binary));
  std::vector<JointFrame> frames;
  world_frames(clip, 1, frames);
  const auto got = glb.positions(1);
  int ends = 0;
  for (std::size_t n = clip.skeleton.joints.size(); n < glb.root["nodes"].size(); ++n) {
    for (std::size_t j = 0; j < frames.size(); ++j) {
      if (glb.root["nodes"][n]["name"] != clip.skeleton.joints[j].name + " end") continue;
      ++ends;
      EXPECT_LT((got[n] * 100 - frames[j].position - frames[j].rotation * *clip.skeleton.joints[j].end_site).norm(),
                1e-4);
    }
  }
  EXPECT_EQ(ends, 3);
}

TEST(Gltf, times_start_at_zero_and_end_with_the_clip) {
  const Clip clip = random_clip(2, 31);
  const Glb glb(format_gltf(clip, GltfForm::binary));
  const auto times = glb.floats(glb.root["animations"][0]["samplers"][0]["input"]);
  ASSERT_EQ(times.size(), 31u);
  EXPECT_EQ(times.front(), 0);
  EXPECT_FLOAT_EQ(times.back(), 1);
  for (std::size_t f = 1; f < times.size(); ++f) ASSERT_GT(times[f], times[f - 1]);
}

TEST(Gltf, quaternions_take_the_short_way_from_frame_to_frame) {
  Clip clip = random_clip(3, 50);
  auto track = clip.rotation_track(1);
  for (std::size_t f = 0; f < 50; f += 2) {
    for (std::size_t c = 0; c < 4; ++c) track[4 * f + c] *= -1;  // the same rotations
  }
  const Glb glb(format_gltf(clip, GltfForm::binary));
  for (const json& channel : glb.root["animations"][0]["channels"]) {
    if (channel["target"]["path"] != "rotation") continue;
    const auto q = glb.floats(glb.root["animations"][0]["samplers"][channel["sampler"].get<std::size_t>()]["output"]);
    for (std::size_t i = 4; i < q.size(); i += 4) {
      ASSERT_GT(q[i] * q[i - 4] + q[i + 1] * q[i - 3] + q[i + 2] * q[i - 2] + q[i + 3] * q[i - 1], 0);
    }
  }
}

TEST(Gltf, a_joint_that_rests_has_no_sampler) {
  Clip clip = random_clip(4, 10);
  for (int f = 0; f < 10; ++f) clip.set_rotation(1, f, clip.rotation(1, 0));
  const Glb glb(format_gltf(clip, GltfForm::binary));
  for (const json& channel : glb.root["animations"][0]["channels"]) EXPECT_NE(channel["target"]["node"], 1);
  EXPECT_EQ(glb.root["animations"][0]["channels"].size(), 5u + 2u);  // 5 of 7 joints turn, 2 travel
}

// The octahedra of the picture.
std::size_t bones_of(const Clip& clip) {
  const Glb glb(format_gltf(clip, GltfForm::binary));
  return glb.floats(glb.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"]).size() / 18;
}

TEST(Gltf, a_track_of_rounding_does_not_take_a_bone_away) {
  Clip clip = random_clip(4, 10);
  clip.translations.clear();
  const std::size_t all = bones_of(clip);
  for (const double size : {1e-12, 1e-3, 0.009}) {
    Clip shaken = clip;
    for (int j = 1; j < clip.skeleton.joint_count(); ++j) {
      auto& values = shaken.require_translation_track(j).values;
      for (std::size_t f = 0; f < values.size(); f += 2) values[f].y() += size;
    }
    EXPECT_EQ(bones_of(shaken), all) << size;
  }
  clip.require_translation_track(2).values[3].y() += 1;
  EXPECT_EQ(bones_of(clip), all - 1);
}

TEST(Gltf, the_bones_of_a_real_clip_are_all_there) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  for (const char* name : {"dash_active_001.bvh", "walk_normal_002.bvh", "run_childish_001.bvh"}) {
    const Clip clip = read_clip(data / "bandai1" / name);
    // The hips travel at the end of a root that stays. Every other joint is at the end of a bone, and the end sites.
    const auto ends = std::ranges::count_if(clip.skeleton.joints,
                                            [](const Joint& j) { return j.end_site && j.end_site->norm() >= 0.5; });
    EXPECT_EQ(bones_of(clip), static_cast<std::size_t>(clip.skeleton.joint_count() - 2 + ends)) << name;
  }
}

TEST(Gltf, both_forms_hold_the_same) {
  const Clip clip = random_clip(5, 7);
  const json text = json::parse(format_gltf(clip, GltfForm::text));
  json binary = Glb(format_gltf(clip, GltfForm::binary)).root;
  EXPECT_EQ(text["nodes"], binary["nodes"]);
  EXPECT_EQ(text["accessors"], binary["accessors"]);
  EXPECT_THAT(text["buffers"][0]["uri"].get<std::string>(),
              testing::StartsWith("data:application/octet-stream;base64,"));
}

TEST(Gltf, names_that_are_no_utf8_do_not_spoil_the_file) {
  Clip clip = random_clip(6, 2);
  clip.name = "caf\xe9 \"quoted\"";
  clip.skeleton.joints[0].name = "\xff\xfe";
  clip.skeleton.joints[1].name =
      "h\xc3\xbc"
      "fte";
  clip.skeleton.joints[2].name = "\xe2\x82";
  const Glb glb(format_gltf(clip, GltfForm::binary));
  EXPECT_EQ(glb.root["animations"][0]["name"], "caf? \"quoted\"");
  EXPECT_EQ(glb.root["nodes"][0]["name"], "??");
  EXPECT_EQ(glb.root["nodes"][1]["name"],
            "h\xc3\xbc"
            "fte");
  EXPECT_EQ(glb.root["nodes"][2]["name"], "??");
}

TEST(Gltf, a_clip_too_long_for_its_times_is_an_error) {
  Skeleton s;
  s.joints.push_back({.name = "only"});
  constexpr double rate = 1.1e6;  // after 8 s neighbours are nearer to each other than 32-bit floats are
  EXPECT_NO_THROW(static_cast<void>(format_gltf(make_clip("c", s, rate, 100'000), GltfForm::binary)));
  const Clip clip = make_clip("c", s, rate, 9'000'000);
  EXPECT_THAT(error_of([&] { static_cast<void>(format_gltf(clip, GltfForm::binary)); }).remedy,
              testing::HasSubstr("in parts"));
}

TEST(Gltf, more_joints_than_a_skin_can_number_is_an_error) {
  Skeleton s;
  for (int j = 0; j < 65537; ++j) s.joints.push_back({.name = "j", .parent = j == 0 ? -1 : 0});
  const Clip clip = make_clip("c", s, 30, 1);
  EXPECT_THAT(error_of([&] { static_cast<void>(format_gltf(clip, GltfForm::binary)); }).found,
              testing::HasSubstr("65537 joints"));
}

// Shell words are single-quoted; the paths of these tests hold no quote.
int run(const std::string& command) {
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

std::filesystem::path node_modules() {
  const char* named = std::getenv("KINESPACE_NODE_MODULES");
  return named != nullptr && *named != '\0' ? std::filesystem::path(named)
                                            : std::filesystem::path(KINESPACE_SOURCE_DIR) / "build/node_modules";
}

// The validator's verdict on files in the folder: 0 for no errors.
int validate(const std::filesystem::path& folder) {
  std::string command =
      "node '" KINESPACE_SOURCE_DIR "/tests/motion/gltf_validator.mjs' '" + node_modules().string() + "'";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) command += " '" + entry.path().string() + "'";
  return run(command);
}

#define KINESPACE_REQUIRE_VALIDATOR()                                                                           \
  if (run("node -e 0 2>/dev/null") != 0 || !std::filesystem::is_directory(node_modules() / "gltf-validator")) { \
    if (data_required())                                                                                        \
      FAIL() << "node or gltf-validator is missing from " << node_modules() << ": scripts/setup --tests";       \
    GTEST_SKIP() << "node or gltf-validator is missing from " << node_modules() << ": scripts/setup --tests";   \
  }

// Many joints, all on the root.
Skeleton star_of(int joints) {
  Skeleton s;
  for (int j = 0; j < joints; ++j)
    s.joints.push_back({.name = "j", .parent = j == 0 ? -1 : 0, .offset = {0, 1.0 + j % 7, 0}});
  return s;
}

TEST(GltfValidator, finds_no_error_in_what_is_written) {
  KINESPACE_REQUIRE_VALIDATOR();
  const TemporaryFolder folder;
  write_clip(folder / "walk.glb", random_clip(1, 100));
  write_clip(folder / "walk.gltf", random_clip(1, 100));
  write_clip(folder / "one-frame.glb", random_clip(2, 1));
  write_clip(folder / "two-frames.GLB", random_clip(2, 2));
  Skeleton single;
  single.joints.push_back({.name = "only"});
  write_clip(folder / "still.glb", make_clip("", single, 30, 3));
  write_clip(folder / "many-joints.glb", make_clip("many", star_of(300), 30, 2));
  write_clip(folder / "many-vertices.glb", make_clip("more", star_of(12000), 30, 1));
  EXPECT_EQ(validate(folder.path()), 0);
}

TEST(GltfValidator, finds_no_error_in_real_clips) {
  KINESPACE_REQUIRE_VALIDATOR();
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const TemporaryFolder folder;
  write_clip(folder / "cmu.glb", read_clip(data / "cmu/02/02_01.amc"));
  write_clip(folder / "bandai.glb", read_clip(data / "bandai1/run_normal_001.bvh"));
  EXPECT_EQ(validate(folder.path()), 0);
}

TEST(GltfValidator, can_fail) {
  KINESPACE_REQUIRE_VALIDATOR();
  const TemporaryFolder folder;
  std::string text = format_gltf(random_clip(1, 3), GltfForm::text);
  write_file_atomically(folder / "broken.gltf", replaced(text, "\"scene\":0", "\"scene\":7"));
  EXPECT_EQ(validate(folder.path()), 1);
}

}  // namespace
}  // namespace kinespace::test
