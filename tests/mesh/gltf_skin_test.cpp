// Skinned glTF, made by the writer of clips: octahedra that hang on joints, each from its joint to the next.
#include <algorithm>

#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/base/error.h"
#include "kinespace/mesh/detail/mesh_formats.h"
#include "kinespace/mesh/mesh_report.h"
#include "kinespace/motion/gltf.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace::test {
namespace {

// Distance from a point to the nearest vertex of a frame.
double distance_to(const Points& vertices, const Eigen::Vector3d& p) {
  return std::sqrt((vertices.rowwise() - p.transpose()).rowwise().squaredNorm().minCoeff());
}

TEST(SkinnedMesh, follows_the_joints_in_every_frame) {
  const Clip clip = make_walk({}).clip;
  for (const GltfForm form : {GltfForm::text, GltfForm::binary}) {
    const MeshSequence mesh = parse_gltf_mesh(format_gltf(clip, form), "walk.glb", {});
    ASSERT_EQ(mesh.frames, clip.frames);
    EXPECT_NEAR(mesh.rate_hz, clip.rate_hz, 1e-6);
    EXPECT_EQ(mesh.vertices % 6, 0);
    EXPECT_EQ(mesh.triangles.size(), static_cast<std::size_t>(mesh.vertices) / 6 * 8);
    const JointPositions joints = joint_positions(clip);
    for (const int f : {0, clip.frames / 3, clip.frames - 1}) {
      const Points vertices = frame_points(mesh, f);
      for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
        EXPECT_LT(distance_to(vertices, joints.at(f, j) * 0.01), 1e-4) << "joint " << j << ", frame " << f;
      }
    }
  }
}

TEST(SkinnedMesh, is_sampled_at_the_rate_asked_for) {
  const Clip clip = make_walk({}).clip;
  const MeshSequence mesh =
      parse_gltf_mesh(format_gltf(clip, GltfForm::binary), "walk.glb", {.rate_hz = clip.rate_hz / 2});
  EXPECT_NEAR(mesh.frames, (clip.frames + 1) / 2, 1);
  const MeshSequence all = parse_gltf_mesh(format_gltf(clip, GltfForm::binary), "walk.glb", {});
  EXPECT_LT((frame_points(mesh, 5) - frame_points(all, 10)).cwiseAbs().maxCoeff(), 1e-5);
}

}  // namespace
}  // namespace kinespace::test
