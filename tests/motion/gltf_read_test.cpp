// Clips out of glTF files: what we write, and files as other programs write them.
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "kinespace/motion/gltf.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"
#include "tests/gltf/sample_gltf.h"
#include "tests/motion/sample_clips.h"
#include "tests/support/allocation_meter.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

// A file that is put together node by node.
class GltfFile {
 public:
  GltfFile() { root_["asset"]["version"] = "2.0"; }

  int add_node(json node, int parent = -1) {
    root_["nodes"].push_back(std::move(node));
    const int index = static_cast<int>(root_["nodes"].size()) - 1;
    if (parent >= 0) root_["nodes"][static_cast<std::size_t>(parent)]["children"].push_back(index);
    return index;
  }
  int add_floats(const std::vector<float>& values, const char* type, std::size_t width) {
    return add_bytes(bytes_of(values), 5126, values.size() / width, type);
  }
  int add_bytes(const std::string& bytes, int component, std::size_t count, const char* type) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    root_["bufferViews"].push_back(view_of(bytes_.size(), bytes.size()));
    bytes_ += bytes;
    const int view = static_cast<int>(root_["bufferViews"].size()) - 1;
    root_["accessors"].push_back(accessor_of(view, component, count, type));
    return static_cast<int>(root_["accessors"].size()) - 1;
  }
  // A channel of animation `animation`, which is made where it is missing.
  void add_channel(std::size_t animation, int node, const char* path, const std::vector<float>& times, int output,
                   const char* interpolation = "LINEAR") {
    json& to = root_["animations"][animation];
    to["samplers"].push_back(
        {{"input", add_floats(times, "SCALAR", 1)}, {"output", output}, {"interpolation", interpolation}});
    to["channels"].push_back({{"sampler", to["samplers"].size() - 1}, {"target", {{"node", node}, {"path", path}}}});
  }
  void add_translations(std::size_t animation, int node, const std::vector<float>& times,
                        const std::vector<float>& values, const char* interpolation = "LINEAR") {
    add_channel(animation, node, "translation", times, add_floats(values, "VEC3", 3), interpolation);
  }
  void add_rotations(std::size_t animation, int node, const std::vector<float>& times, const std::vector<float>& values,
                     const char* interpolation = "LINEAR") {
    add_channel(animation, node, "rotation", times, add_floats(values, "VEC4", 4), interpolation);
  }
  json& root() { return root_; }
  [[nodiscard]] std::string glb() const {
    json all = root_;
    all["buffers"] = {{{"byteLength", bytes_.size()}}};
    return glb_of(all.dump(), bytes_);
  }

  std::vector<std::string> notes;
  Clip read(const std::string& animation = {}) { return std::move(read_all(animation, ClipsWanted::one).front()); }
  std::vector<Clip> read_all(const std::string& animation = {}, ClipsWanted wanted = ClipsWanted::all) {
    return parse_gltf(glb(), "folder/file.glb",
                      {.animation = animation, .note = [&](const std::string& what) { notes.push_back(what); }},
                      wanted);
  }

 private:
  json root_;
  std::string bytes_;
};

Eigen::Vector3d place(const Clip& clip, const char* joint, int frame) {
  return joint_positions(clip).at(frame, clip.skeleton.find(joint));
}

// x, y, z, w of a turn about Z.
std::vector<float> about_z(double degrees) {
  const double half = degrees * std::numbers::pi / 360;
  return {0, 0, static_cast<float>(std::sin(half)), static_cast<float>(std::cos(half))};
}
std::vector<float> joined(std::initializer_list<std::vector<float>> parts) {
  std::vector<float> out;
  for (const auto& part : parts) out.insert(out.end(), part.begin(), part.end());
  return out;
}

// A bone of 1 m on another of 1 m, along X.
GltfFile two_bones() {
  GltfFile file;
  const int low = file.add_node({{"name", "low"}});
  const int high = file.add_node({{"name", "high"}, {"translation", {1, 0, 0}}}, low);
  file.add_node({{"name", "tip"}, {"translation", {1, 0, 0}}}, high);
  return file;
}

