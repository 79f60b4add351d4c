// The functions of key-frames, kept in a library: opening a stream again then takes no solve.
//
// Each basis is an artifact of kind "mesh basis" (storage/library.h). Its key says what the functions follow from:
//
//   smooth K HASH               mesh/smooth_basis.h; HASH: XXH3 of the key-frame's positions and triangles, 128 bits
//   harmonics K HASH CHECKSUM   mesh/harmonics.h; CHECKSUM: the one the stream asks for, so that the harmonics of
//                               several builds find room side by side
//
// A kept basis has the same bits as a computed one, 8 bytes for each vertex and function (27 MB for 400 functions on
// 8431 vertices). One that is damaged, or not what its key says, is computed anew and replaced, with a warning. A
// library that cannot be written to serves what it has. The harmonics are also what lets another build read a stream of
// `profile paper`: it need not find them itself.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include <Eigen/Core>

#include "kinespace/base/bytes.h"
#include "kinespace/mesh/harmonics.h"
#include "kinespace/mesh/mesh_sequence.h"
#include "kinespace/mesh/smooth_basis.h"

namespace kinespace {

class BasisCache {
 public:
  using Warn = std::function<void(const std::string&)>;

  // `library`: made when the first basis is kept, if there is none. `warn` gets one line for each basis that was
  // damaged or could not be kept.
  explicit BasisCache(std::filesystem::path library, Warn warn = {});

  // As smooth_basis and manifold_harmonics give them. Throw Error{bad_input} where the library is not one or is damaged
  // as a whole, and what these two throw.
  [[nodiscard]] SmoothBasis smooth(const Points& key, std::span<const Triangle> triangles, int functions);
  // `checksum`: of the basis (basis_checksum) that is wanted. What is computed is kept only where it agrees.
  [[nodiscard]] Eigen::MatrixXd harmonics(const Points& key, std::span<const Triangle> triangles,
                                          const HarmonicsOptions& options, std::uint64_t checksum);

  // How many came out of the library, and how many were computed.
  [[nodiscard]] int found() const { return found_; }
  [[nodiscard]] int computed() const { return computed_; }

 private:
  struct Wanted;
  [[nodiscard]] bool find(const Wanted& wanted, SmoothBasis& out);
  void keep(const Wanted& wanted, const SmoothBasis& basis);

  std::filesystem::path library_;
  Warn warn_;
  int found_ = 0, computed_ = 0;
};

// The artifact's bytes: version, vertices, functions, anchors, all numbers, and an XXH3 of what comes before it.
[[nodiscard]] Bytes pack_mesh_basis(const SmoothBasis& basis);
// Throws Error{bad_input} naming `source`: for another shape than the one asked for (before memory is taken), a wrong
// checksum, anchors that are no vertices, numbers beyond 1e6.
[[nodiscard]] SmoothBasis unpack_mesh_basis(std::span<const std::byte> bytes, int vertices, int functions,
                                            const std::string& source);

}  // namespace kinespace
