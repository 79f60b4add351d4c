// The mesh command as a user runs it, on a tube that bends.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "kinespace/mesh/mesh_files.h"
#include "kinespace/storage/library.h"
#include "tests/cli/run_command.h"
#include "tests/gltf/sample_gltf.h"
#include "tests/mesh/sample_meshes.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;

class MeshCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    write_mesh_sequence(at("tube"), bending_tube(600, 12, 1.0));
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string at(const char* name) { return (*folder_ / name).string(); }
  static json run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "mesh");
    arguments.emplace_back("--json");
    const CommandResult result = run_command(arguments);
    EXPECT_EQ(result.code, 0) << result.err;
    return result.code == 0 ? json::parse(result.out) : json::object();
  }
  static std::string fails(std::vector<std::string> arguments, int code) {
    arguments.insert(arguments.begin(), "mesh");
    const CommandResult result = run_command(arguments);
    EXPECT_EQ(result.code, code) << result.err;
    return result.err;
  }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> MeshCommand::folder_;

TEST_F(MeshCommand, a_sequence_goes_there_and_back_within_the_error_asked_for) {
  const json encoded = run({"encode", at("tube"), "-o", at("tube.ksm"), "--kg", "1"});
  for (const char* key : {"codec", "vertices", "triangles", "frames", "bytes", "bpvf", "bpvf_without_connectivity",
                          "kg", "kg_time", "lr"}) {
    EXPECT_TRUE(encoded.contains(key)) << key;
  }
  EXPECT_LE(encoded["kg"], 1);
  EXPECT_EQ(encoded["bytes"], std::filesystem::file_size(at("tube.ksm")));
  EXPECT_EQ(run({"decode", at("tube.ksm"), "-o", at("back")})["frames"], 12);
  const json compared = run({"compare", at("tube"), at("back"), "--picture", at("tube.png")});
  EXPECT_NEAR(compared["kg"], encoded["kg"], 1e-3);
  EXPECT_TRUE(std::filesystem::exists(at("tube.png")));
  EXPECT_EQ(run({"decode", at("tube.ksm"), "-o", at("part"), "--from", "3", "--to", "5"})["frames"], 3);
}

// A million frames of two triangles, from a file of a kilobyte.
std::string long_gltf() {
  const std::string bytes = triangle_bytes() + bytes_of<float>({0, 33'000});
  json out = triangle_at(data_uri(bytes));
  out["buffers"][0]["byteLength"] = bytes.size();
  out["bufferViews"].push_back(view_of(44, 8));
  out["accessors"].push_back(accessor_of(2, 5126, 2, "SCALAR"));
  out["accessors"].push_back(accessor_of(0, 5126, 2, "VEC3"));
  out["nodes"].push_back({{"mesh", 0}});
  out["animations"] = {{{"samplers", {{{"input", 2}, {"output", 3}}}},
                        {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}}}}};
  return out.dump();
}