void expect_read_back(const Clip& clip, GltfForm form) {
  const Clip back = std::move(parse_gltf(format_gltf(clip, form), "it.glb").front());
  ASSERT_EQ(back.skeleton.joint_count(), clip.skeleton.joint_count());
  EXPECT_EQ(back.name, "it");
  EXPECT_EQ(back.frames, clip.frames);
  if (clip.frames > 1) {
    EXPECT_DOUBLE_EQ(back.rate_hz, clip.rate_hz);
  }
  EXPECT_LE(largest_distance(back, clip), 1e-4);
  EXPECT_EQ(what_is_wrong_with(back), "");
  for (std::size_t j = 0; j < clip.skeleton.joints.size(); ++j) {
    const Joint &a = back.skeleton.joints[j], &b = clip.skeleton.joints[j];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.parent, b.parent);
    ASSERT_EQ(a.end_site.has_value(), b.end_site.has_value()) << b.name;
    if (a.end_site) {
      EXPECT_LT((*a.end_site - *b.end_site).norm(), 1e-4);
    }
  }
  if (clip.frames == 1) return;  // what moves in a single frame does not move
  ASSERT_EQ(back.translations.size(), clip.translations.size());
  for (std::size_t t = 0; t < clip.translations.size(); ++t) {
    EXPECT_EQ(back.translations[t].joint, clip.translations[t].joint);
  }
}

TEST(GltfRead, what_is_written_is_read_back) {
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    expect_read_back(random_clip(seed, 40), seed % 2 == 0 ? GltfForm::text : GltfForm::binary);
  }
  expect_read_back(random_clip(9, 1), GltfForm::binary);
  expect_read_back(random_clip(9, 2), GltfForm::binary);
}

TEST(GltfRead, rates_come_back_whatever_32_bit_times_blur) {
  for (const double rate : {1.0, 12.5, 23.976, 29.97, 59.94, 119.88, 120.0, 240.0, 1000.0}) {
    SCOPED_TRACE(rate);
    Clip clip = random_clip(3, 300);
    clip.rate_hz = rate;
    expect_read_back(clip, GltfForm::binary);
  }
}

TEST(GltfRead, a_clip_of_ten_minutes_comes_back_frame_by_frame) {
  Skeleton s;
  s.joints.push_back({.name = "root", .channels = {Channel::x_position, Channel::y_position, Channel::z_position}});
  Clip clip = make_clip("long", s, 120, 72000);
  auto& track = clip.require_translation_track(0).values;
  for (std::size_t f = 0; f < track.size(); ++f) track[f] = {f % 2 == 0 ? 5.0 : -5.0, static_cast<double>(f % 100), 0};
  expect_read_back(clip, GltfForm::binary);
}

TEST(GltfRead, real_clips_are_read_back) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  for (const char* name : {"bandai1/dash_active_001.bvh", "bandai1/walk_normal_002.bvh", "cmu/02/02_01.amc"}) {
    SCOPED_TRACE(name);
    expect_read_back(read_clip(data / name), GltfForm::binary);
  }
}

TEST(GltfRead, samplers_step_slerp_and_follow_splines) {
  GltfFile file = two_bones();
  const std::vector<float> turns = joined({about_z(0), about_z(90)});
  file.add_rotations(0, 0, {0, 1}, turns);
  file.add_rotations(1, 0, {0, 1}, turns, "STEP");
  // Tangents of zero: the turn eases in and out, and is at its half in the middle.
  const std::vector<float> none{0, 0, 0, 0};
  file.add_rotations(2, 0, {0, 1}, joined({none, about_z(0), none, none, about_z(90), none}), "CUBICSPLINE");
  const std::vector<Clip> clips = file.read_all();
  ASSERT_EQ(clips.size(), 3u);
  const auto angle = [](const Clip& clip, int frame) {
    const Eigen::Vector3d at = place(clip, "high", frame);
    return std::atan2(at.y(), at.x()) * 180 / std::numbers::pi;
  };
  for (const Clip& clip : clips) {
    EXPECT_EQ(clip.frames, 31);
    EXPECT_EQ(clip.rate_hz, 30);
    EXPECT_NEAR(angle(clip, 30), 90, 1e-4);
  }
  EXPECT_NEAR(angle(clips[0], 10), 30, 1e-4);
  EXPECT_NEAR(angle(clips[1], 29), 0, 1e-4);
  EXPECT_NEAR(angle(clips[2], 15), 45, 1e-4);
  // p(t) = (1 - h) p0 + h p1 with h = 3 t^2 - 2 t^3, made of length 1.
  const double h = 3.0 / 25 - 2.0 / 125, half = std::numbers::pi / 4;
  const double want = 2 * std::atan2(h * std::sin(half), 1 - h + h * std::cos(half)) * 180 / std::numbers::pi;
  EXPECT_NEAR(angle(clips[2], 6), want, 1e-4);
}

