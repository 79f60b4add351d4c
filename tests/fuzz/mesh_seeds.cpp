// kinespace_mesh_seeds FOLDER: small valid files for the fuzzing of each reader of meshes, in
// FOLDER/kinespace_fuzz_read_NAME/.
#include <cstdio>
#include <filesystem>
#include <string>

#include "examples/sample_motions.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/mesh/detail/mesh_formats.h"
#include "kinespace/motion/gltf.h"
#include "tests/gltf/sample_gltf.h"
#include "tests/mesh/sample_meshes.h"

namespace {

using namespace kinespace;

void write_all(const std::filesystem::path& folder) {
  int number = 0;
  const auto put = [&](const char* reader, const std::string& bytes) {
    const auto target = folder / (std::string("kinespace_fuzz_read_") + reader);
    std::filesystem::create_directories(target);
    write_file_atomically(target / ("seed" + std::to_string(number++)), bytes);
  };
  for (const MeshSequence& mesh : {test::sheet(3, 2, 1), test::sheet(4, 3, 3), test::bending_tube(40, 2, 1.0)}) {
    put("obj", format_obj(mesh.frame(0), mesh.triangles));
    put("ply", format_ply(mesh.frame(0), mesh.triangles));
    put("npy", std::string(1, 0) + format_numpy_positions(mesh));
    put("npy", std::string(1, 1) + format_numpy_triangles(mesh.triangles));
    put("gltf", format_gltf_mesh(mesh, false));
    put("glb", format_gltf_mesh(mesh, true));
  }
  put("obj", "# polygons\nv 0 0 0 1\nv 1 0 0\r\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1/1/1 2//1 3 4\nf -4 -3 -2\n");
  put("ply",
      "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty double x\nproperty short y\nproperty "
      "uchar z\nelement face 1\nproperty list uchar ushort vertex_index\nend_header\n" +
          std::string("\0\0\0\0\0\0\0\0\0\0\0\3\0\0\0\0\0\0", 18));
  nlohmann::json dressed = test::triangle();
  dressed["extensionsRequired"] = {"KHR_mesh_quantization"};
  dressed["materials"] = {{{"name", "red"}, {"extras", {{"a", {1, true, nullptr}}}}}};
  dressed["images"] = {{{"uri", "a.png"}}};
  dressed["accessors"][0]["sparse"] = {
      {"count", 1}, {"indices", {{"bufferView", 1}, {"componentType", 5123}}}, {"values", {{"bufferView", 0}}}};
  put("gltf", dressed.dump());
  dressed["buffers"][0].erase("uri");
  put("glb", test::glb_of(dressed.dump(), test::triangle_bytes()));
  const Clip walk = slice(make_walk({}).clip, 0, 3);  // a skin, joints, an animation
  put("gltf", format_gltf(walk, GltfForm::text));
  put("glb", format_gltf(walk, GltfForm::binary));
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fputs("usage: kinespace_mesh_seeds FOLDER\n", stderr);
    return 2;
  }
  write_all(argv[1]);
  return 0;
} catch (const kinespace::Error& error) {
  std::fprintf(stderr, "kinespace_mesh_seeds: %s\n", error.what());
  return static_cast<int>(error.kind());
}
