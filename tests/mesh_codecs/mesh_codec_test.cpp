// What the codecs of mesh sequences promise: targets met, one frame as all, the same bytes whatever the threads, and
// meshes of every kind.
#include "kinespace/mesh_codecs/mesh_codec.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh/rigid.h"
#include "kinespace/mesh_codecs/harmonics_analysis.h"
#include "kinespace/mesh_codecs/mesh_layout.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

MeshSequence tube() {
  return bending_tube(300, 12, 1.2);
}

MeshSequence decoded(const Bytes& stream) {
  return open_mesh_stream(stream, "s")->decode_all();
}

double kg_of(const MeshSequence& mesh, const Bytes& stream) {
  return compare(mesh, decoded(stream)).kg;
}

class MeshCodec : public testing::TestWithParam<std::string_view> {
 protected:
  [[nodiscard]] static Bytes encode(const MeshSequence& mesh, const MeshCodecOptions& options = {}) {
    return encode_mesh(GetParam(), mesh, options);
  }
};
INSTANTIATE_TEST_SUITE_P(All, MeshCodec, testing::ValuesIn(mesh_codecs().begin(), mesh_codecs().end()),
                         [](const auto& kind) {
                           std::string name(kind.param);
                           name[name.find('-')] = '_';
                           return name;
                         });

TEST_P(MeshCodec, errors_asked_for_are_met_and_told) {
  const MeshSequence mesh = tube();
  for (const double kg : {2.0, 0.3}) {
    const Bytes stream = encode(mesh, {.kg = kg});
    const double found = kg_of(mesh, stream);
    EXPECT_LE(found, kg);
    EXPECT_GT(found, 0.7 * kg);
    const auto reader = open_mesh_stream(stream, "s");
    EXPECT_NEAR(reader->stream().number_option("kg", 0, 100), found, 1e-4 * found);
    EXPECT_GT(reader->connectivity_bytes(), 0);
    EXPECT_LT(reader->connectivity_bytes(), static_cast<std::int64_t>(stream.size()));
  }
}

void expect_coarser_is_cheaper(const char* codec, MeshProfile profile, const std::vector<double>& targets) {
  const MeshSequence mesh = bending_tube(500, 12, 1.5);
  std::size_t finer = std::numeric_limits<std::size_t>::max();
  for (const double kg : targets) {
    const std::size_t bytes = encode_mesh(codec, mesh, {.kg = kg, .profile = profile}).size();
    EXPECT_LE(bytes, finer) << codec << " at " << kg;
    finer = bytes;
  }
}

// Not mesh-draco: Draco's own coding differs from grid to grid.
TEST(MeshCodecs, coarser_targets_cost_no_more_bytes) {
  expect_coarser_is_cheaper("mesh-harmonics", MeshProfile::standard, {0.15, 0.3, 0.6, 1.2, 2.4});
  expect_coarser_is_cheaper("mesh-harmonics", MeshProfile::paper, {0.3, 0.5, 0.7, 1.2, 2.4});
  expect_coarser_is_cheaper("mesh-pca", MeshProfile::standard, {0.15, 0.3, 0.6, 1.2, 2.4});
}

TEST_P(MeshCodec, bytes_asked_for_are_kept_to) {
  const MeshSequence mesh = tube();
  const auto usual = static_cast<std::int64_t>(encode(mesh, {.kg = 1.0}).size());
  for (const std::int64_t bytes : {usual, 2 * usual}) {
    const Bytes stream = encode(mesh, {.bytes = bytes});
    EXPECT_LE(static_cast<std::int64_t>(stream.size()), bytes);
    EXPECT_GT(static_cast<std::int64_t>(stream.size()), bytes * 7 / 10);
  }
  EXPECT_THROW(static_cast<void>(encode(mesh, {.bytes = 60})), Error);
}

TEST_P(MeshCodec, any_frame_alone_is_as_with_all) {
  const Bytes stream = encode(tube());
  const MeshSequence all = decoded(stream);
  for (const int f : {11, 0, 5}) {
    const MeshSequence one = open_mesh_stream(stream, "s")->decode(f, 1);
    EXPECT_TRUE(std::ranges::equal(one.frame(0), all.frame(f))) << f;
  }
  EXPECT_THROW(static_cast<void>(open_mesh_stream(stream, "s")->decode(12, 1)), Error);
}