TEST(GltfRead, keys_that_fit_no_rate_are_sampled_at_30_and_this_is_said) {
  GltfFile file = two_bones();
  file.add_rotations(0, 0, {0, 0.0101F, 0.5277F, 1}, joined({about_z(0), about_z(9), about_z(45), about_z(90)}));
  const Clip clip = file.read();
  EXPECT_EQ(clip.rate_hz, 30);
  EXPECT_EQ(clip.frames, 31);
  EXPECT_THAT(file.notes, ElementsAre(HasSubstr("30 Hz")));
}

TEST(GltfRead, keys_left_out_do_not_hide_the_rate) {
  GltfFile file = two_bones();
  const auto at = [](int frame) { return static_cast<float>(frame / 24.0); };
  file.add_rotations(0, 0, {at(1), at(7), at(8), at(31)}, joined({about_z(0), about_z(9), about_z(45), about_z(90)}));
  file.add_translations(0, 1, {at(1), at(40)}, {1, 0, 0, 1, 1, 0});
  const Clip clip = file.read();
  EXPECT_EQ(clip.rate_hz, 24);
  EXPECT_EQ(clip.frames, 40);
  EXPECT_EQ(file.notes.size(), 0u);
}

TEST(GltfRead, several_animations_are_clips_by_name_and_number) {
  GltfFile file = two_bones();
  for (std::size_t a = 0; a < 4; ++a) {
    const double degrees = 10.0 * static_cast<double>(a + 1);
    file.add_rotations(a, 0, {0, 1}, joined({about_z(degrees), about_z(degrees)}));
  }
  file.root()["animations"][0]["name"] = "walk";
  file.root()["animations"][1]["name"] = "a/run";
  file.root()["animations"][3]["name"] = "walk";
  std::vector<std::string> names;
  for (const Clip& clip : file.read_all()) names.push_back(clip.name);
  EXPECT_THAT(names, ElementsAre("file.walk", "file.a_run", "file.3", "file.walk (2)"));
  EXPECT_EQ(file.notes.size(), 0u);

  const auto first = [&](const std::string& chosen) {
    const Eigen::Vector3d at = place(file.read(chosen), "high", 0);
    return std::lround(std::atan2(at.y(), at.x()) * 180 / std::numbers::pi);
  };
  EXPECT_EQ(first("a/run"), 20);
  EXPECT_EQ(first("4"), 40);
  EXPECT_EQ(first("walk (2)"), 40);
  EXPECT_EQ(first(""), 10);
  EXPECT_THAT(file.notes, ElementsAre(HasSubstr("the first of 4 animations")));
  for (const char* wrong : {"0", "5", "jump"}) {
    EXPECT_THAT(error_of([&] { static_cast<void>(file.read(wrong)); }).expected, HasSubstr("walk, a_run")) << wrong;
  }
}

TEST(GltfRead, clips_of_one_file_have_the_same_channels) {
  GltfFile file = two_bones();
  file.add_rotations(0, 0, {0, 1}, joined({about_z(0), about_z(5)}));
  file.add_translations(1, 1, {0, 1}, {1, 0, 0, 2, 0, 0});
  const std::vector<Clip> clips = file.read_all();
  EXPECT_TRUE(clips[0].skeleton.same_tree(clips[1].skeleton));
  EXPECT_EQ(file.read("1").skeleton.tree_hash(), clips[0].skeleton.tree_hash());
  EXPECT_NEAR(place(clips[1], "high", 30).x(), 200, 1e-4);
}

