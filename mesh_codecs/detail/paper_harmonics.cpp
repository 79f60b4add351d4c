#include "kinespace/mesh_codecs/detail/paper_harmonics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh_codecs/detail/linear_prediction.h"
#include "kinespace/mesh_codecs/detail/measured_mesh.h"
#include "kinespace/mesh_codecs/detail/paper_stream.h"
#include "kinespace/mesh_codecs/key_mesh.h"
#include "kinespace/mesh_codecs/step_search.h"

namespace kinespace {
namespace {

constexpr double key_steps = 0.5;  // step of the key-frames over the root mean square error a coordinate

struct Choice {
  int functions = 0;
  int clusters = 0;
  friend bool operator==(const Choice&, const Choice&) = default;
};

// One number of functions and of clusters.
class Encoder {
 public:
  // `distances`: frame_distances of the mesh.
  Encoder(const MeshSequence& mesh, const Eigen::MatrixXd& distances, const Choice& choice, double key_step,
          const Progress& progress)
      : mesh_(mesh), progress_(progress), clusters_(cluster(distances, {.clusters = choice.clusters})) {
    setup_.layout = layout_of(mesh);
    setup_.functions = choice.functions;
    setup_.clusters = choice.clusters;
    setup_.size = diagonal(mesh);
    frames_.track = quantised(rigid_motions(mesh, 0), setup_.size);
    track_bytes_ = pack_track(frames_.track);
    frames_.cluster_of = clusters_.of;
    members_ = members_of(clusters_);
    make_keys(key_step);
    find_rows();
  }

  // Squared error that is left when coefficients are exact, about.
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
        mesh_, [&](int f) { return frames.frame(f); }, true, progress_);
    PaperSetup setup = setup_;
    setup.step = step;
    ByteWriter header;
    put_setup(header, setup);
    BitstreamWriter out("mesh-codec:mesh-harmonics");
    out.set_option("profile", "paper");
    set_measured(out, error, connectivity_);
    out.add_section("setup", std::move(header).take());
    out.add_section("surface", packed_.surface);
    out.add_section("order", packed_.order);
    out.add_section("rigid", track_bytes_);
    out.add_section("clusters", pack_clusters(clusters_));
    for (std::size_t j = 0; j < attempt.parts.size(); ++j) {
      out.add_section(fmt::format("a{}", j), attempt.parts[j].coefficients);
      out.add_section(fmt::format("q{}", j), attempt.parts[j].misses);
    }
    const auto numbers = std::int64_t{setup.functions} * std::max(std::int64_t{setup.layout.vertices} * setup.clusters,
                                                                  std::int64_t{setup.layout.frames});
    return {.stream = finish_mesh_stream(std::move(out), setup.layout, numbers), .kg = error.kg};
  }

 private:
  [[nodiscard]] Points aligned(int f) const {
    return frames_.track.motion(static_cast<std::size_t>(f)).undo(frame_points(mesh_, f));
  }
  // All but coefficients and predictions; of the container about.
  [[nodiscard]] std::size_t fixed_bytes() const {
    const std::size_t container = 250 + 40 * members_.size();
    return packed_.surface.size() + packed_.order.size() + track_bytes_.size() + pack_clusters(clusters_).size() +
           container;
  }
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
    progress_.check_stop();
    progress_.at("harmonics", 0);
    frames_.clusters.resize(keys.size());
    parallel_for(std::size_t{0}, keys.size(), [&](std::size_t j) {
      frames_.clusters[j] =
          std::make_shared<PaperCluster>(setup_.grid.points(mesh.keys[j]), mesh.triangles, setup_.functions);
    });
    for (const auto& made : frames_.clusters) setup_.checksums.push_back(made->checksum());
    progress_.at("harmonics", 1);
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
      const PaperCluster& cluster = *frames_.clusters[j];
      const std::size_t width = cluster.key_row().size();
      std::vector<double>& table = tables_.emplace_back(members_[j].size() * width);
      parallel_for(std::size_t{0}, members_[j].size(), [&](std::size_t i) {
        const auto row = cluster.row_of(aligned(members_[j][i]));
        std::copy(row.begin(), row.end(), table.begin() + static_cast<std::ptrdiff_t>(i * width));
      });
      set_rows(frames_, j, table);
    }
    find_floor();
  }
  // From some dozens of frames: they are much alike, and what is encoded is measured whole.
  void find_floor() {
    constexpr int looked_at = 64;
    const int count = std::min(mesh_.frames, looked_at);
    std::vector<double> errors(static_cast<std::size_t>(count));
    parallel_for(0, count, [&](int i) {
      const auto f = static_cast<int>(std::int64_t{mesh_.frames} * i / count);
      errors[static_cast<std::size_t>(i)] = (frames_.frame(f) - frame_points(mesh_, f)).squaredNorm();
    });
    floor_ = 0;
    for (const double e : errors) floor_ += e * mesh_.frames / count;
  }

  const MeshSequence& mesh_;
  const Progress& progress_;
  Clusters clusters_;
  PaperSetup setup_;
  PaperFrames frames_;  // with exact coefficients
  Bytes track_bytes_;
  std::vector<std::vector<int>> members_;
  std::vector<std::vector<double>> tables_;
  PackedKeyMesh packed_;
  std::int64_t connectivity_ = 0;
  double floor_ = 0;
};

