// Smooth functions of key-frames that are kept in a library: the same frames with and without, and damage to what is
// kept costs time only.
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/mesh_codecs/basis_cache.h"
#include "kinespace/mesh_codecs/mesh_codec.h"
#include "kinespace/storage/library.h"
#include "tests/mesh/sample_meshes.h"
#include "tests/support/data.h"
#include "tests/support/forged_stream.h"

namespace kinespace::test {
namespace {

constexpr const char* artifact_kind = "mesh basis";

struct CachedKind {
  std::string name;
  MeshCodecOptions options;
  int bases;  // that a stream of it needs
};

class MeshBasisCache : public testing::TestWithParam<CachedKind> {
 protected:
  [[nodiscard]] std::filesystem::path library() const { return folder_ / "meshes.kspace"; }
  [[nodiscard]] static Bytes stream() {
    return encode_mesh("mesh-harmonics", bending_tube(800, 6, 1.0), GetParam().options);
  }
  // The frames, by a cache of its own each time, as from one run to the next.
  std::vector<float> frames(const Bytes& stream) {
    BasisCache cache(library(), [this](const std::string& text) { warnings_.push_back(text); });
    const auto positions = open_mesh_stream(stream, "s", &cache)->decode_all().positions;
    found_ = cache.found();
    computed_ = cache.computed();
    return positions;
  }
  // Puts something else in the place of every basis that is kept.
  template <typename Change>
  void change_kept(const Change& change) {
    Library open = Library::open(library());
    const auto keys = open.artifact_keys(artifact_kind);
    EXPECT_FALSE(keys.empty());
    for (const std::string& key : keys) {
      Bytes blob = open.artifact(artifact_kind, key).value();
      change(blob);
      open.put_artifact(artifact_kind, key, blob);
    }
  }
  // All changed, all noticed, all mended.
  void expect_computed_anew(const Bytes& stream, const std::vector<float>& expected) {
    warnings_.clear();
    EXPECT_EQ(frames(stream), expected);
    EXPECT_EQ(computed_, GetParam().bases);
    EXPECT_EQ(warnings_.size(), static_cast<std::size_t>(GetParam().bases));
    EXPECT_EQ(frames(stream), expected);
    EXPECT_EQ(found_, GetParam().bases);
  }