TEST(GltfRead, a_translation_that_keeps_its_place_is_none) {
  GltfFile file = two_bones();
  file.add_rotations(0, 0, {0, 1}, joined({about_z(0), about_z(5)}));
  file.add_translations(0, 1, {0, 0.5F, 1}, {1, 0, 0, 1.00005F, 0, 0, 1, 0, 0});
  const Clip clip = file.read();
  EXPECT_FALSE(clip.skeleton.joints[1].has_position());
  EXPECT_TRUE(clip.translations.empty());
}

TEST(GltfRead, only_the_default_scene_counts) {
  GltfFile file = two_bones();
  const int other = file.add_node({{"name", "elsewhere"}});
  file.root()["scenes"] = {{{"nodes", {other}}}, {{"nodes", {0}}}};
  file.root()["scene"] = 1;
  file.add_rotations(0, 0, {0, 1}, joined({about_z(0), about_z(90)}));
  file.add_translations(0, other, {0, 1}, {0, 0, 0, 5, 0, 0});
  const Clip clip = file.read();
  EXPECT_EQ(clip.skeleton.joint_count(), 3);
  EXPECT_EQ(clip.skeleton.find("elsewhere"), -1);
  file.root()["scene"] = 7;
  EXPECT_THAT(error_of([&] { static_cast<void>(file.read()); }).found, HasSubstr("scene 7"));
}

TEST(GltfRead, nodes_between_and_above_joints_are_folded) {
  GltfFile file;
  // Z up, in centimetres, by a matrix above all; a node between the joints that turns and moves, too.
  const int top = file.add_node({{"matrix", {0.01, 0, 0, 0, 0, 0, -0.01, 0, 0, 0.01, 0, 0, 0, 0, 0, 1}}});
  const int hips = file.add_node({{"name", "hips"}, {"translation", {0, 0, 90}}}, top);
  const int between = file.add_node({{"translation", {10, 0, 0}}, {"scale", {2, 2, 2}}}, hips);
  const int leg = file.add_node({{"name", "leg"}, {"translation", {5, 0, 0}}}, between);
  file.root()["skins"] = {{{"joints", {leg, hips}}}};
  file.add_node({{"mesh", 0}, {"skin", 0}});
  file.add_rotations(0, between, {0, 1}, joined({about_z(0), about_z(90)}));
  file.add_translations(0, hips, {0, 1}, {0, 0, 90, 0, 40, 90});
  const Clip clip = file.read();
  ASSERT_EQ(clip.skeleton.joint_count(), 2);
  EXPECT_EQ(clip.skeleton.joints[0].name, "hips");
  EXPECT_LT((place(clip, "hips", 0) - Eigen::Vector3d(0, 90, 0)).norm(), 1e-4);
  EXPECT_LT((place(clip, "hips", 30) - Eigen::Vector3d(0, 90, -40)).norm(), 1e-4);
  EXPECT_LT((place(clip, "leg", 0) - Eigen::Vector3d(20, 90, 0)).norm(), 1e-4);
  EXPECT_LT((place(clip, "leg", 30) - Eigen::Vector3d(10, 90, -50)).norm(), 1e-4);
}

