// mesh-harmonics, standard profile: from the stream to frames.
#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh_codecs/harmonics_stream.h"

namespace kinespace {
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
