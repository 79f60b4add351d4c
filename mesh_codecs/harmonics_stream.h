// The parts of a mesh-harmonics stream of the standard profile.
//
//   setup                                  layout; grid of the key-frame; size of the mesh, step, functions, rotations
//                                          on or off, coarse counts
//   surface, order                         the key-frame (key_mesh.h)
//   coarse, coarse.surface, coarse.order   multi-resolution: which vertices stay, and their triangles
//   rigid                                  the motion of the whole (rigid_track.h)
//   m0, d0, m1, d1, ..                     by blocks of frames: coefficients of the functions, and residuals of the
//                                          vertices
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kinespace/mesh/decimation.h"
#include "kinespace/mesh_codecs/harmonics_space.h"
#include "kinespace/mesh_codecs/mesh_codec.h"
#include "kinespace/mesh_codecs/mesh_layout.h"
#include "kinespace/mesh_codecs/moving_part.h"
#include "kinespace/mesh_codecs/rigid_track.h"

namespace kinespace {

// Those rows of `all` that are kept, in their order.
[[nodiscard]] Points rows_of(const Points& all, std::span<const std::int32_t> kept);

inline constexpr int most_block_frames = 400;
// Blocks of nearly equal length.
struct FrameBlocks {
  int frames = 0;
  [[nodiscard]] int count() const { return (frames + most_block_frames - 1) / most_block_frames; }
  [[nodiscard]] int first(int block) const { return static_cast<int>(std::int64_t{frames} * block / count()); }
  [[nodiscard]] int size(int block) const { return first(block + 1) - first(block); }
  [[nodiscard]] int of(int frame) const;
};

struct HarmonicsSetup {
  MeshLayout layout;
  Grid grid;        // of the key-frame
  double size = 1;  // of the mesh: the grid of translations
  double step = 1;  // of coefficients and residuals
  int functions = 0;
  bool rotate = true;
  int coarse_vertices = 0;  // 0: all vertices are coded
  std::int64_t coarse_triangles = 0;
};
void put_setup(ByteWriter& out, const HarmonicsSetup& setup);
[[nodiscard]] HarmonicsSetup get_setup(std::span<const std::byte> bytes, std::uint64_t stream_bytes,
                                       const std::string& source);

void add_decimation(BitstreamWriter& out, const Decimation& decimation);
// Throws Error{bad_input}.
[[nodiscard]] Decimation read_decimation(const Bitstream& stream, const HarmonicsSetup& setup);

// What is shared by all frames, made from decoded parts.
struct HarmonicsParts {
  std::vector<Triangle> triangles;  // of the sequence, canonical
  Points key;                       // all vertices
  std::optional<Decimation> decimation;
};

// Frames from what was decoded.
class HarmonicsFrames {
 public:
  struct Block {
    MovingPart low, detail;  // of vertices
  };
  HarmonicsFrames(std::shared_ptr<const HarmonicsSpace> space, std::shared_ptr<const Refinement> refinement,
                  bool rotate)
      : space_(std::move(space)), refinement_(std::move(refinement)), rotate_(rotate) {}

  RigidTrack track;

  // `motion`: of the functions; what it moves of the vertices is summed up once, for all frames of the block.
  void add_block(const MovingPart& motion, MovingPart detail);

  [[nodiscard]] Points frame(int f) const;

 private:
  std::shared_ptr<const HarmonicsSpace> space_;
  std::shared_ptr<const Refinement> refinement_;
  bool rotate_;
  std::vector<Block> blocks_;
};

[[nodiscard]] std::unique_ptr<MeshStreamReader> open_harmonics(Bitstream stream, BasisCache* cache = nullptr);
// Of one block: key-frame coefficients plus what moves. `motion` has a node for each function.
[[nodiscard]] Coefficients coefficients_of(const Coefficients& key, const MovingPart& motion, int frame);

[[nodiscard]] Bytes encode_harmonics(const MeshSequence& mesh, const MeshCodecOptions& options);

}  // namespace kinespace