TEST(GltfRead, the_bind_pose_has_no_rotations) {
  GltfFile file;
  const int low = file.add_node({{"name", "low"}, {"rotation", about_z(90)}});
  const int high = file.add_node({{"name", "high"}, {"translation", {1, 0, 0}}, {"rotation", about_z(-30)}}, low);
  file.add_node({{"name", "end"}, {"translation", {0.5, 0, 0}}}, high);
  // Bound upright: the bone along Y. The nodes stand otherwise.
  const std::vector<float> upright{0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  std::vector<float> above = upright;
  above[12] = -1;
  const int inverse = file.add_floats(joined({upright, above}), "MAT4", 16);
  file.root()["skins"] = {{{"joints", {low, high}}, {"inverseBindMatrices", inverse}}};
  file.add_node({{"mesh", 0}, {"skin", 0}});
  const Clip clip = file.read();
  EXPECT_EQ(clip.frames, 1);
  EXPECT_THAT(file.notes, ElementsAre(HasSubstr("rest pose")));
  EXPECT_LT((clip.skeleton.joints[1].offset - Eigen::Vector3d(0, 100, 0)).norm(), 1e-4);
  EXPECT_LT((*clip.skeleton.joints[1].end_site - Eigen::Vector3d(0, 50, 0)).norm(), 1e-4);
  EXPECT_NEAR(clip.rotation(0, 0).angularDistance(Eigen::Quaterniond::Identity()), 0, 1e-6);
  EXPECT_NEAR(clip.rotation(1, 0).angularDistance(Eigen::Quaterniond::Identity()) * 180 / std::numbers::pi, 30, 1e-4);
  EXPECT_NEAR(clip.skeleton.rest_height(), 150, 1e-3);
}

TEST(GltfRead, scales_that_change_and_differ_by_axis_leave_joints_where_they_are) {
  GltfFile file = two_bones();
  file.root()["nodes"][0]["scale"] = {1, 3, 1};
  file.add_rotations(0, 1, {0, 1}, joined({about_z(0), about_z(90)}));
  file.add_channel(1, 1, "scale", {0, 1}, file.add_floats({1, 1, 1, 2, 1, 1}, "VEC3", 3));
  const std::vector<Clip> clips = file.read_all();
  EXPECT_LT((place(clips[0], "tip", 0) - Eigen::Vector3d(200, 0, 0)).norm(), 1e-4);
  EXPECT_LT((place(clips[0], "tip", 30) - Eigen::Vector3d(100, 300, 0)).norm(), 1e-4);
  EXPECT_LT((place(clips[1], "tip", 15) - Eigen::Vector3d(250, 0, 0)).norm(), 1e-4);
  EXPECT_THAT(file.notes, ElementsAre(HasSubstr("1 node changes in size")));
}

TEST(GltfRead, trees_that_share_nothing_hang_on_the_scene) {
  GltfFile file;
  const int a = file.add_node({{"name", "a"}, {"translation", {1, 0, 0}}});
  const int b = file.add_node({{"name", "b"}});
  file.root()["scenes"] = {{{"name", "stage"}, {"nodes", {a, b}}}};
  file.add_translations(0, a, {0, 1}, {1, 0, 0, 1, 2, 0});
  file.add_rotations(0, b, {0, 1}, joined({about_z(0), about_z(90)}));
  const Clip clip = file.read();
  ASSERT_EQ(clip.skeleton.joint_count(), 3);
  EXPECT_EQ(clip.skeleton.joints[0].name, "stage");
  EXPECT_LT((place(clip, "a", 30) - Eigen::Vector3d(100, 200, 0)).norm(), 1e-4);
}

TEST(GltfRead, packed_numbers_are_unpacked) {
  GltfFile file = two_bones();
  const auto half = static_cast<std::int16_t>(std::lround(32767 * std::numbers::sqrt2 / 2));
  const int turns = file.add_bytes(bytes_of<std::int16_t>({0, 0, 0, 32767, 0, 0, half, half}), 5122, 2, "VEC4");
  file.root()["accessors"][static_cast<std::size_t>(turns)]["normalized"] = true;
  file.add_channel(0, 0, "rotation", {0, 1}, turns);
  // The second of two places, by a sparse accessor; the first is zero for want of a view.
  const int at = file.add_bytes(bytes_of<std::uint16_t>({1}), 5123, 1, "SCALAR");
  const int places = file.add_floats({0, 2, 0}, "VEC3", 3);
  json sparse{{"componentType", 5126}, {"count", 2}, {"type", "VEC3"}};
  sparse["sparse"] = {
      {"count", 1}, {"indices", {{"bufferView", at}, {"componentType", 5123}}}, {"values", {{"bufferView", places}}}};
  file.root()["accessors"].push_back(sparse);
  file.add_channel(0, 0, "translation", {0, 1}, static_cast<int>(file.root()["accessors"].size()) - 1);
  const Clip clip = file.read();
  EXPECT_LT((place(clip, "low", 30) - Eigen::Vector3d(0, 200, 0)).norm(), 1e-3);
  EXPECT_LT((place(clip, "high", 30) - Eigen::Vector3d(0, 300, 0)).norm(), 0.01);
}

TEST(GltfRead, meshes_that_cannot_be_read_do_not_hinder) {
  GltfFile file = two_bones();
  file.add_rotations(0, 0, {0, 1}, joined({about_z(0), about_z(90)}));
  file.root()["meshes"] = {{{"primitives", {{{"attributes", "no object"}}}}}};
  file.root()["extensionsRequired"] = {"KHR_draco_mesh_compression", "KHR_mesh_quantization"};
  EXPECT_EQ(file.read().frames, 31);
  file.root()["extensionsRequired"] = {"KHR_interactivity"};
  EXPECT_THAT(error_of([&] { static_cast<void>(file.read()); }).found, HasSubstr("requires KHR_interactivity"));
}

TEST(GltfRead, what_has_no_skeleton_is_told_so) {
  GltfFile file = two_bones();
  EXPECT_THAT(error_of([&] { static_cast<void>(file.read()); }).found, HasSubstr("no skin, and no animation"));
  file.add_channel(0, 0, "weights", {0, 1}, file.add_floats({0, 1}, "SCALAR", 1));
  EXPECT_THAT(error_of([&] { static_cast<void>(file.read()); }).found, HasSubstr("no skin, and no animation"));
}

TEST(GltfRead, values_that_are_no_rotation_or_place_are_errors) {
  for (const float bad : {0.0F, NAN, INFINITY}) {
    GltfFile file = two_bones();
    file.add_rotations(0, 0, {0, 1}, joined({about_z(0), {bad, bad, bad, bad}}));
    EXPECT_THAT(error_of([&] { static_cast<void>(file.read()); }).found, HasSubstr("\"low\" in frame")) << bad;
  }
  GltfFile file = two_bones();
  file.add_translations(0, 0, {0, 1}, {0, 0, 0, INFINITY, 0, 0});
  EXPECT_THAT(error_of([&] { static_cast<void>(file.read()); }).found, HasSubstr("\"low\" in frame"));
}

TEST(GltfRead, a_small_file_cannot_ask_for_much_memory) {
  GltfFile file;
  const int low = file.add_node({{"name", "low"}});
  for (int i = 0; i < 1000; ++i) file.add_node({{"name", "leaf"}}, low);
  file.add_rotations(0, 0, {0, 1e6F}, joined({about_z(0), about_z(90)}));
  const AllocationMeter meter;
  EXPECT_THAT(error_of([&] { static_cast<void>(file.read()); }).found, HasSubstr("frames of 1001 joints"));
  EXPECT_LT(meter.peak(), 32u << 20);
}

// What a damaged file turned out to be: a valid clip, or an error that says what is wrong.
bool is_clip(const std::string& bytes) {
  try {
    for (const Clip& clip : parse_gltf(bytes, "h.glb", {}, ClipsWanted::all)) {
      EXPECT_EQ(what_is_wrong_with(clip), "");
      for (const auto& position : joint_positions(clip).values) EXPECT_TRUE(position.allFinite());
    }
    return true;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_FALSE(error.details().found.empty() || error.details().expected.empty()) << error.what();
    return false;
  }
}

TEST(GltfRead, damaged_files_are_errors_or_valid_clips) {
  const std::string good = format_gltf(random_clip(1, 5), GltfForm::binary);
  ASSERT_TRUE(is_clip(good));
  std::mt19937 random(20261201);
  int clips = 0;
  for (int i = 0; i < 4000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    std::string damaged = good;
    for (auto edits = 1 + random() % 3; edits > 0; --edits) {
      const std::size_t at = random() % damaged.size();
      if (random() % 4 == 0) {
        damaged[at] = static_cast<char>('0' + random() % 10);
      } else {
        damaged[at] = static_cast<char>(static_cast<unsigned char>(damaged[at]) ^ (1U << random() % 8));
      }
    }
    if (random() % 20 == 0) damaged.resize(random() % damaged.size());
    if (is_clip(damaged)) ++clips;
  }
  EXPECT_GT(clips, 100) << "damage that leaves nothing to read tests nothing";
  EXPECT_LT(clips, 3900);
}

}  // namespace
}  // namespace kinespace::test
