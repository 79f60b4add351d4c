#include "codecs/mesh/paper_harmonics.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "base/error.h"
#include "codecs/integer_model.h"
#include "codecs/mesh/basis_cache.h"
#include "codecs/mesh/key_mesh.h"
#include "codecs/mesh/linear_prediction.h"
#include "codecs/mesh/measured_mesh.h"
#include "codecs/mesh/mesh_layout.h"
#include "codecs/mesh/rigid_track.h"
#include "codecs/mesh/step_search.h"
#include "mesh/connectivity.h"
#include "mesh/deformation.h"
#include "mesh/harmonics.h"
#include "mesh/rigid.h"

namespace kinespace {
namespace {

constexpr double usual_kg = 0.5;
constexpr double key_steps = 0.5;  // step of the key-frames over the root mean square error a coordinate

// A key-frame and what follows from it.
class Cluster {
 public:
  Cluster(Points key, std::span<const Triangle> triangles, int functions)
      : Cluster(key, triangles, manifold_harmonics(key, triangles, options(functions)).functions) {}
  // `checksum`: of the harmonics that are wanted.
  Cluster(Points key, std::span<const Triangle> triangles, int functions, BasisCache& cache, std::uint64_t checksum)
      : Cluster(key, triangles, cache.harmonics(key, triangles, options(functions), checksum)) {}

  [[nodiscard]] std::uint64_t checksum() const { return checksum_; }
  [[nodiscard]] const Projection& projection() const { return projection_; }
  [[nodiscard]] const Points& key() const { return key_; }
  [[nodiscard]] const std::vector<double>& key_row() const { return key_row_; }
  [[nodiscard]] Points frame(std::span<const double> row) const {
    const Coefficients c = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(
        row.data(), projection_.functions(), 3);
    return correct_low_frequencies(transfer_->apply(projection_.synthesise(c)), c, projection_);
  }
  [[nodiscard]] std::vector<double> row_of(const Points& x) const {
    const Coefficients c = projection_.coefficients(x);
    std::vector<double> out(static_cast<std::size_t>(c.size()));
    for (Eigen::Index k = 0; k < c.rows(); ++k) {
      for (Eigen::Index d = 0; d < 3; ++d) out[static_cast<std::size_t>(3 * k + d)] = c(k, d);
    }
    return out;
  }

