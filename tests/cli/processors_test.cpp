// What docs/command.md promises of other processors: the matrix library computes with other kernels there, whose last
// bits differ; lists are the same all the same, and exports are to a millionth of a centimetre.
#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

// The oldest kernels that OpenBLAS has for x86-64 run on every such processor; the other run takes this one's own.
TEST(Processors, lists_are_equal_and_exports_within_a_millionth_of_a_centimetre) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "clips");
  std::vector<std::string> names;
  for (const SampleMotion& motion : sample_library({.takes = 1})) {
    write_clip(folder.path() / "clips" / (motion.clip.name + ".bvh"), motion.clip);
    names.push_back(motion.clip.name);
  }
  const CommandOptions oldest{.environment = {"OPENBLAS_CORETYPE=Prescott"}};
  const auto path = [&](const std::string& name) { return (folder.path() / name).string(); };
  const auto run = [&](const std::vector<std::string>& words, const CommandOptions& options) {
    const CommandResult result = run_command(words, options);
    EXPECT_EQ(result.code, 0) << result.err;
    return result.out;
  };
  run({"build", path("clips"), "-o", path("own.kspace")}, {});
  run({"build", path("clips"), "-o", path("oldest.kspace")}, oldest);
  for (std::size_t i = 0; i < names.size(); i += 5) {
    SCOPED_TRACE(names[i]);
    EXPECT_EQ(run({"query", path("own.kspace"), names[i], "-k", "8"}, {}),
              run({"query", path("oldest.kspace"), names[i], "-k", "8"}, oldest));
    run({"export", path("own.kspace"), names[i], "-o", path("own.bvh"), "--lod", "8"}, {});
    run({"export", path("oldest.kspace"), names[i], "-o", path("oldest.bvh"), "--lod", "8"}, oldest);
    EXPECT_LT(compare(read_clip(folder / "own.bvh"), read_clip(folder / "oldest.bvh")).max_joint_error_cm, 1e-6);
  }
}

}  // namespace
}  // namespace kinespace::test
