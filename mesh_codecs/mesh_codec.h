// What every codec of mesh sequences does: a sequence to a stream, a stream to frames.
//
// A stream is a Bitstream (storage/bitstream.h) whose kind is "mesh-codec:" and the codec's name. Its header says how
// far the decoded frames are from what was encoded (mesh/mesh_error.h), measured, never estimated: options kg, kg_time
// and lr.
//
//   mesh-harmonics  a key-frame, smooth functions on it, and what moves in their coordinates (chen2019)
//   mesh-pca        principal components of the vertices' paths (CoDDyAC, vasa and skala 2007), to compare with
//   mesh-draco      each frame by itself with Draco, to compare with
//
// Decoded sequences have the vertices of the original in its order and its triangles in another order, each turned so
// that its lowest vertex comes first; compare() does not mind. Positions are rounded to 32-bit floats. Triangles of any
// kind are kept: degenerate, duplicate, non-manifold; so are vertices without triangles.
//
// A stream decodes to the same bits on every machine, with any number of threads; but for `profile paper`, whose
// eigenvectors another build may compute otherwise: then the reader says so (a checksum) instead of decoding.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/base/progress.h"
#include "kinespace/mesh/mesh_sequence.h"
#include "kinespace/storage/bitstream.h"

namespace kinespace {

class BasisCache;  // mesh_codecs/basis_cache.h

enum class MeshProfile : std::uint8_t {
  standard,  // one key-frame, smooth basis, principal components or cosines over time, coded residual
  paper,     // chen2019: clusters, manifold harmonics of each key-frame, linear prediction, deformation transfer
};

struct MeshCodecOptions {
  static constexpr double usual_kg = 0.5;  // percent

  // What the stream must keep to; at most one of the two. Neither: `usual_kg`; where bases or clusters of the paper's
  // profile are given, what these allow.
  std::optional<double> kg;           // percent, 0.001 to 50
  std::optional<std::int64_t> bytes;  // of the whole stream, > 0

  // mesh-harmonics only.
  MeshProfile profile = MeshProfile::standard;
  // K: smooth functions, 1 to the number of vertices (of the coarse mesh, with multi-resolution; more are cut to it);
  // 0: chosen by the codec.
  int bases = 0;
  int clusters = 0;  // J: key-frames, 1 to the number of frames; 0: one. More than one: profile paper only.
  // Multi-resolution: the frames are coded on about so many vertices, 4 or more, and the others follow them by the
  // key-frame; 0: all vertices are coded. Cheaper for meshes of far more than 10 000 vertices.
  int coarse_vertices = 0;

  Progress progress;

  // Throws Error{usage} naming field, value and legal range.
  void validate(const MeshSequence& mesh) const;
};

// An open stream. Decoding is safe from several threads.
class MeshStreamReader {
 public:
  virtual ~MeshStreamReader() = default;
  MeshStreamReader() = default;
  MeshStreamReader(const MeshStreamReader&) = delete;
  MeshStreamReader& operator=(const MeshStreamReader&) = delete;

  [[nodiscard]] virtual const Bitstream& stream() const = 0;
  // Name, rate, counts and triangles; without positions.
  [[nodiscard]] virtual const MeshSequence& layout() const = 0;
  // One frame, without the others; what it shares with them (a basis, say) was made when the stream was opened. Throws
  // Error{usage} for a frame that is not there.
  [[nodiscard]] virtual Points frame(int f) const = 0;
  // The bytes that say how vertices are joined and in which order they are.
  [[nodiscard]] virtual std::int64_t connectivity_bytes() const = 0;
  // Seconds that opening took for the smooth functions; 0 where there are none.
  [[nodiscard]] virtual double basis_seconds() const { return 0; }

  // Frames [first, first + count), several at a time.
  [[nodiscard]] MeshSequence decode(int first, int count, const Progress& progress = {}) const;
  [[nodiscard]] MeshSequence decode_all(const Progress& progress = {}) const {
    return decode(0, layout().frames, progress);
  }
};

// The codecs' names.
[[nodiscard]] std::span<const std::string_view> mesh_codecs();

// Throws Error{usage} for a codec that is not there, options out of range and targets that cannot be met (the message
// says what can), Error{bad_input} for a sequence that is not valid.
[[nodiscard]] Bytes encode_mesh(std::string_view codec, const MeshSequence& mesh, const MeshCodecOptions& options = {});

// Whether the bytes are a stream of a mesh sequence.
[[nodiscard]] bool is_mesh_stream(std::span<const std::byte> bytes);
// The bytes must outlive the reader. Throws Error{bad_input} for anything that is not a whole stream, and where its
// smooth functions come out other than they were (see above). `cache`: gives the smooth functions without a solve where
// it has them, and keeps them where not; the frames are the same with and without.
[[nodiscard]] std::unique_ptr<MeshStreamReader> open_mesh_stream(std::span<const std::byte> bytes, std::string source,
                                                                 BasisCache* cache = nullptr);

// 8 * bytes / (vertices * frames): bits per vertex and frame.
[[nodiscard]] double bits_per_vertex_and_frame(std::int64_t bytes, const MeshSequence& layout);

}  // namespace kinespace