// What is tried, the smallest first.
std::vector<Choice> choices(const MeshSequence& mesh, const MeshCodecOptions& options) {
  std::vector<Choice> out;
  for (const Choice& usual : {Choice{250, 1}, {400, 1}, {600, 1}, {400, 2}, {600, 2}, {800, 2}, {800, 4}}) {
    const Choice next{std::min(options.bases > 0 ? options.bases : usual.functions, mesh.vertices),
                      std::min(options.clusters > 0 ? options.clusters : usual.clusters, mesh.frames)};
    if (std::find(out.begin(), out.end(), next) == out.end()) out.push_back(next);
  }
  return out;
}

// Looks for functions, clusters and step.
class PaperSearch {
 public:
  PaperSearch(const MeshSequence& mesh, const MeshCodecOptions& options)
      : mesh_(mesh),
        options_(options),
        distances_(frame_distances(mesh)),
        choices_(choices(mesh, options)),
        least_(std::max(diagonal(mesh) * 1e-8, 1e-20)),
        spread_(std::max(std::sqrt(squared_spread(mesh)), least_)) {}

  // Of the choices that can meet the target, smallest first, up to the first that costs more than the one before: a
  // small one close to its own floor costs more than the next, and a large one needs more key-frames.
  [[nodiscard]] Bytes for_error(double kg) const {
    std::optional<Encoder> best;
    double bytes = 0, reached = 0, step = 0;
    for (const Choice& choice : choices_) {
      Encoder encoder = encoder_of(choice, kg);
      reached = floor_of(encoder);
      if (!(reached < kg)) continue;
      const double found = step_for(encoder, kg);
      const double cost = encoder.code(found).bytes;
      if (best && cost >= bytes) break;
      best.emplace(std::move(encoder));
      bytes = cost;
      step = found;
    }
    double target = kg;
    constexpr int most_rounds = 4;
    for (int round = 0; best && round < most_rounds && target > floor_of(*best); ++round) {
      if (round > 0) step = step_for(*best, target);
      auto result = best->encode(step);
      if (result.kg <= kg) return std::move(result.stream);
      target *= 0.995 * kg / result.kg;
      reached = result.kg;
    }
    throw Error(ErrorKind::usage, {.found = fmt::format("a kg of {} percent", kg),
                                   .expected = fmt::format("{:.4g} or more with these bases and clusters", reached),
                                   .remedy = "ask for more bases or clusters, or use the standard profile"});
  }

  // A twentieth more than exact coefficients would give, where that is not next to nothing.
  [[nodiscard]] Bytes for_bases() const {
    const Encoder encoder = encoder_of(choices_.front(), MeshCodecOptions::usual_kg);
    return encoder.encode(step_for(encoder, std::max(1.05 * floor_of(encoder), 0.1 * MeshCodecOptions::usual_kg)))
        .stream;
  }

  // Key-frames as fine as leaves room for the rest.
  [[nodiscard]] Bytes for_bytes(std::int64_t bytes) const {
    const Choice& choice = options_.bases > 0 || choices_.size() == 1 ? choices_.front() : choices_[1];
    for (double kg = MeshCodecOptions::usual_kg; kg < 50; kg *= 2) {
      const Encoder encoder = encoder_of(choice, kg);
      const auto size = [&](double fineness) { return encoder.code(1 / fineness).bytes; };
      auto room = static_cast<double>(bytes);
      for (int round = 0; round < 2 && room > 0; ++round) {
        const double fineness = largest_step(1 / (first_step * rms(kg)), 1e-3 / spread_, room, 0.02, 12, size);
        if (fineness == 0) break;
        Bytes out = encoder.encode(1 / fineness).stream;
        if (static_cast<std::int64_t>(out.size()) <= bytes) return out;
        room -= static_cast<double>(out.size()) - static_cast<double>(bytes) + 8;
      }
    }
    throw Error(ErrorKind::usage,
                {.found = fmt::format("{} bytes for the stream", bytes), .expected = "more for this sequence"});
  }

 private:
  [[nodiscard]] double rms(double kg) const {
    return std::max(kg / 100 * spread_ / std::sqrt(3.0 * mesh_.vertices * mesh_.frames), least_);
  }
  [[nodiscard]] Encoder encoder_of(const Choice& choice, double kg) const {
    return Encoder(mesh_, distances_, choice, std::max(key_steps * rms(kg), least_), options_.progress);
  }
  [[nodiscard]] double floor_of(const Encoder& encoder) const { return 100 * std::sqrt(encoder.floor()) / spread_; }
  [[nodiscard]] double step_for(const Encoder& encoder, double kg) const {
    const double step = largest_step(first_step * rms(kg), least_, kg, 0.01, 12, [&](double at) {
      return 100 * std::sqrt(encoder.code(at).squared_error) / spread_;
    });
    return std::max(step, least_);
  }

  const MeshSequence& mesh_;
  const MeshCodecOptions& options_;
  Eigen::MatrixXd distances_;
  std::vector<Choice> choices_;
  double least_;
  double spread_;
};

}  // namespace

Bytes encode_paper_harmonics(const MeshSequence& mesh, const MeshCodecOptions& options) {
  const PaperSearch search(mesh, options);
  if (options.bytes) return search.for_bytes(*options.bytes);
  // By bases and clusters, when these are all that is asked for.
  if (!options.kg && (options.bases > 0 || options.clusters > 0)) return search.for_bases();
  return search.for_error(options.kg.value_or(MeshCodecOptions::usual_kg));
}

}  // namespace kinespace
