// Buffers in the file, beside it, and where no file has any business.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/mesh/mesh_files.h"
#include "tests/gltf/sample_gltf.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

namespace fs = std::filesystem;

// A folder `model/` for files, in one with a buffer that none of them may have.
class GltfBuffers : public testing::Test {
 protected:
  GltfBuffers() {
    fs::create_directory(model_);
    write_file_atomically(outside_, triangle_bytes());
  }

  std::string read(const std::string& uri) {
    write_file_atomically(model_ / "a.gltf", triangle_at(uri).dump());
    try {
      return read_mesh_sequence(model_ / "a.gltf").vertices == 3 ? "read" : "another mesh";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      return error.what();
    }
  }

  TemporaryFolder folder_;
  fs::path model_ = folder_ / "model", outside_ = folder_ / "outside.bin";
};

TEST_F(GltfBuffers, beside_the_file_are_read_under_whatever_name) {
  for (const auto& [name, uri] :
       {std::pair("a.bin", "a.bin"), std::pair("a.bin", "./a.bin"), std::pair("my walk.bin", "my%20walk.bin"),
        std::pair("my walk.bin", "my walk.bin"), std::pair("a+b.bin", "a+b.bin"), std::pair("100%.bin", "100%25.bin"),
        std::pair("100%.bin", "100%.bin"), std::pair("\xc3\xa4.bin", "%C3%a4.bin"),
        std::pair("data/a.bin", "data/a.bin")}) {
    fs::create_directories((model_ / name).parent_path());
    write_file_atomically(model_ / name, triangle_bytes());
    EXPECT_EQ(read(uri), "read") << uri;
    fs::remove(model_ / name);
  }
  write_file_atomically(model_ / "a.bin", triangle_bytes() + "and more");
  EXPECT_EQ(read("a.bin"), "read") << "more than is wanted";
  fs::create_symlink("a.bin", model_ / "link.bin");
  EXPECT_EQ(read("link.bin"), "read") << "a link within the folder";
}

TEST_F(GltfBuffers, outside_the_folder_are_never_read) {
  fs::create_symlink("../outside.bin", model_ / "link.bin");
  fs::create_directory_symlink("..", model_ / "up");
  for (const std::string& uri :
       {std::string("../outside.bin"), std::string("%2e%2e/outside.bin"), std::string("%2E%2E%2foutside.bin"),
        std::string("./x/../../outside.bin"), outside_.string(), "file://" + outside_.string(),
        "FILE:" + outside_.string(), std::string("http://localhost/outside.bin"), std::string("C:outside.bin"),
        std::string("link.bin"), std::string("up/outside.bin"), std::string("up/model/a.gltf/../../outside.bin")}) {
    EXPECT_THAT(read(uri), testing::HasSubstr("a file in the folder of the .gltf file")) << uri;
  }
}

TEST_F(GltfBuffers, that_cannot_be_had_are_errors) {
  using testing::HasSubstr;
  EXPECT_THAT(read("gone.bin"), HasSubstr("no file 'gone.bin' beside it"));
  EXPECT_THAT(read(""), HasSubstr("a buffer at ''"));
  EXPECT_THAT(read("a%00b.bin"), HasSubstr("a file in the folder"));
  EXPECT_THAT(read("."), HasSubstr("not a regular file"));
  write_file_atomically(model_ / "short.bin", triangle_bytes().substr(1));
  EXPECT_THAT(read("short.bin"), HasSubstr("43 bytes"));
  EXPECT_THAT(read("data:application/octet-stream,abc"), HasSubstr("base64"));
  EXPECT_THAT(read("data:;base64,AA!A"), HasSubstr("not base64"));
  EXPECT_THAT(read(data_uri(triangle_bytes().substr(1))), HasSubstr("a buffer of 43 bytes"));
  EXPECT_EQ(read("data:model/anything;base64," + base64_of(triangle_bytes())), "read");
}

TEST_F(GltfBuffers, count_as_input_where_memory_is_bounded) {
  nlohmann::json json = triangle_at("a.bin");
  json["buffers"][0]["byteLength"] = 9'000'000;
  json["bufferViews"].push_back(view_of(0, 9'000'000));
  json["accessors"][0] = accessor_of(2, 5126, 750'000, "VEC3");
  // 16 times the vertices that are there: 288 MB and more, which the .gltf file alone would not be worth.
  for (int i = 1; i < 16; ++i) {
    json["nodes"].push_back({{"mesh", 0}});
    if (json.contains("scenes")) json["scenes"][0]["nodes"].push_back(i);
  }
  write_file_atomically(model_ / "a.gltf", json.dump());
  write_file_atomically(model_ / "a.bin", std::string(9'000'000, '\0'));
  EXPECT_EQ(read_mesh_sequence(model_ / "a.gltf").vertices, 12'000'000);
}

}  // namespace
}  // namespace kinespace::test
