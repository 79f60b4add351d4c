#include "kinespace/mesh_codecs/detail/paper_stream.h"

#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/entropy/integer_coder.h"
#include "kinespace/mesh/harmonics.h"
#include "kinespace/mesh_codecs/basis_cache.h"
#include "kinespace/mesh_codecs/detail/linear_prediction.h"
#include "kinespace/mesh_codecs/detail/paper_harmonics.h"
#include "kinespace/mesh_codecs/key_mesh.h"

namespace kinespace {
namespace {

HarmonicsOptions harmonics_options(int functions) {
  return {.functions = functions, .tolerance = 1e-7};
}

}  // namespace

PaperCluster::PaperCluster(Points key, std::span<const Triangle> triangles, int functions)
    : PaperCluster(key, triangles, manifold_harmonics(key, triangles, harmonics_options(functions)).functions) {}

PaperCluster::PaperCluster(Points key, std::span<const Triangle> triangles, int functions, BasisCache& cache,
                           std::uint64_t checksum)
    : PaperCluster(key, triangles, cache.harmonics(key, triangles, harmonics_options(functions), checksum)) {}

PaperCluster::PaperCluster(Points key, std::span<const Triangle> triangles, const Eigen::MatrixXd& functions)
    : key_(std::move(key)), checksum_(basis_checksum(functions)), projection_(functions), key_row_(row_of(key_)) {
  const Points low = projection_.synthesise(projection_.coefficients(key_));
  transfer_ = std::make_unique<DetailTransfer>(key_, low, triangles, TransferMethod::poisson);
}

Points PaperCluster::frame(std::span<const double> row) const {
  const Coefficients c = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(
      row.data(), projection_.functions(), 3);
  return correct_low_frequencies(transfer_->apply(projection_.synthesise(c)), c, projection_);
}

std::vector<double> PaperCluster::row_of(const Points& x) const {
  const Coefficients c = projection_.coefficients(x);
  std::vector<double> out(static_cast<std::size_t>(c.size()));
  for (Eigen::Index k = 0; k < c.rows(); ++k) {
    for (Eigen::Index d = 0; d < 3; ++d) out[static_cast<std::size_t>(3 * k + d)] = c(k, d);
  }
  return out;
}

std::vector<std::vector<int>> members_of(const Clusters& clusters) {
  std::vector<std::vector<int>> out(clusters.medoid.size());
  for (std::size_t f = 0; f < clusters.of.size(); ++f) {
    const auto j = static_cast<std::size_t>(clusters.of[f]);
    if (clusters.medoid[j] != static_cast<std::int32_t>(f)) out[j].push_back(static_cast<int>(f));
  }
  return out;
}

void put_setup(ByteWriter& out, const PaperSetup& setup) {
  put_layout(out, setup.layout);
  put_grid(out, setup.grid);
  out.put(setup.size);
  out.put(setup.step);
  put_varint(out, static_cast<std::uint64_t>(setup.functions));
  put_varint(out, static_cast<std::uint64_t>(setup.clusters));
  for (const std::uint64_t c : setup.checksums) out.put(c);
}

PaperSetup get_paper_setup(std::span<const std::byte> bytes, std::uint64_t stream_bytes, const std::string& source) {
  ByteReader in(bytes, source);
  PaperSetup out;
  out.layout = get_layout(in, stream_bytes);
  out.grid = get_grid(in);
  out.size = get_number(in, 0, 1e13);
  out.step = get_number(in, 1e-300, 1e13);
  const std::uint64_t functions = get_varint(in), clusters = get_varint(in);
  const auto vertices = static_cast<std::uint64_t>(out.layout.vertices);
  const auto frames = static_cast<std::uint64_t>(out.layout.frames);
  const auto most = static_cast<std::uint64_t>(most_mesh_numbers(stream_bytes));
  // As finish_mesh_stream makes room for. vertices <= 2^31, so that no product overflows.
  if (functions < 1 || functions > vertices || clusters < 1 || clusters > frames ||
      clusters > most / (functions * vertices) || functions * frames > most) {
    in.fail(fmt::format("{} functions and {} key-frames", functions, clusters), "what the encoder writes (damaged)");
  }
  out.functions = static_cast<int>(functions);
  out.clusters = static_cast<int>(clusters);
  for (std::uint64_t j = 0; j < clusters; ++j) out.checksums.push_back(in.get<std::uint64_t>());
  in.expect_end();
  return out;
}

Bytes pack_clusters(const Clusters& clusters) {
  IntegerWriter out;
  std::int32_t before = 0;
  for (const std::int32_t m : clusters.medoid) out.put(m - std::exchange(before, m), 0);
  before = 0;
  for (const std::int32_t j : clusters.of) out.put(j - std::exchange(before, j), 1);
  return std::move(out).finish();
}

Clusters unpack_clusters(std::span<const std::byte> bytes, const PaperSetup& setup, const std::string& source) {
  IntegerReader in(bytes, source);
  Clusters out;
  std::int64_t at = 0;
  for (int j = 0; j < setup.clusters; ++j) {
    at += in.get_between(-setup.layout.frames, setup.layout.frames, 0);
    if (at < 0 || at >= setup.layout.frames) in.damaged();
    out.medoid.push_back(static_cast<std::int32_t>(at));
  }
  at = 0;
  for (int f = 0; f < setup.layout.frames; ++f) {
    at += in.get_between(-setup.clusters, setup.clusters, 1);
    if (at < 0 || at >= setup.clusters) in.damaged();
    out.of.push_back(static_cast<std::int32_t>(at));
  }
  in.expect_end();
  return out;
}

namespace {

class PaperReader final : public MeshStreamReader {
 public:
  PaperReader(Bitstream stream, BasisCache* cache) : stream_(std::move(stream)) {
    const PaperSetup setup = get_paper_setup(stream_.section("setup"), stream_.size(), stream_.source());
    KeyMesh mesh = unpack_key_mesh(stream_.section("surface"), stream_.section("order"), setup.layout.vertices,
                                   setup.layout.triangles, setup.clusters, stream_.source());
    const Clusters clusters = unpack_clusters(stream_.section("clusters"), setup, stream_.source());
    frames_.track = unpack_track(stream_.section("rigid"), setup.layout.frames, setup.size, stream_.source());
    frames_.cluster_of = clusters.of;
    const auto start = std::chrono::steady_clock::now();
    make_clusters(mesh, setup, cache);
    basis_seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    read_rows(members_of(clusters), setup);
    layout_ = empty_sequence(setup.layout, std::move(mesh.triangles));
  }
  [[nodiscard]] const Bitstream& stream() const override { return stream_; }
  [[nodiscard]] const MeshSequence& layout() const override { return layout_; }
  [[nodiscard]] Points frame(int f) const override { return frames_.frame(f); }
  [[nodiscard]] std::int64_t connectivity_bytes() const override {
    return stream_.integer_option("connectivity", 0, std::int64_t{1} << 40);
  }
  [[nodiscard]] double basis_seconds() const override { return basis_seconds_; }

