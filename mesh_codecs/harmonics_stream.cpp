#include "kinespace/mesh_codecs/harmonics_stream.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/entropy/integer_coder.h"

namespace kinespace {
namespace {

KeyMesh flat_mesh(int vertices, std::vector<Triangle> triangles) {
  KeyMesh out{.vertices = vertices, .triangles = std::move(triangles), .keys = {}};
  out.keys.emplace_back(static_cast<std::size_t>(vertices));
  return out;
}

}  // namespace

Points rows_of(const Points& all, std::span<const std::int32_t> kept) {
  Points out(static_cast<Eigen::Index>(kept.size()), 3);
  for (std::size_t i = 0; i < kept.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = all.row(kept[i]);
  return out;
}

int FrameBlocks::of(int frame) const {
  int block = static_cast<int>(std::int64_t{frame} * count() / frames);
  while (first(block) > frame) --block;
  while (first(block + 1) <= frame) ++block;
  return block;
}

void put_setup(ByteWriter& out, const HarmonicsSetup& setup) {
  put_layout(out, setup.layout);
  put_grid(out, setup.grid);
  out.put(setup.size);
  out.put(setup.step);
  put_varint(out, static_cast<std::uint64_t>(setup.functions));
  out.put(static_cast<std::uint8_t>(setup.rotate ? 1 : 0));
  put_varint(out, static_cast<std::uint64_t>(setup.coarse_vertices));
  if (setup.coarse_vertices > 0) put_varint(out, static_cast<std::uint64_t>(setup.coarse_triangles));
}

HarmonicsSetup get_setup(std::span<const std::byte> bytes, std::uint64_t stream_bytes, const std::string& source) {
  ByteReader in(bytes, source);
  HarmonicsSetup out;
  out.layout = get_layout(in, stream_bytes);
  out.grid = get_grid(in);
  out.size = get_number(in, 0, 1e13);
  out.step = get_number(in, 1e-300, 1e13);
  const std::uint64_t functions = get_varint(in);
  const auto rotate = in.get<std::uint8_t>();
  const std::uint64_t coarse = get_varint(in);
  const bool decimated = coarse > 0;
  const std::uint64_t coded = decimated ? coarse : static_cast<std::uint64_t>(out.layout.vertices);
  const std::uint64_t triangles = decimated ? get_varint(in) : 0;
  if (rotate > 1 || functions < 1 || coded > static_cast<std::uint64_t>(out.layout.vertices) || functions > coded ||
      functions * coded > static_cast<std::uint64_t>(most_mesh_numbers(stream_bytes)) ||
      triangles > static_cast<std::uint64_t>(out.layout.triangles)) {
    in.fail(std::to_string(functions) + " functions on " + std::to_string(coded) + " vertices",
            "what the encoder writes (damaged)");
  }
  in.expect_end();
  out.functions = static_cast<int>(functions);
  out.rotate = rotate == 1;
  out.coarse_vertices = static_cast<int>(coarse);
  out.coarse_triangles = static_cast<std::int64_t>(triangles);
  return out;
}

void add_decimation(BitstreamWriter& out, const Decimation& decimation) {
  IntegerWriter kept;
  std::int32_t next = 0;
  std::int64_t gap = 0;
  for (const std::int32_t v : decimation.kept) {
    const int context = static_cast<int>(std::min<std::int64_t>(gap, 4));
    gap = v - next;
    kept.put(gap, context);
    next = v + 1;
  }
  const auto packed = pack_key_mesh(flat_mesh(static_cast<int>(decimation.kept.size()), decimation.triangles));
  out.add_section("coarse", std::move(kept).finish());
  out.add_section("coarse.surface", packed.surface);
  out.add_section("coarse.order", packed.order);
}

Decimation read_decimation(const Bitstream& stream, const HarmonicsSetup& setup) {
  Decimation out;
  IntegerReader in(stream.section("coarse"), stream.source());
  std::int64_t next = 0, gap = 0;
  for (int v = 0; v < setup.coarse_vertices; ++v) {
    gap = in.get_between(0, setup.layout.vertices - 1 - next, static_cast<int>(std::min<std::int64_t>(gap, 4)));
    out.kept.push_back(static_cast<std::int32_t>(next + gap));
    next += gap + 1;
  }
  in.expect_end();
  out.triangles = unpack_key_mesh(stream.section("coarse.surface"), stream.section("coarse.order"),
                                  setup.coarse_vertices, setup.coarse_triangles, 1, stream.source())
                      .triangles;
  return out;
}

Coefficients coefficients_of(const Coefficients& key, const MovingPart& motion, int frame) {
  std::vector<double> moved(static_cast<std::size_t>(motion.nodes) * 3);
  motion.add(frame, moved);
  Coefficients out = key;
  for (int k = 0; k < motion.nodes; ++k) {
    for (int d = 0; d < 3; ++d) out(k, d) += moved[static_cast<std::size_t>(3 * k + d)];
  }
  return out;
}

void HarmonicsFrames::add_block(const MovingPart& motion, MovingPart detail) {
  const auto vertices = static_cast<std::size_t>(space_->vertices());
  const auto components = static_cast<std::size_t>(motion.functions.cols());
  MovingPart low{.functions = motion.functions, .weights = {}, .nodes = space_->vertices()};
  low.weights.resize(components * vertices * 3);
  parallel_for(std::size_t{0}, components, [&](std::size_t r) {
    Coefficients c(motion.nodes, 3);
    const float* const row = motion.weights.data() + r * static_cast<std::size_t>(motion.nodes) * 3;
    for (int k = 0; k < motion.nodes; ++k) {
      for (int d = 0; d < 3; ++d) c(k, d) = static_cast<double>(row[3 * k + d]);
    }
    const Points moved = space_->projection().synthesise(c);
    float* out = low.weights.data() + r * vertices * 3;
    for (Eigen::Index v = 0; v < moved.rows(); ++v) {
      for (Eigen::Index d = 0; d < 3; ++d) *out++ = static_cast<float>(moved(v, d));
    }
  });
  blocks_.push_back({std::move(low), std::move(detail)});
}

Points HarmonicsFrames::frame(int f) const {
  const FrameBlocks split{static_cast<int>(track.steps.size())};
  const int b = split.of(f);
  const Block& block = blocks_[static_cast<std::size_t>(b)];
  const int at = f - split.first(b);
  std::vector<double> numbers(static_cast<std::size_t>(space_->vertices()) * 3);
  block.low.add(at, numbers);
  Points low = space_->key_low();
  for (Eigen::Index v = 0; v < low.rows(); ++v) {
    for (Eigen::Index d = 0; d < 3; ++d) low(v, d) += numbers[static_cast<std::size_t>(3 * v + d)];
  }
  if (block.detail.functions.cols() > 0) {
    std::fill(numbers.begin(), numbers.end(), 0.0);
    block.detail.add(at, numbers);
  } else {
    numbers.clear();
  }
  Points x = space_->frame(low, rotate_, numbers);
  if (refinement_) x = refinement_->apply(x);
  return track.motion(static_cast<std::size_t>(f)).apply(x);
}

// mesh-harmonics, standard profile: from the stream to frames.

namespace {

class HarmonicsReader final : public MeshStreamReader {
 public:
  HarmonicsReader(Bitstream stream, BasisCache* cache) : stream_(std::move(stream)) {
    const HarmonicsSetup setup = get_setup(stream_.section("setup"), stream_.size(), stream_.source());
    KeyMesh mesh = unpack_key_mesh(stream_.section("surface"), stream_.section("order"), setup.layout.vertices,
                                   setup.layout.triangles, 1, stream_.source());
    const Points key = setup.grid.points(mesh.keys[0]);
    std::shared_ptr<const HarmonicsSpace> space;
    std::shared_ptr<const Refinement> refinement;
    const auto start = std::chrono::steady_clock::now();
    if (setup.coarse_vertices > 0) {
      const Decimation decimation = read_decimation(stream_, setup);
      refinement = std::make_shared<Refinement>(key, mesh.triangles, decimation);
      space =
          std::make_shared<HarmonicsSpace>(rows_of(key, decimation.kept), decimation.triangles, setup.functions, cache);
    } else {
      space = std::make_shared<HarmonicsSpace>(key, mesh.triangles, setup.functions, cache);
    }
    basis_seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    layout_ = empty_sequence(setup.layout, std::move(mesh.triangles));
    frames_.emplace(space, refinement, setup.rotate);
    frames_->track = unpack_track(stream_.section("rigid"), setup.layout.frames, setup.size, stream_.source());
    read_blocks(*space, setup);
  }

  [[nodiscard]] const Bitstream& stream() const override { return stream_; }
  [[nodiscard]] const MeshSequence& layout() const override { return layout_; }
  [[nodiscard]] Points frame(int f) const override { return frames_->frame(f); }
  [[nodiscard]] std::int64_t connectivity_bytes() const override {
    return stream_.integer_option("connectivity", 0, std::int64_t{1} << 40);
  }
  [[nodiscard]] double basis_seconds() const override { return basis_seconds_; }

 private:
  void read_blocks(const HarmonicsSpace& space, const HarmonicsSetup& setup) {
    const FrameBlocks split{setup.layout.frames};
    std::int64_t room = most_mesh_numbers(stream_.size());  // for all blocks together
    for (int b = 0; b < split.count(); ++b) {
      const std::string number = std::to_string(b);
      const MovingPart motion = decode_part(stream_.section(fmt::format("m{}", number)), split.size(b),
                                            space.function_graph(), setup.step, room, stream_.source());
      room -= motion.functions.cols() * space.vertices() * 3;
      MovingPart detail = decode_part(stream_.section(fmt::format("d{}", number)), split.size(b), space.vertex_graph(),
                                      setup.step, std::max<std::int64_t>(room, 0), stream_.source());
      room -= detail.functions.cols() * space.vertices() * 3;
      if (room < 0) {
        throw Error(ErrorKind::bad_input, {.file = stream_.source(),
                                           .found = "more components than so few bytes can fill",
                                           .expected = "what the encoder writes (damaged)"});
      }
      frames_->add_block(motion, std::move(detail));
    }
  }

  Bitstream stream_;
  MeshSequence layout_;
  std::optional<HarmonicsFrames> frames_;
  double basis_seconds_ = 0;
};

}  // namespace

std::unique_ptr<MeshStreamReader> open_harmonics(Bitstream stream, BasisCache* cache) {
  return std::make_unique<HarmonicsReader>(std::move(stream), cache);
}

}  // namespace kinespace
