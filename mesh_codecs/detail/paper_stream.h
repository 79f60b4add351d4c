// The parts of a mesh-harmonics stream of the profile paper (its sections: paper_harmonics.h), for encoder and decoder.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/mesh/deformation.h"
#include "kinespace/mesh/mesh_sequence.h"
#include "kinespace/mesh/projection.h"
#include "kinespace/mesh/rigid.h"
#include "kinespace/mesh_codecs/mesh_layout.h"
#include "kinespace/mesh_codecs/rigid_track.h"

namespace kinespace {

class BasisCache;

// A key-frame and what follows from it.
class PaperCluster {
 public:
  PaperCluster(Points key, std::span<const Triangle> triangles, int functions);
  // `checksum`: of the harmonics that are wanted.
  PaperCluster(Points key, std::span<const Triangle> triangles, int functions, BasisCache& cache,
               std::uint64_t checksum);

  [[nodiscard]] std::uint64_t checksum() const { return checksum_; }
  [[nodiscard]] const Points& key() const { return key_; }
  // Coefficients of the key-frame: what the first frame is predicted from.
  [[nodiscard]] const std::vector<double>& key_row() const { return key_row_; }
  [[nodiscard]] Points frame(std::span<const double> row) const;
  [[nodiscard]] std::vector<double> row_of(const Points& x) const;

 private:
  PaperCluster(Points key, std::span<const Triangle> triangles, const Eigen::MatrixXd& functions);
  Points key_;
  std::uint64_t checksum_;
  Projection projection_;
  std::vector<double> key_row_;
  std::unique_ptr<DetailTransfer> transfer_;
};

// Which frames are coded with which key-frame, in time; the key-frames themselves are not among them.
[[nodiscard]] std::vector<std::vector<int>> members_of(const Clusters& clusters);

struct PaperSetup {
  MeshLayout layout;
  Grid grid;
  double size = 1, step = 1;
  int functions = 1, clusters = 1;
  std::vector<std::uint64_t> checksums;  // of the harmonics of each key-frame
};

void put_setup(ByteWriter& out, const PaperSetup& setup);
// Throws Error{bad_input}.
[[nodiscard]] PaperSetup get_paper_setup(std::span<const std::byte> bytes, std::uint64_t stream_bytes,
                                         const std::string& source);

[[nodiscard]] Bytes pack_clusters(const Clusters& clusters);
// Throws Error{bad_input}.
[[nodiscard]] Clusters unpack_clusters(std::span<const std::byte> bytes, const PaperSetup& setup,
                                       const std::string& source);

// Decoded rows of coefficients, and frames from them.
struct PaperFrames {
  std::vector<std::shared_ptr<const PaperCluster>> clusters;
  std::vector<std::int32_t> cluster_of;
  std::vector<std::vector<double>> rows;  // by frame; empty: the key-frame
  RigidTrack track;

  [[nodiscard]] Points frame(int f) const {
    const auto at = static_cast<std::size_t>(f);
    const PaperCluster& cluster = *clusters[static_cast<std::size_t>(cluster_of[at])];
    return track.motion(at).apply(rows[at].empty() ? cluster.key() : cluster.frame(rows[at]));
  }
};

}  // namespace kinespace
