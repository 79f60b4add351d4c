#include "kinespace/mesh/mesh_files.h"

#include <array>
#include <bit>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/mesh/detail/mesh_formats.h"
#include "tests/mesh/sample_meshes.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

void expect_same(const MeshSequence& a, const MeshSequence& b, float tolerance = 0) {
  ASSERT_EQ(a.vertices, b.vertices);
  ASSERT_EQ(a.frames, b.frames);
  EXPECT_EQ(a.triangles, b.triangles);
  for (std::size_t i = 0; i < a.positions.size(); ++i) ASSERT_NEAR(a.positions[i], b.positions[i], tolerance) << i;
}

// What reading says about it.
ErrorDetails refusal(const std::filesystem::path& path) {
  try {
    (void)read_mesh_sequence(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.details();
  }
  ADD_FAILURE() << path << " was taken";
  return {};
}

std::string parsing_error(const std::string& obj) {
  try {
    (void)parse_obj(obj, "x.obj");
  } catch (const Error& error) {
    return error.what();
  }
  return "taken";
}

TEST(MeshFiles, sequences_survive_numpy_obj_and_ply_to_the_last_bit) {
  const MeshSequence mesh = bending_tube(200, 12, 1.0);
  const TemporaryFolder folder;
  for (const MeshFormat format : {MeshFormat::numpy, MeshFormat::obj, MeshFormat::ply}) {
    const auto path = folder.path() / std::to_string(static_cast<int>(format));
    write_mesh_sequence(path, mesh, format);
    const MeshSequence back = read_mesh_sequence(path, {.rate_hz = 25});
    expect_same(mesh, back);
    EXPECT_EQ(back.rate_hz, 25);
  }
}

TEST(MeshFiles, sequences_survive_gltf) {
  MeshSequence mesh = bending_tube(200, 12, 1.0);
  mesh.rate_hz = 24;
  const TemporaryFolder folder;
  for (const char* name : {"a.gltf", "a.glb"}) {
    write_mesh_sequence(folder / name, mesh, MeshFormat::gltf);
    const MeshSequence back = read_mesh_sequence(folder / name);
    expect_same(mesh, back, 2e-6F);
    EXPECT_EQ(back.rate_hz, 24);
    EXPECT_NEAR(read_mesh_sequence(folder / name, {.rate_hz = 48}).frames, 23, 0);
  }
  MeshSequence still = sheet(4, 4, 1);
  write_mesh_sequence(folder / "still.glb", still, MeshFormat::gltf);
  expect_same(still, read_mesh_sequence(folder / "still.glb"));
}

TEST(MeshFiles, frames_come_in_the_natural_order_of_their_names) {
  const TemporaryFolder folder;
  for (const std::string number : {"1", "2", "10", "11", "100"}) {
    std::ofstream(folder.path() / (number + "f.obj")) << "v " << number << " 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  }
  const MeshSequence mesh = read_mesh_sequence(folder.path());
  ASSERT_EQ(mesh.frames, 5);
  for (int f = 0; f < 5; ++f)
    EXPECT_EQ(mesh.frame(f)[0], (std::array{1.F, 2.F, 10.F, 11.F, 100.F})[static_cast<std::size_t>(f)]);
}

TEST(MeshFiles, a_frame_with_other_counts_or_another_order_is_named) {
  const MeshSequence mesh = sheet(4, 3, 3);
  const TemporaryFolder folder;
  const auto path = folder.path() / "frames";
  const auto damage = [&](auto change) {
    std::filesystem::remove_all(path);
    write_mesh_sequence(path, mesh, MeshFormat::obj);
    MeshSequence other = mesh;
    change(other);
    write_file_atomically(path / "frame_00002.obj", format_obj(other.frame(1), other.triangles));
    return refusal(path);
  };
  const ErrorDetails order = damage([](MeshSequence& m) { std::swap(m.triangles[2], m.triangles[3]); });
  EXPECT_THAT(order.file, testing::EndsWith("frame_00002.obj"));
  EXPECT_EQ(order.found, "triangle 2 of frame 1 is (2, 6, 5)");
  EXPECT_EQ(order.expected, "(1, 2, 5) as in frame 0");
  EXPECT_EQ(damage([](MeshSequence& m) { m.triangles.pop_back(); }).found, "11 triangles in frame 1");
  EXPECT_EQ(damage([](MeshSequence& m) {
              m = sheet(4, 4, 3);
              m.triangles.resize(12);
            }).found,
            "16 vertices in frame 1");
}

TEST(MeshFiles, obj_takes_polygons_slashes_and_relative_numbers) {
  const MeshFrame frame = parse_obj(
      "# a comment\no thing\nv 0 0 0 1.0\nv 1 0 0\r\nv 1 1 0\n v 0 1 0\nvn 0 0 1\nf 1/1/1 2//1 3 4\nf -4 -3 -2\ns "
      "off\n",
      "x.obj");
  EXPECT_EQ(frame.positions.size(), 12U);
  EXPECT_EQ(frame.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}}));
}