 private:
  static HarmonicsOptions options(int functions) { return {.functions = functions, .tolerance = 1e-7}; }
  Cluster(Points key, std::span<const Triangle> triangles, const Eigen::MatrixXd& functions)
      : key_(std::move(key)), checksum_(basis_checksum(functions)), projection_(functions), key_row_(row_of(key_)) {
    const Points low = projection_.synthesise(projection_.coefficients(key_));
    transfer_ = std::make_unique<DetailTransfer>(key_, low, triangles, TransferMethod::poisson);
  }
  Points key_;
  std::uint64_t checksum_;
  Projection projection_;
  std::vector<double> key_row_;
  std::unique_ptr<DetailTransfer> transfer_;
};

// Which frames are coded with which key-frame, in time; the key-frames themselves are not among them.
std::vector<std::vector<int>> members_of(const Clusters& clusters) {
  std::vector<std::vector<int>> out(clusters.medoid.size());
  for (std::size_t f = 0; f < clusters.of.size(); ++f) {
    const auto j = static_cast<std::size_t>(clusters.of[f]);
    if (clusters.medoid[j] != static_cast<std::int32_t>(f)) out[j].push_back(static_cast<int>(f));
  }
  return out;
}

struct Setup {
  MeshLayout layout;
  Grid grid;
  double size = 1, step = 1;
  int functions = 1, clusters = 1;
  std::vector<std::uint64_t> checksums;
};

void put_setup(ByteWriter& out, const Setup& setup) {
  put_layout(out, setup.layout);
  put_grid(out, setup.grid);
  out.put(setup.size);
  out.put(setup.step);
  put_varint(out, static_cast<std::uint64_t>(setup.functions));
  put_varint(out, static_cast<std::uint64_t>(setup.clusters));
  for (const std::uint64_t c : setup.checksums) out.put(c);
}

Setup get_setup(std::span<const std::byte> bytes, std::uint64_t stream_bytes, const std::string& source) {
  ByteReader in(bytes, source);
  Setup out;
  out.layout = get_layout(in, stream_bytes);
  out.grid = get_grid(in);
  out.size = get_number(in, 0, 1e13);
  out.step = get_number(in, 1e-300, 1e13);
  const std::uint64_t functions = get_varint(in), clusters = get_varint(in);
  const auto vertices = static_cast<std::uint64_t>(out.layout.vertices);
  const auto frames = static_cast<std::uint64_t>(out.layout.frames);
  const auto most = static_cast<std::uint64_t>(most_mesh_numbers(stream_bytes));
  if (functions < 1 || functions > vertices || clusters < 1 || clusters > frames ||
      clusters > most / (functions * vertices) + (functions * vertices > most ? 0U : 1U) ||
      functions * vertices > most || functions * frames > most) {
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

Clusters unpack_clusters(std::span<const std::byte> bytes, const Setup& setup, const std::string& source) {
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

// Decoded rows of coefficients, and frames from them.
struct PaperFrames {
  std::vector<std::shared_ptr<const Cluster>> clusters;
  std::vector<std::int32_t> cluster_of;
  std::vector<std::vector<double>> rows;  // by frame; empty: the key-frame
  RigidTrack track;

  [[nodiscard]] Points frame(int f) const {
    const auto at = static_cast<std::size_t>(f);
    const Cluster& cluster = *clusters[static_cast<std::size_t>(cluster_of[at])];
    return track.motion(at).apply(rows[at].empty() ? cluster.key() : cluster.frame(rows[at]));
  }
};

class PaperReader final : public MeshStreamReader {
 public:
  PaperReader(Bitstream stream, BasisCache* cache) : stream_(std::move(stream)) {
    const Setup setup = get_setup(stream_.section("setup"), stream_.size(), stream_.source());
    KeyMesh mesh = unpack_key_mesh(stream_.section("surface"), stream_.section("order"), setup.layout.vertices,
                                   setup.layout.triangles, setup.clusters, stream_.source());
    const Clusters clusters = unpack_clusters(stream_.section("clusters"), setup, stream_.source());
    frames_.track = unpack_track(stream_.section("rigid"), setup.layout.frames, setup.size, stream_.source());
    frames_.cluster_of = clusters.of;
    const auto start = std::chrono::steady_clock::now();
    for (int j = 0; j < setup.clusters; ++j) {
      const auto number = static_cast<std::size_t>(j);
      const Points key = setup.grid.points(mesh.keys[number]);
      frames_.clusters.push_back(cache != nullptr ? std::make_shared<Cluster>(key, mesh.triangles, setup.functions,
                                                                              *cache, setup.checksums[number])
                                                  : std::make_shared<Cluster>(key, mesh.triangles, setup.functions));
      if (frames_.clusters.back()->checksum() != setup.checksums[number]) {
        throw Error(ErrorKind::bad_input, {.file = stream_.source(),
                                           .found = "manifold harmonics other than the encoder's (their checksum)",
                                           .expected = "the build that made the stream",
                                           .remedy = "decode it there, or encode with the standard profile"});
      }
    }
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
  void read_rows(const std::vector<std::vector<int>>& members, const Setup& setup) {
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

// One number of functions and of clusters.
class Encoder {
 public:
  Encoder(const MeshSequence& mesh, int functions, int clusters, double key_step, const Progress& progress)
      : mesh_(mesh), progress_(progress), clusters_(cluster_frames(mesh, {.clusters = clusters})) {
    setup_.layout = layout_of(mesh);
    setup_.functions = functions;
    setup_.clusters = clusters;
    setup_.size = diagonal(mesh);
    frames_.track = quantised(rigid_motions(mesh, 0), setup_.size);
    frames_.cluster_of = clusters_.of;
    members_ = members_of(clusters_);
    make_keys(key_step);
    find_rows();
  }

  // Squared error that is left when coefficients are exact.
  [[nodiscard]] double floor() const { return floor_; }
  struct Attempt {
    std::vector<CodedPrediction> parts;
    double squared_error = 0;
    double bytes = 0;
  };
  [[nodiscard]] Attempt code(double step) const {
    progress_.check_stop();
    Attempt out{.parts = {}, .squared_error = floor_, .bytes = static_cast<double>(fixed_bytes())};
    for (std::size_t j = 0; j < members_.size(); ++j) {
      CodedPrediction part =
          encode_prediction(tables_[j], frames_.clusters[j]->key_row(), static_cast<int>(members_[j].size()), step);
      for (std::size_t i = 0; i < tables_[j].size(); ++i) {
        out.squared_error += (tables_[j][i] - part.decoded[i]) * (tables_[j][i] - part.decoded[i]);
      }
      out.bytes += static_cast<double>(part.coefficients.size() + part.misses.size());
      out.parts.push_back(std::move(part));
    }
    return out;
  }
  struct Result {
    Bytes stream;
    double kg;
  };
  [[nodiscard]] Result encode(double step) const {
    const Attempt attempt = code(step);
    PaperFrames frames = frames_;
    for (std::size_t j = 0; j < members_.size(); ++j) set_rows(frames, j, attempt.parts[j].decoded);
    const MeshError error = measured(
        mesh_, [&](int f) { return frames.frame(f); }, true);
    Setup setup = setup_;
    setup.step = step;
    ByteWriter header;
    put_setup(header, setup);
    BitstreamWriter out("mesh-codec:mesh-harmonics");
    out.set_option("profile", "paper");
    set_measured(out, error, connectivity_);
    out.add_section("setup", std::move(header).take());
    out.add_section("surface", packed_.surface);
    out.add_section("order", packed_.order);
    out.add_section("rigid", pack_track(frames_.track));
    out.add_section("clusters", pack_clusters(clusters_));
    for (std::size_t j = 0; j < attempt.parts.size(); ++j) {
      out.add_section(fmt::format("a{}", j), attempt.parts[j].coefficients);
      out.add_section(fmt::format("q{}", j), attempt.parts[j].misses);
    }
    return {.stream = out.finish(), .kg = error.kg};
  }

 private:
  [[nodiscard]] Points aligned(int f) const {
    return frames_.track.motion(static_cast<std::size_t>(f)).undo(frame_points(mesh_, f));
  }
  [[nodiscard]] std::size_t fixed_bytes() const { return packed_.surface.size() + packed_.order.size() + 600; }
  void make_keys(double key_step) {
    std::vector<Points> keys;
    for (const std::int32_t m : clusters_.medoid) keys.push_back(aligned(m));
    setup_.grid = grid_for(keys[0], key_step);
    for (const Points& key : keys) {
      const Grid other = grid_for(key, key_step);
      for (std::size_t d = 0; d < 3; ++d) setup_.grid.origin[d] = std::min(setup_.grid.origin[d], other.origin[d]);
    }
    KeyMesh mesh{.vertices = mesh_.vertices, .triangles = canonical_triangles(mesh_.triangles), .keys = {}};
    for (const Points& key : keys) mesh.keys.push_back(setup_.grid.quantised(key));
    packed_ = pack_key_mesh(mesh);
    connectivity_ = connectivity_size(mesh);
    for (std::size_t j = 0; j < keys.size(); ++j) {
      progress_.check_stop();
      progress_.at("harmonics", static_cast<double>(j) / static_cast<double>(keys.size()));
      frames_.clusters.push_back(
          std::make_shared<Cluster>(setup_.grid.points(mesh.keys[j]), mesh.triangles, setup_.functions));
      setup_.checksums.push_back(frames_.clusters.back()->checksum());
    }
  }
  static void set_rows(PaperFrames& frames, const std::vector<int>& members, std::span<const double> table) {
    const std::size_t width = members.empty() ? 0 : table.size() / members.size();
    for (std::size_t i = 0; i < members.size(); ++i) {
      const auto row = table.subspan(i * width, width);
      frames.rows[static_cast<std::size_t>(members[i])].assign(row.begin(), row.end());
    }
  }
  void set_rows(PaperFrames& frames, std::size_t j, std::span<const double> table) const {
    set_rows(frames, members_[j], table);
  }
  void find_rows() {
    frames_.rows.resize(static_cast<std::size_t>(mesh_.frames));
    for (std::size_t j = 0; j < members_.size(); ++j) {
      const Cluster& cluster = *frames_.clusters[j];
      const std::size_t width = cluster.key_row().size();
      std::vector<double>& table = tables_.emplace_back(members_[j].size() * width);
      tbb::parallel_for(std::size_t{0}, members_[j].size(), [&](std::size_t i) {
        const auto row = cluster.row_of(aligned(members_[j][i]));
        std::copy(row.begin(), row.end(), table.begin() + static_cast<std::ptrdiff_t>(i * width));
      });
      set_rows(frames_, j, table);
    }
    std::vector<double> errors(static_cast<std::size_t>(mesh_.frames));
    tbb::parallel_for(0, mesh_.frames, [&](int f) {
      errors[static_cast<std::size_t>(f)] = (frames_.frame(f) - frame_points(mesh_, f)).squaredNorm();
    });
    floor_ = 0;
    for (const double e : errors) floor_ += e;
  }

  const MeshSequence& mesh_;
  const Progress& progress_;
  Clusters clusters_;
  Setup setup_;
  PaperFrames frames_;  // with exact coefficients
  std::vector<std::vector<int>> members_;
  std::vector<std::vector<double>> tables_;
  PackedKeyMesh packed_;
  std::int64_t connectivity_ = 0;
  double floor_ = 0;
};

double spread_of(const MeshSequence& mesh) {
  double sum = 0;
  for (int f = 0; f < mesh.frames; ++f) {
    const Points x = frame_points(mesh, f);
    sum += (x.rowwise() - x.colwise().mean()).squaredNorm();
  }
  return std::sqrt(sum);
}

// Functions and clusters to try, cheapest first.
std::vector<std::array<int, 2>> choices(const MeshSequence& mesh, const MeshCodecOptions& options) {
  std::vector<std::array<int, 2>> out;
  for (const auto& [functions, clusters] :
       {std::array{400, 1}, std::array{400, 2}, std::array{600, 2}, std::array{600, 4}}) {
    const std::array next{std::min(options.bases > 0 ? options.bases : functions, mesh.vertices),
                          std::min(options.clusters > 0 ? options.clusters : clusters, mesh.frames)};
    if (out.empty() || out.back() != next) out.push_back(next);
  }
  return out;
}

}  // namespace

Bytes encode_paper_harmonics(const MeshSequence& mesh, const MeshCodecOptions& options) {
  const double least = std::max(diagonal(mesh) * 1e-8, 1e-20);
  const double spread = std::max(spread_of(mesh), least);
  const double kg = options.kg.value_or(usual_kg);
  const double rms = kg / 100 * spread / std::sqrt(3.0 * mesh.vertices * mesh.frames);
  // By bases and clusters, when these are all that is asked for.
  const bool driven = !options.kg && !options.bytes && (options.bases > 0 || options.clusters > 0);
  double reached = 0;
  for (const auto& [functions, clusters] : choices(mesh, options)) {
    const Encoder encoder(mesh, functions, clusters, std::max(key_steps * rms, least), options.progress);
    const double floor = 100 * std::sqrt(encoder.floor()) / spread;
    if (options.bytes) {
      const auto size = [&](double fineness) { return encoder.code(1 / fineness).bytes; };
      const double fineness = largest_step(1 / std::max(6 * rms, least), 1e-3 / spread,
                                           static_cast<double>(*options.bytes), 0.02, 12, size);
      if (fineness > 0) {
        Bytes out = encoder.encode(1 / fineness).stream;
        if (static_cast<std::int64_t>(out.size()) <= *options.bytes) return out;
      }
      throw Error(ErrorKind::usage, {.found = fmt::format("{} bytes for the stream", *options.bytes),
                                     .expected = "more for this sequence"});
    }
    // Without a target: a twentieth more than exact coefficients would give, where that is not next to nothing.
    double target = driven ? std::max(1.05 * floor, 0.1 * usual_kg) : kg;
    reached = floor;
    for (int round = 0; round < 3 && (driven || floor < target); ++round) {
      const double step = largest_step(std::max(6 * rms, least), least, target, 0.01, 12, [&](double at) {
        return 100 * std::sqrt(encoder.code(at).squared_error) / spread;
      });
      auto result = encoder.encode(step > 0 ? step : least);
      if (driven || result.kg <= kg) return std::move(result.stream);
      target *= 0.995 * kg / result.kg;
    }
  }
  throw Error(ErrorKind::usage, {.found = fmt::format("a kg of {} percent", kg),
                                 .expected = fmt::format("{:.4g} or more with these bases and clusters", reached),
                                 .remedy = "ask for more bases or clusters, or use the standard profile"});
}

std::unique_ptr<MeshStreamReader> open_paper_harmonics(Bitstream stream, BasisCache* cache) {
  return std::make_unique<PaperReader>(std::move(stream), cache);
}

}  // namespace kinespace