  TemporaryFolder folder_;
  std::vector<std::string> warnings_;
  int found_ = 0, computed_ = 0;
};
INSTANTIATE_TEST_SUITE_P(All, MeshBasisCache,
                         testing::Values(CachedKind{"standard", {.kg = 1.0, .bases = 60}, 1},
                                         CachedKind{"coarse", {.kg = 4.0, .bases = 40, .coarse_vertices = 200}, 1},
                                         CachedKind{
                                             "paper", {.profile = MeshProfile::paper, .bases = 40, .clusters = 2}, 2}),
                         [](const auto& kind) { return kind.param.name; });

void mend_checksum(Bytes& blob) {
  const std::uint64_t sum = checksum64(std::span(blob).first(blob.size() - sizeof(std::uint64_t)));
  std::memcpy(blob.data() + blob.size() - sizeof sum, &sum, sizeof sum);
}

TEST_P(MeshBasisCache, opening_again_takes_no_solve_and_gives_the_same_frames) {
  const Bytes made = stream();
  const auto expected = open_mesh_stream(made, "s")->decode_all().positions;
  EXPECT_FALSE(std::filesystem::exists(library()));
  EXPECT_EQ(frames(made), expected);
  EXPECT_EQ(computed_, GetParam().bases);
  EXPECT_EQ(frames(made), expected);
  EXPECT_EQ(computed_, 0);
  EXPECT_EQ(found_, GetParam().bases);
  EXPECT_TRUE(warnings_.empty());
}

TEST_P(MeshBasisCache, damaged_bases_are_computed_anew_with_a_warning) {
  const Bytes made = stream();
  const auto expected = frames(made);
  for (const std::size_t at : {0U, 5U, 9U, 13U, 200U}) {
    change_kept([&](Bytes& blob) { blob[at] ^= std::byte{0x10}; });
    expect_computed_anew(made, expected);
    EXPECT_NE(warnings_.at(0).find("meshes.kspace"), std::string::npos) << warnings_.at(0);
  }
  for (const std::size_t size : {0U, 3U, 16U, 1000U}) {
    change_kept([&](Bytes& blob) { blob.resize(size); });
    expect_computed_anew(made, expected);
  }
  change_kept([](Bytes& blob) { blob.push_back(std::byte{0}); });
  expect_computed_anew(made, expected);
}

TEST_P(MeshBasisCache, numbers_that_no_basis_has_are_computed_anew_whatever_their_checksum) {
  const Bytes made = stream();
  const auto expected = frames(made);
  for (const double number : {std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    change_kept([&](Bytes& blob) {
      std::memcpy(blob.data() + blob.size() - 2 * sizeof number, &number, sizeof number);
      mend_checksum(blob);
    });
    expect_computed_anew(made, expected);
  }
}

TEST_P(MeshBasisCache, what_is_no_library_is_an_error) {
  const Bytes made = stream();
  write_file_atomically(library(), std::string_view("no library, but text of some length to look at"));
  try {
    static_cast<void>(frames(made));
    ADD_FAILURE() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_NE(std::string(error.what()).find("meshes.kspace"), std::string::npos) << error.what();
  }
}

TEST_P(MeshBasisCache, libraries_that_cannot_be_written_to_stop_nobody) {
  const Bytes made = stream();
  const auto expected = open_mesh_stream(made, "s")->decode_all().positions;
  BasisCache cache(folder_ / "no_such_folder" / "meshes.kspace",
                   [this](const std::string& text) { warnings_.push_back(text); });
  EXPECT_EQ(open_mesh_stream(made, "s", &cache)->decode_all().positions, expected);
  EXPECT_EQ(warnings_.size(), static_cast<std::size_t>(GetParam().bases));
}

TEST(MeshBasisCacheOfBoth, other_key_frames_and_other_numbers_of_functions_are_other_bases) {
  const TemporaryFolder folder;
  BasisCache cache(folder / "l.kspace");
  const MeshSequence tube = bending_tube(400, 1, 0.5);
  Points key = frame_points(tube, 0);
  const auto computed_for = [&](const Points& points, std::span<const Triangle> triangles, int functions) {
    const int before = cache.computed();
    const SmoothBasis basis = cache.smooth(points, triangles, functions);
    EXPECT_EQ(basis.functions, smooth_basis(points, triangles, {.functions = functions}).functions);
    return cache.computed() - before;
  };
  EXPECT_EQ(computed_for(key, tube.triangles, 20), 1);
  EXPECT_EQ(computed_for(key, tube.triangles, 21), 1);
  EXPECT_EQ(computed_for(key, std::span(tube.triangles).first(100), 20), 1);
  EXPECT_EQ(computed_for(key, tube.triangles, 20), 0);
  key(17, 1) = std::nextafter(key(17, 1), 10.0);
  EXPECT_EQ(computed_for(key, tube.triangles, 20), 1);
  EXPECT_EQ(cache.found(), 1);
}

// What another build would find: the stream asks for a checksum that nobody's harmonics have.
TEST(MeshBasisCacheOfBoth, harmonics_with_another_checksum_are_not_kept) {
  const TemporaryFolder folder;
  const Bytes stream = encode_mesh("mesh-harmonics", bending_tube(200, 5, 1.0),
                                   {.profile = MeshProfile::paper, .bases = 30, .clusters = 1});
  Bytes setup = part(stream, "setup");
  setup.back() ^= std::byte{1};
  const Bytes other = forged(stream, "setup", setup);
  BasisCache cache(folder / "l.kspace");
  EXPECT_THROW(static_cast<void>(open_mesh_stream(other, "s", &cache)), Error);
  EXPECT_FALSE(std::filesystem::exists(folder / "l.kspace"));
}

}  // namespace
}  // namespace kinespace::test