TEST(MeshFiles, bad_obj_is_refused_with_its_line) {
  EXPECT_THAT(parsing_error("v 0 0 0\nv 1 nan 0\n"), testing::HasSubstr("x.obj:2"));
  EXPECT_THAT(parsing_error("v 0 0 0\nv 1 1e300 0\n"), testing::HasSubstr("x.obj:2"));
  EXPECT_THAT(parsing_error("v 0 0 0\nv 1 0 0\nf 1 2 3\n"), testing::HasSubstr("x.obj:3: vertex 3, expected 1 to 2"));
  EXPECT_THAT(parsing_error("v 0 0 0\nf 1 0 1\n"), testing::HasSubstr("x.obj:2"));
  EXPECT_THAT(parsing_error("v 0 0 0\nf 1 1\n"), testing::HasSubstr("a face with 2 vertices"));
  EXPECT_THAT(parsing_error("v 0 0 0\nf 1 -2 1\n"), testing::HasSubstr("x.obj:2"));
  EXPECT_THAT(parsing_error("nothing\n"), testing::HasSubstr("no vertices"));
}

TEST(MeshFiles, ply_takes_both_byte_orders_doubles_and_other_properties) {
  std::string ply =
      "ply\nformat binary_big_endian 1.0\ncomment made by hand\nelement vertex 3\nproperty uchar red\nproperty double "
      "x\n"
      "property float y\nproperty short z\nelement face 1\nproperty list uchar ushort vertex_index\nproperty uchar "
      "flag\n"
      "end_header\n";
  const auto put = [&](auto value) {
    const auto raw = std::bit_cast<std::array<char, sizeof value>>(value);
    for (std::size_t i = raw.size(); i-- > 0;) ply.push_back(raw[i]);
  };
  for (int v = 0; v < 3; ++v) {
    put(std::uint8_t{9});
    put(0.5 + v);
    put(1.5F + static_cast<float>(v));
    put(static_cast<std::int16_t>(-v));
  }
  put(std::uint8_t{3});
  for (const int v : {2, 0, 1}) put(static_cast<std::uint16_t>(v));
  put(std::uint8_t{1});
  const MeshFrame frame = parse_ply(ply, "x.ply");
  EXPECT_EQ(frame.positions, (std::vector<float>{0.5F, 1.5F, 0, 1.5F, 2.5F, -1, 2.5F, 3.5F, -2}));
  EXPECT_EQ(frame.triangles, (std::vector<Triangle>{{2, 0, 1}}));
}

std::string replaced(const std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  return text.substr(0, at) + to + text.substr(at + from.size());
}

TEST(MeshFiles, numpy_of_doubles_and_long_integers_is_read) {
  const auto header = [](const std::string& dict) {
    std::string out("\x93NUMPY\x01\x00", 8);
    out += static_cast<char>(dict.size());
    return out + '\0' + dict;
  };
  std::string positions = header("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 3), }");
  for (int i = 0; i < 9; ++i) {
    const double x = i / 4.0;
    positions.append(reinterpret_cast<const char*>(&x), 8);
  }
  std::string triangles = header("{'descr': '<i8', 'fortran_order': False, 'shape': (1, 3), }");
  for (const std::int64_t v : {0, 1, 2}) triangles.append(reinterpret_cast<const char*>(&v), 8);
  const MeshSequence mesh = parse_numpy(positions, "p", triangles, "t");
  EXPECT_EQ(mesh.frames, 1);
  EXPECT_EQ(mesh.positions[7], 1.75F);
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  const std::string fortran = replaced(positions, "False", "True ");
  EXPECT_THROW((void)parse_numpy(fortran, "p", triangles, "t"), Error);
  const std::string big = replaced(positions, "<f8", ">f8");
  EXPECT_THROW((void)parse_numpy(big, "p", triangles, "t"), Error);
  const std::string huge = header("{'descr': '<f8', 'fortran_order': False, 'shape': (2147483647, 2147483647, 3)}");
  EXPECT_THROW((void)parse_numpy(huge, "p", triangles, "t"), Error);
}

TEST(MeshFiles, an_output_is_whole_or_not_there) {
  const MeshSequence mesh = sheet(4, 4, 2);
  const TemporaryFolder folder;
  const auto path = folder.path() / "out";
  write_mesh_sequence(path, mesh);
  write_mesh_sequence(path, sheet(5, 4, 2));  // its own files may be replaced
  EXPECT_EQ(read_mesh_sequence(path).vertices, 20);
  EXPECT_THROW(write_mesh_sequence(path, mesh, MeshFormat::obj), Error) << "something else is there";
  std::ofstream(path / "letter.txt") << "keep me";
  EXPECT_THROW(write_mesh_sequence(path, mesh), Error);
  EXPECT_EQ(read_mesh_sequence(path).vertices, 20);
  EXPECT_THROW(write_mesh_sequence(folder.path() / "none" / "out", mesh), Error);
  MeshSequence bad = mesh;
  bad.positions[0] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(write_mesh_sequence(folder.path() / "bad", bad), Error);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "bad"));
  int entries = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++entries;
  EXPECT_EQ(entries, 1) << "nothing is left over";
}

TEST(MeshFiles, folders_without_or_with_two_kinds_of_meshes_are_refused) {
  const TemporaryFolder folder;
  EXPECT_EQ(refusal(folder.path()).found, "a folder without meshes");
  std::ofstream(folder / "a.obj") << "v 0 0 0\n";
  std::ofstream(folder / "a.ply") << "ply\n";
  EXPECT_EQ(refusal(folder.path()).found, "a folder with .obj and .ply files");
  EXPECT_EQ(refusal(folder / "gone.obj").file, (folder / "gone.obj").string());
}

}  // namespace
}  // namespace kinespace::test