 private:
  // Several at a time, but for a library, which is asked for one after the other.
  void make_clusters(const KeyMesh& mesh, const PaperSetup& setup, BasisCache* cache) {
    frames_.clusters.resize(static_cast<std::size_t>(setup.clusters));
    const auto make = [&](std::size_t j) {
      const Points key = setup.grid.points(mesh.keys[j]);
      frames_.clusters[j] = cache != nullptr ? std::make_shared<PaperCluster>(key, mesh.triangles, setup.functions,
                                                                              *cache, setup.checksums[j])
                                             : std::make_shared<PaperCluster>(key, mesh.triangles, setup.functions);
      if (frames_.clusters[j]->checksum() != setup.checksums[j]) {
        throw Error(ErrorKind::bad_input, {.file = stream_.source(),
                                           .found = "manifold harmonics other than the encoder's (their checksum)",
                                           .expected = "the build that made the stream",
                                           .remedy = "decode it there, or encode with the standard profile"});
      }
    };
    if (cache == nullptr) {
      parallel_for(std::size_t{0}, frames_.clusters.size(), make);
    } else {
      for (std::size_t j = 0; j < frames_.clusters.size(); ++j) make(j);
    }
  }
  void read_rows(const std::vector<std::vector<int>>& members, const PaperSetup& setup) {
    frames_.rows.resize(static_cast<std::size_t>(setup.layout.frames));
    const std::size_t width = static_cast<std::size_t>(setup.functions) * 3;
    for (std::size_t j = 0; j < members.size(); ++j) {
      const std::string number = std::to_string(j);
      const auto table = decode_prediction(stream_.section(fmt::format("a{}", number)),
                                           stream_.section(fmt::format("q{}", number)), frames_.clusters[j]->key_row(),
                                           static_cast<int>(members[j].size()), setup.step, stream_.source());
      for (std::size_t i = 0; i < members[j].size(); ++i) {
        const auto from = table.begin() + static_cast<std::ptrdiff_t>(i * width);
        frames_.rows[static_cast<std::size_t>(members[j][i])].assign(from, from + static_cast<std::ptrdiff_t>(width));
      }
    }
  }
  Bitstream stream_;
  MeshSequence layout_;
  PaperFrames frames_;
  double basis_seconds_ = 0;
};

}  // namespace

std::unique_ptr<MeshStreamReader> open_paper_harmonics(Bitstream stream, BasisCache* cache) {
  return std::make_unique<PaperReader>(std::move(stream), cache);
}

}  // namespace kinespace