TEST_P(MeshCodec, number_of_threads_changes_nothing) {
  Bytes first;
  std::vector<float> positions;
  for (const std::size_t threads : {1U, 2U, 5U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Bytes stream = encode(tube());
    const auto found = decoded(stream).positions;
    if (first.empty()) {
      first = stream;
      positions = found;
    }
    EXPECT_EQ(stream, first);
    EXPECT_EQ(found, positions);
  }
}

TEST_P(MeshCodec, name_rate_and_triangles_are_kept) {
  MeshSequence mesh = tube();
  mesh.name = "a tube";
  mesh.rate_hz = 25;
  const MeshSequence back = decoded(encode(mesh));
  EXPECT_EQ(back.name, "a tube");
  EXPECT_EQ(back.rate_hz, 25);
  EXPECT_EQ(back.triangles, canonical_triangles(mesh.triangles));
}

TEST_P(MeshCodec, static_sequences_cost_next_to_nothing_a_frame) {
  const MeshSequence one = bending_tube(300, 1, 0);
  MeshSequence still = one;
  for (still.frames = 1; still.frames < 40; ++still.frames) {
    still.positions.insert(still.positions.end(), one.positions.begin(), one.positions.end());
  }
  const Bytes stream = encode(still, {.kg = 0.5});
  EXPECT_LE(kg_of(still, stream), 0.5);
  const Bytes single = encode(one, {.kg = 0.5});
  EXPECT_LE(kg_of(one, single), 0.5);
  if (GetParam() != "mesh-draco") {
    EXPECT_LT(stream.size(), single.size() * 3 / 2);
  }
}

TEST_P(MeshCodec, components_and_isolated_vertices_are_kept) {
  MeshSequence mesh = joined(joined(tube(), sheet(9, 7, 12)), bending_tube(100, 12, 0.5));
  // A vertex without triangles, above the rest.
  MeshSequence with_point = mesh;
  with_point.vertices += 1;
  with_point.positions.clear();
  for (int f = 0; f < mesh.frames; ++f) {
    with_point.positions.insert(with_point.positions.end(), mesh.frame(f).begin(), mesh.frame(f).end());
    with_point.positions.insert(with_point.positions.end(), {1.0F, 2.0F + 0.1F * static_cast<float>(f), 0.5F});
  }
  const Bytes stream = encode(with_point, {.kg = 1.0});
  EXPECT_LE(kg_of(with_point, stream), 1.0);
}

TEST_P(MeshCodec, triangles_that_a_geometer_would_not_like_are_kept) {
  MeshSequence mesh = tube();
  mesh.triangles.push_back({3, 3, 7});          // degenerate
  mesh.triangles.push_back(mesh.triangles[5]);  // twice
  mesh.triangles.push_back({10, 150, 250});     // across
  const Triangle t = mesh.triangles[8];
  mesh.triangles.push_back({t[0], t[1], 200});  // a third one at an edge
  mesh.triangles.push_back({t[1], t[0], 100});
  const Bytes stream = encode(mesh, {.kg = 1.0});
  EXPECT_EQ(decoded(stream).triangles, canonical_triangles(mesh.triangles));
  EXPECT_LE(kg_of(mesh, stream), 1.0);
}

TEST_P(MeshCodec, meshes_without_triangles_and_single_points_are_kept) {
  MeshSequence cloud = tube();
  cloud.triangles.clear();
  EXPECT_LE(kg_of(cloud, encode(cloud, {.kg = 1.0})), 1.0);
  MeshSequence point;
  point.vertices = 1;
  point.frames = 3;
  point.positions = {0, 0, 0, 1, 0, 0, 2, 1, 0};
  const MeshSequence back = decoded(encode(point));
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(back.positions[i], point.positions[i], 0.01);
}

TEST_P(MeshCodec, nan_is_refused) {
  MeshSequence mesh = tube();
  mesh.positions[100] = std::numeric_limits<float>::quiet_NaN();
  try {
    static_cast<void>(encode(mesh));
    ADD_FAILURE() << "NaN was encoded";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  }
}

TEST_P(MeshCodec, options_out_of_range_are_refused) {
  const MeshSequence mesh = tube();
  for (const MeshCodecOptions& options :
       {MeshCodecOptions{.kg = 0.0}, MeshCodecOptions{.kg = 1.0, .bytes = 1000}, MeshCodecOptions{.bytes = -1},
        MeshCodecOptions{.bases = mesh.vertices + 1}, MeshCodecOptions{.clusters = 2}}) {
    try {
      static_cast<void>(encode(mesh, options));
      ADD_FAILURE() << "taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what();
    }
  }
}

TEST(MeshHarmonics, as_many_functions_as_vertices_are_allowed) {
  const MeshSequence mesh = bending_tube(60, 6, 0.5);
  const Bytes stream = encode_mesh("mesh-harmonics", mesh, {.kg = 1.0, .bases = mesh.vertices});
  EXPECT_LE(kg_of(mesh, stream), 1.0);
}

TEST(MeshHarmonics, rigid_motion_costs_little_more_than_standing_still) {
  const MeshSequence one = bending_tube(300, 1, 0);
  MeshSequence still = one;
  for (still.frames = 1; still.frames < 30; ++still.frames) {
    still.positions.insert(still.positions.end(), one.positions.begin(), one.positions.end());
  }
  const auto resting = encode_mesh("mesh-harmonics", still, {.kg = 0.5}).size();
  const MeshSequence moving = moved_rigidly(still, 0.1);
  const Bytes stream = encode_mesh("mesh-harmonics", moving, {.kg = 0.5});
  EXPECT_LE(kg_of(moving, stream), 0.5);
  EXPECT_LT(stream.size(), resting + 12 * 30);
}

TEST(MeshHarmonics, multi_resolution_keeps_to_the_error_or_says_that_it_cannot) {
  const MeshSequence mesh = bending_tube(2000, 8, 1.0);
  const Bytes stream = encode_mesh("mesh-harmonics", mesh, {.kg = 2.0, .bases = 100, .coarse_vertices = 500});
  EXPECT_LE(kg_of(mesh, stream), 2.0);
  EXPECT_THROW(
      static_cast<void>(encode_mesh("mesh-harmonics", mesh, {.kg = 0.001, .bases = 100, .coarse_vertices = 100})),
      Error);
}

TEST(MeshHarmonics, estimates_are_close_to_what_is_encoded_and_take_eigenvectors_too) {
  const MeshSequence mesh = bending_tube(900, 12, 1.5);
  const Progress silent;
  HarmonicsSettings settings{.key = 4, .functions = 120, .key_step = 0.01 * diagonal(mesh)};
  const HarmonicsAnalysis smooth(mesh, std::nullopt, settings, silent);
  settings.eigenvectors = true;
  const HarmonicsAnalysis eigenvectors(mesh, std::nullopt, settings, silent);
  const double step = 0.02 * diagonal(mesh);
  const auto estimate = smooth.estimate(step);
  const auto trial = smooth.encode(step);
  const auto bytes = static_cast<double>(estimate.bytes);
  EXPECT_NEAR(bytes, static_cast<double>(trial.attempt.bytes), 0.1 * bytes);
  const double error = std::sqrt(estimate.squared_error);
  EXPECT_NEAR(error, std::sqrt(trial.attempt.squared_error), 0.1 * error);
  EXPECT_LT(std::abs(std::log(eigenvectors.estimate(step).squared_error / estimate.squared_error)), 0.5);
}

TEST(MeshHarmonics, long_sequences_are_cut_into_blocks) {
  const MeshSequence mesh = bending_tube(60, 900, 1.5);
  const Bytes stream = encode_mesh("mesh-harmonics", mesh, {.kg = 1.0, .bases = 20});
  EXPECT_LE(kg_of(mesh, stream), 1.0);
  EXPECT_TRUE(open_mesh_stream(stream, "s")->stream().has_section("m2"));
}

// A still sequence of a million frames takes few bytes; a reader that believed any would be led to fill the memory.
TEST(MeshLayout, streams_are_long_enough_for_what_they_stand_for) {
  const MeshLayout layout{.name = "still", .rate_hz = 30, .vertices = 100, .frames = 1 << 20, .triangles = 0};
  ByteWriter described;
  put_layout(described, layout);
  const Bytes written = std::move(described).take();
  const auto read = [&](std::size_t bytes) {
    ByteReader in(written, "s");
    return get_layout(in, bytes).frames;
  };
  const Bytes stream = finish_mesh_stream(BitstreamWriter("mesh-codec:mesh-pca"), layout, 5'000'000);
  EXPECT_EQ(read(stream.size()), layout.frames);
  EXPECT_GE(most_mesh_numbers(stream.size()), 5'000'000);
  EXPECT_THROW(static_cast<void>(read(stream.size() / 2)), Error);
  const MeshLayout small{.name = "small", .rate_hz = 30, .vertices = 100, .frames = 1000, .triangles = 0};
  EXPECT_FALSE(
      Bitstream::parse(finish_mesh_stream(BitstreamWriter("mesh-codec:mesh-pca"), small), "s").has_section("padding"));
}

TEST(PaperProfile, bases_and_clusters_alone_drive_it) {
  const MeshSequence mesh = tube();
  const Bytes stream = encode_mesh("mesh-harmonics", mesh, {.profile = MeshProfile::paper, .bases = 60, .clusters = 3});
  const MeshSequence back = decoded(stream);
  EXPECT_LT(compare(mesh, back).kg, 3);
  EXPECT_TRUE(open_mesh_stream(stream, "s")->stream().has_section("q2"));
  const MeshSequence one = open_mesh_stream(stream, "s")->decode(7, 1);
  EXPECT_TRUE(std::ranges::equal(one.frame(0), back.frame(7)));
}

TEST(PaperProfile, without_a_target_it_spends_no_more_than_half_a_percent_asks_for) {
  // Fewer vertices than functions: exact coefficients would be next to free of error, and dear.
  const MeshSequence mesh = bending_tube(200, 12, 1.0);
  const Bytes stream = encode_mesh("mesh-harmonics", mesh, {.profile = MeshProfile::paper});
  EXPECT_LE(kg_of(mesh, stream), 0.5);
  EXPECT_GT(kg_of(mesh, stream), 0.3);
}

TEST(PaperProfile, number_of_threads_changes_nothing) {
  std::vector<Bytes> streams;
  std::vector<std::vector<float>> positions;
  for (const std::size_t threads : {1U, 3U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    streams.push_back(
        encode_mesh("mesh-harmonics", tube(), {.profile = MeshProfile::paper, .bases = 40, .clusters = 3}));
    positions.push_back(decoded(streams.back()).positions);
  }
  EXPECT_EQ(streams[0], streams[1]);
  EXPECT_EQ(positions[0], positions[1]);
}

TEST(PaperProfile, bytes_asked_for_are_kept_to_or_refused) {
  const MeshSequence mesh = tube();
  const auto at = [&](std::int64_t bytes) {
    return encode_mesh("mesh-harmonics", mesh, {.bytes = bytes, .profile = MeshProfile::paper, .bases = 100});
  };
  const auto usual = static_cast<std::int64_t>(
      encode_mesh("mesh-harmonics", mesh, {.kg = 0.6, .profile = MeshProfile::paper, .bases = 100}).size());
  for (const std::int64_t bytes : {usual, usual * 4 / 5}) EXPECT_LE(static_cast<std::int64_t>(at(bytes).size()), bytes);
  EXPECT_LT(kg_of(mesh, at(usual)), kg_of(mesh, at(usual * 4 / 5)));
  EXPECT_THROW(static_cast<void>(at(200)), Error);
}

TEST(PaperProfile, errors_asked_for_are_met_or_refused) {
  const MeshSequence mesh = tube();
  const Bytes stream = encode_mesh("mesh-harmonics", mesh, {.kg = 2.0, .profile = MeshProfile::paper});
  EXPECT_LE(kg_of(mesh, stream), 2.0);
  try {
    static_cast<void>(
        encode_mesh("mesh-harmonics", mesh, {.kg = 0.001, .profile = MeshProfile::paper, .bases = 10, .clusters = 1}));
    ADD_FAILURE() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what();
  }
}

}  // namespace
}  // namespace kinespace::test
