// What `bench mesh` measures of one coded sequence, and of its functions.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

#include "kinespace/base/bytes.h"
#include "kinespace/mesh/mesh_sequence.h"
#include "kinespace/mesh_codecs/mesh_codec.h"

namespace kinespace {

struct MeshPoint {
  double bpvf = 0, without_connectivity = 0;  // bits per vertex and frame
  double kg = 0, lr = 0;                      // of the decoded frames
  std::int64_t bytes = 0;
  double encode_s = 0;
};
struct CodedMesh {
  MeshPoint point;
  Bytes stream;
};

// Encoded, opened again and measured on what was decoded.
[[nodiscard]] CodedMesh code_mesh(std::string_view codec, const MeshSequence& mesh, const MeshCodecOptions& options);
// The same but for the errors, which are those that the encoder measured: opening a stream of many key-frames takes as
// long as making it.
[[nodiscard]] CodedMesh encode_only(std::string_view codec, const MeshSequence& mesh, const MeshCodecOptions& options);

// On one core; the median frame of a few, each the least of three times, since other programs only slow it down.
[[nodiscard]] double milliseconds_a_frame(const MeshStreamReader& reader);

// Seconds on one core, the least of three.
struct BasisSeconds {
  double smooth = 0;     // mesh/smooth_basis.h
  double harmonics = 0;  // mesh/harmonics.h
};
[[nodiscard]] BasisSeconds basis_seconds(const MeshSequence& mesh, int functions);

// KG of frames projected on functions of the first one, percent.
struct ProjectionError {
  double smooth = 0;
  double harmonics = 0;
};
[[nodiscard]] ProjectionError projection_error(const MeshSequence& mesh, int functions);

// Bits per vertex and frame of the standard profile at a KG, by its own estimate, on functions of either kind.
[[nodiscard]] double estimated_bpvf(const MeshSequence& mesh, double kg, int functions, bool eigenvectors);

// The most memory that the process held while `work` ran, GiB. What it held before counts.
[[nodiscard]] double peak_memory_gib(const std::function<void()>& work);

}  // namespace kinespace
