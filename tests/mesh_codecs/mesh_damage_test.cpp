// Streams of mesh sequences with any bytes in them: an error that names the file, or frames; never more memory than the
// stream's size explains.
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh_codecs/mesh_codec.h"
#include "kinespace/mesh_codecs/mesh_layout.h"
#include "kinespace/storage/varint.h"
#include "tests/mesh/sample_meshes.h"
#include "tests/support/allocation_meter.h"
#include "tests/support/forged_stream.h"

namespace kinespace::test {
namespace {

constexpr std::size_t base_memory = std::size_t{64} << 20;
constexpr std::size_t memory_a_byte = 16;

bool decodes(std::span<const std::byte> bytes) {
  const AllocationMeter meter;
  bool good = false;
  std::size_t frame_bytes = 0;
  try {
    const auto reader = open_mesh_stream(bytes, "damaged.ksm");
    frame_bytes = reader->layout().frame_size() * sizeof(double);
    const int frames = reader->layout().frames;
    for (int f = 0; f < frames; f += 1 + frames / 50) {
      EXPECT_TRUE(reader->frame(f).allFinite());
    }
    good = true;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
    EXPECT_NE(std::string(error.what()).find("damaged.ksm"), std::string::npos) << error.what();
  }
  EXPECT_LE(meter.peak(), memory_a_byte * bytes.size() + base_memory + 8 * frame_bytes);
  return good;
}

struct DamagedKind {
  std::string name;
  std::string codec;
  MeshCodecOptions options;
};
const std::vector<DamagedKind>& damaged_kinds() {
  static const std::vector<DamagedKind> all{
      {"standard", "mesh-harmonics", {.kg = 1.0, .bases = 40}},
      {"coarse", "mesh-harmonics", {.kg = 4.0, .bases = 40, .coarse_vertices = 120}},
      {"paper", "mesh-harmonics", {.profile = MeshProfile::paper, .bases = 40, .clusters = 2}},
      {"pca", "mesh-pca", {.kg = 1.0}},
      {"draco", "mesh-draco", {.kg = 1.0}}};
  return all;
}

// The stream with another number of functions in its setup, under a checksum that fits.
Bytes with_functions(const Bytes& stream, int functions) {
  const Bytes setup = part(stream, "setup");
  ByteReader in(setup, "s");
  ByteWriter out;
  put_layout(out, get_layout(in, stream.size()));
  put_grid(out, get_grid(in));
  out.put(in.get<double>());
  out.put(in.get<double>());
  static_cast<void>(get_varint(in));
  put_varint(out, static_cast<std::uint64_t>(functions));
  out.put_bytes(in.take(in.remaining()));
  return forged(stream, "setup", std::move(out).take());
}

class MeshDamage : public testing::TestWithParam<DamagedKind> {
 protected:
  [[nodiscard]] static const Bytes& stream() {
    static std::map<std::string, Bytes, std::less<>> made;
    Bytes& out = made[GetParam().name];
    if (out.empty()) {
      const MeshSequence mesh = joined(bending_tube(200, 5, 1.0), sheet(6, 5, 5));
      out = encode_mesh(GetParam().codec, mesh, GetParam().options);
    }
    return out;
  }
};
INSTANTIATE_TEST_SUITE_P(All, MeshDamage, testing::ValuesIn(damaged_kinds()),
                         [](const auto& kind) { return kind.param.name; });

TEST_P(MeshDamage, every_prefix_is_an_error) {
  ASSERT_TRUE(decodes(stream()));
  for (std::size_t n = 0; n < stream().size(); ++n) {
    EXPECT_FALSE(decodes(std::span(stream()).first(n))) << n;
  }
}

TEST_P(MeshDamage, every_flipped_byte_is_noticed) {
  Bytes changed = stream();
  const std::size_t step = GetParam().name == "paper" ? 11 : 1;  // some damage shows behind the eigenproblems only
  for (std::size_t n = 0; n < changed.size(); n += n < 64 ? 1 : step) {
    const std::byte flip{static_cast<unsigned char>(1U << (n % 8))};
    changed[n] ^= flip;
    EXPECT_FALSE(decodes(changed)) << n;
    changed[n] ^= flip;
  }
  changed.push_back(std::byte{0});
  EXPECT_FALSE(decodes(changed));
}

// Draco's part byte by byte: it has no checksums of its own, and Draco must not be trusted with what it claims.
TEST_P(MeshDamage, every_byte_of_the_draco_part_may_be_flipped) {
  const std::string name = GetParam().codec == "mesh-draco" ? "f0" : "surface";
  const Bytes whole = part(stream(), name);
  ASSERT_EQ(std::string(reinterpret_cast<const char*>(whole.data()), 5), "DRACO");
  const std::size_t step = GetParam().name == "paper" ? 3 : 1;
  int errors = 0;
  for (std::size_t n = 0; n < whole.size(); n += step) {
    Bytes changed = whole;
    changed[n] ^= std::byte{static_cast<unsigned char>(1U << (n % 8))};
    errors += decodes(forged(stream(), name, changed)) ? 0 : 1;
  }
  EXPECT_GT(errors, static_cast<int>(whole.size() / step / 4));
}

// Draco's part among them.
TEST_P(MeshDamage, forged_parts_with_fitting_checksums_are_errors_or_frames) {
  ASSERT_TRUE(decodes(forged(stream(), "", {})));
  const std::size_t steps = GetParam().name == "paper" ? 8 : 40;  // each opening solves eigenproblems
  int errors = 0;
  for (const std::string& name : parts_of(stream())) {
    const Bytes whole = part(stream(), name);
    for (std::size_t n = 0; n < whole.size(); n += 1 + whole.size() / steps) {
      for (const auto mask : {std::byte{0x21}, std::byte{0x80}, std::byte{0xff}}) {
        Bytes changed = whole;
        changed[n] ^= mask;
        errors += decodes(forged(stream(), name, changed)) ? 0 : 1;
      }
      Bytes shorter = whole;
      shorter.resize(n);
      errors += decodes(forged(stream(), name, shorter)) ? 0 : 1;
    }
    errors += decodes(forged(stream(), name, Bytes(64, std::byte{0xff}))) ? 0 : 1;
  }
  EXPECT_GT(errors, 10);
}

TEST(MeshDamageOfBasis, a_checksum_that_does_not_match_is_an_error) {
  const MeshSequence mesh = bending_tube(200, 5, 1.0);
  const Bytes stream = encode_mesh("mesh-harmonics", mesh, {.profile = MeshProfile::paper, .bases = 30, .clusters = 1});
  Bytes setup = part(stream, "setup");
  setup.back() ^= std::byte{1};  // the checksum stands last
  const Bytes other = forged(stream, "setup", setup);
  try {
    static_cast<void>(open_mesh_stream(other, "s"));
    ADD_FAILURE() << "decoded";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_NE(std::string(error.what()).find("checksum"), std::string::npos) << error.what();
  }
}

// A basis is what a stream may ask most memory for: vertices times functions. As many functions as there are vertices
// are an honest stream's right, up to most_mesh_numbers; opening must hold no more than three tables of that size.
TEST(MeshDamageOfBasis, memory_for_functions_is_bounded_by_the_size_of_the_stream) {
  for (const MeshProfile profile : {MeshProfile::standard, MeshProfile::paper}) {
    const MeshSequence mesh = bending_tube(profile == MeshProfile::paper ? 700 : 1600, 3, 1.0);
    const Bytes stream = encode_mesh("mesh-harmonics", mesh, {.kg = 5.0, .profile = profile, .bases = 12});
    const auto most = static_cast<std::size_t>(most_mesh_numbers(stream.size()));
    const AllocationMeter meter;
    static_cast<void>(decodes(with_functions(stream, mesh.vertices)));
    const auto numbers = static_cast<std::size_t>(mesh.vertices) * static_cast<std::size_t>(mesh.vertices);
    ASSERT_LE(numbers, most);
    EXPECT_LE(meter.peak(), 3 * sizeof(double) * numbers + (std::size_t{8} << 20));
  }
}

TEST(MeshDamageOfBasis, more_functions_than_the_size_of_the_stream_explains_are_refused_before_memory_is_taken) {
  const MeshSequence mesh = bending_tube(6000, 2, 1.0);
  const Bytes stream = encode_mesh("mesh-harmonics", mesh, {.kg = 20.0, .bases = 8});
  const auto vertices = static_cast<std::int64_t>(mesh.vertices);
  ASSERT_GT(vertices * vertices, most_mesh_numbers(stream.size()));
  const AllocationMeter meter;
  try {
    static_cast<void>(open_mesh_stream(with_functions(stream, mesh.vertices), "s"));
    ADD_FAILURE() << "opened";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_NE(std::string(error.what()).find("functions"), std::string::npos) << error.what();
  }
  EXPECT_LE(meter.peak(), std::size_t{1} << 20);
}

TEST(MeshDamageOfBasis, streams_of_other_kinds_are_refused) {
  BitstreamWriter writer("codec:qbc");
  const Bytes stream = writer.finish();
  EXPECT_FALSE(is_mesh_stream(stream));
  EXPECT_THROW(static_cast<void>(open_mesh_stream(stream, "s")), Error);
}

}  // namespace
}  // namespace kinespace::test