// Work of minutes, were it not stopped: what is asserted is that it is, whatever step it is in.
TEST_F(MeshCommand, a_signal_ends_it_and_leaves_nothing) {
  write_text(at("long.gltf"), long_gltf());
  write_mesh_sequence(at("large"), bending_tube(20'000, 60, 1.0));
  std::filesystem::create_directory(at("out"));
  const std::string out = at("out") + "/x.ksm";
  const std::vector<std::vector<std::string>> commands = {
      {"info", at("long.gltf")},
      {"compare", at("long.gltf"), at("long.gltf")},
      {"encode", at("long.gltf"), "-o", out, "--codec", "mesh-draco"},
      {"encode", at("large"), "-o", out, "--codec", "mesh-harmonics"},
      {"encode", at("large"), "-o", out, "--codec", "mesh-harmonics", "--profile", "paper"},
      {"encode", at("large"), "-o", out, "--codec", "mesh-pca", "--kg", "0.01"},
      {"encode", at("large"), "-o", out, "--codec", "mesh-draco", "--kg", "0.01"}};
  for (std::vector<std::string> arguments : commands) {
    for (const int pause_ms : {0, 300}) {
      SCOPED_TRACE(arguments.back());
      std::vector<std::string> whole{"mesh"};
      whole.insert(whole.end(), arguments.begin(), arguments.end());
      Command command(whole);
      std::this_thread::sleep_for(std::chrono::milliseconds(pause_ms));
      command.send(SIGTERM);
      const CommandResult result = command.finish();
      EXPECT_EQ(result.code, 143) << result.err;
      EXPECT_NE(result.err.find("stopped"), std::string::npos);
      EXPECT_TRUE(std::filesystem::is_empty(at("out")));
    }
  }
}

TEST_F(MeshCommand, a_small_file_that_asks_for_much_memory_needs_leave) {
  write_text(at("long.gltf"), long_gltf());
  fails({"info", at("long.gltf"), "--max-memory", "1"}, 1);
  fails({"info", at("long.gltf"), "--max-memory", "0"}, 2);
}

TEST_F(MeshCommand, a_single_frame_has_no_error_over_time) {
  write_mesh_sequence(at("still"), bending_tube(60, 1, 1.0));
  for (const char* codec : {"mesh-harmonics", "mesh-pca", "mesh-draco"}) {
    const json encoded = run({"encode", at("still"), "-o", at("still.ksm"), "--codec", codec});
    EXPECT_TRUE(encoded["kg_time"].is_null()) << codec;
    EXPECT_LE(encoded["kg"], 0.5) << codec;
    EXPECT_EQ(run({"info", at("still.ksm")})["frames"], 1);
  }
}

TEST_F(MeshCommand, info_describes_sequences_and_streams) {
  const json sequence = run({"info", at("tube")});
  EXPECT_EQ(sequence["kind"], "mesh");
  EXPECT_EQ(sequence["components"], 1);
  EXPECT_EQ(sequence["watertight"], true);
  run({"encode", at("tube"), "-o", at("draco.ksm"), "--codec", "mesh-draco", "--kg", "1"});
  const json stream = run({"info", at("draco.ksm")});
  EXPECT_EQ(stream["codec"], "mesh-draco");
  EXPECT_EQ(stream["vertices"], sequence["vertices"]);
}

// For every codec, since the files are read before any of them begins.
TEST_F(MeshCommand, a_frame_with_other_counts_or_another_order_is_named_and_nothing_is_written) {
  const MeshSequence mesh = bending_tube(100, 3, 1.0);
  const auto with_second_frame = [&](const char* name, const MeshSequence& other) {
    write_mesh_sequence(at(name), mesh, MeshFormat::obj);
    write_mesh_sequence(at("one_other"), other, MeshFormat::obj);
    std::filesystem::copy_file(at("one_other") + "/frame_00001.obj", at(name) + "/frame_00002.obj",
                               std::filesystem::copy_options::overwrite_existing);
    std::filesystem::remove_all(at("one_other"));
  };
  with_second_frame("more_vertices", bending_tube(140, 1, 1.0));
  MeshSequence fewer = mesh, swapped = mesh;
  fewer.triangles.pop_back();
  std::swap(swapped.triangles[2], swapped.triangles[3]);
  with_second_frame("fewer_triangles", fewer);
  with_second_frame("another_order", swapped);
  for (const char* name : {"more_vertices", "fewer_triangles", "another_order"}) {
    for (const char* codec : {"mesh-harmonics", "mesh-pca", "mesh-draco"}) {
      const std::string message = fails({"encode", at(name), "-o", at("odd.ksm"), "--codec", codec}, 1);
      EXPECT_NE(message.find("frame_00002.obj"), std::string::npos) << message;
      EXPECT_NE(message.find("frame 1"), std::string::npos) << message;
      EXPECT_FALSE(std::filesystem::exists(at("odd.ksm")));
    }
  }
}

TEST_F(MeshCommand, functions_kept_in_a_library_change_nothing_but_the_time) {
  run({"encode", at("tube"), "-o", at("kept.ksm"), "--library", at("meshes.kspace")});
  const json plain = run({"decode", at("kept.ksm"), "-o", at("plain")});
  EXPECT_EQ(plain["basis_from_library"], false);
  EXPECT_GT(plain["basis_s"], 0);
  EXPECT_EQ(run({"decode", at("kept.ksm"), "-o", at("kept"), "--library", at("meshes.kspace")})["basis_from_library"],
            true);
  EXPECT_EQ(read_text(at("plain") + "/positions.npy"), read_text(at("kept") + "/positions.npy"));
  EXPECT_EQ(run({"compare", at("tube"), at("kept.ksm"), "--library", at("meshes.kspace")})["kg"],
            run({"compare", at("tube"), at("kept.ksm")})["kg"]);
  // A library that decode has to make; one that is none.
  EXPECT_EQ(run({"decode", at("kept.ksm"), "-o", at("kept2"), "--library", at("new.kspace")})["basis_from_library"],
            false);
  EXPECT_EQ(run({"decode", at("kept.ksm"), "-o", at("kept3"), "--library", at("new.kspace")})["basis_from_library"],
            true);
  EXPECT_NE(fails({"decode", at("kept.ksm"), "-o", at("kept4"), "--library", at("kept.ksm")}, 1).find("kept.ksm"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(at("kept4")));
}

TEST_F(MeshCommand, a_damaged_basis_in_the_library_is_noted_and_mended) {
  run({"encode", at("tube"), "-o", at("mended.ksm"), "--library", at("damaged.kspace")});
  {
    Library library = Library::open(at("damaged.kspace"));
    const std::string key = library.artifact_keys("mesh basis").at(0);
    Bytes blob = library.artifact("mesh basis", key).value();
    blob[blob.size() / 2] ^= std::byte{1};
    library.put_artifact("mesh basis", key, blob);
  }
  const std::vector<std::string> decode = {"mesh",       "decode",    at("mended.ksm"),    "-o",
                                           at("mended"), "--library", at("damaged.kspace")};
  const CommandResult first = run_command(decode);
  EXPECT_EQ(first.code, 0) << first.err;
  EXPECT_NE(first.err.find("damaged"), std::string::npos) << first.err;
  const CommandResult second = run_command(decode);
  EXPECT_EQ(second.code, 0);
  EXPECT_EQ(second.err.find("damaged.kspace"), std::string::npos) << second.err;
}

TEST_F(MeshCommand, wrong_input_is_told_by_name) {
  EXPECT_NE(fails({"info", at("nowhere")}, 1).find("nowhere"), std::string::npos);
  fails({"encode", at("tube"), "-o", at("x.ksm"), "--codec", "zip"}, 2);
  fails({"encode", at("tube"), "-o", at("x.ksm"), "--kg", "1", "--bytes", "500"}, 2);
  run({"encode", at("tube"), "-o", at("good.ksm"), "--kg", "1"});
  const std::string text = read_text(at("good.ksm"));
  write_text(at("bad.ksm"), text.substr(0, text.size() / 2));
  EXPECT_NE(fails({"decode", at("bad.ksm"), "-o", at("y")}, 1).find("bad.ksm"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(at("y")));
  write_mesh_sequence(at("other"), bending_tube(400, 12, 1.0));
  fails({"compare", at("tube"), at("other")}, 1);
}

}  // namespace
}  // namespace kinespace::test
