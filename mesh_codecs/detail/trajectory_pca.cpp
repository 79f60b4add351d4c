#include "kinespace/mesh_codecs/detail/trajectory_pca.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh/connectivity.h"
#include "kinespace/mesh_codecs/detail/measured_mesh.h"
#include "kinespace/mesh_codecs/detail/path_weights.h"
#include "kinespace/mesh_codecs/frame_basis.h"
#include "kinespace/mesh_codecs/harmonics_stream.h"
#include "kinespace/mesh_codecs/key_mesh.h"
#include "kinespace/mesh_codecs/mesh_layout.h"
#include "kinespace/mesh_codecs/step_search.h"

namespace kinespace {
namespace {

struct Block {
  Eigen::MatrixXd paths;  // 3 * frames x components; rows: x of all frames, y, z
  std::vector<std::int64_t> weights;
  Bytes basis_bytes, weight_bytes;
};

Points frame_of(const Block& block, int at, int frames, int vertices, double step) {
  Points out = Points::Zero(vertices, 3);
  for (Eigen::Index r = 0; r < block.paths.cols(); ++r) {
    const std::int64_t* const row = block.weights.data() + r * vertices;
    for (int d = 0; d < 3; ++d) {
      const double by = step * block.paths(std::int64_t{d} * frames + at, r);
      for (int v = 0; v < vertices; ++v) out(v, d) += by * static_cast<double>(row[v]);
    }
  }
  return out;
}

class Coder {
 public:
  Coder(const MeshSequence& mesh, const Progress& progress)
      : mesh_(mesh),
        progress_(progress),
        triangles_(canonical_triangles(mesh.triangles)),
        walk_(mesh.vertices, triangles_),
        split_{mesh.frames} {
    KeyMesh flat{.vertices = mesh.vertices, .triangles = triangles_, .keys = {}};
    flat.keys.emplace_back(static_cast<std::size_t>(mesh.vertices));
    packed_ = pack_key_mesh(flat);
    for (int b = 0; b < split_.count(); ++b) {
      const int frames = split_.size(b);
      Eigen::MatrixXd& table = tables_.emplace_back(mesh.vertices, 3 * std::int64_t{frames});
      progress.check_stop();
      progress.at("components", static_cast<double>(b) / split_.count());
      for (int f = 0; f < frames; ++f) {
        const Points x = frame_points(mesh, split_.first(b) + f);
        for (int d = 0; d < 3; ++d) table.col(std::int64_t{d} * frames + f) = x.col(d);
      }
      components_.push_back(principal_components(table.transpose() * table));
      progress.check_stop();
    }
  }

  struct Result {
    Bytes stream;
    double kg = 0;
  };
  // `tail`: the squared error that is left to components that are not coded.
  [[nodiscard]] Result code(double step, double tail, bool rigidity) const {
    progress_.check_stop();
    std::vector<Block> blocks;
    for (int b = 0; b < split_.count(); ++b) {
      progress_.check_stop();
      blocks.push_back(code_block(b, step, tail / split_.count()));
    }
    const MeshError error = measured(
        mesh_,
        [&](int f) {
          const int b = split_.of(f);
          return frame_of(blocks[static_cast<std::size_t>(b)], f - split_.first(b), split_.size(b), mesh_.vertices,
                          step);
        },
        rigidity, progress_);
    return {.stream = stream_of(blocks, step, error), .kg = error.kg};
  }

 private:
  [[nodiscard]] Block code_block(int b, double step, double tail) const {
    const PrincipalComponents& pc = components_[static_cast<std::size_t>(b)];
    const Eigen::MatrixXd& table = tables_[static_cast<std::size_t>(b)];
    Eigen::Index kept = pc.sizes.size();
    for (double rest = 0; kept > 0; --kept) {
      rest += pc.sizes[kept - 1] * pc.sizes[kept - 1];
      if (rest > tail) break;
    }
    std::vector<double> sizes;
    for (Eigen::Index r = 0; r < kept; ++r) sizes.push_back(pc.sizes[r] / step);
    CodedFrameBasis basis = encode_frame_basis(pc.functions.leftCols(kept), sizes, 1);
    Block out;
    const Eigen::MatrixXd weights = table * basis.functions / step;
    out.weights.resize(static_cast<std::size_t>(weights.size()));
    for (std::size_t i = 0; i < out.weights.size(); ++i) out.weights[i] = std::llround(weights.data()[i]);
    out.weight_bytes = pack_weights(out.weights, static_cast<int>(kept), walk_);
    out.basis_bytes = std::move(basis.bytes);
    out.paths = std::move(basis.functions);
    return out;
  }
  [[nodiscard]] Bytes stream_of(const std::vector<Block>& blocks, double step, const MeshError& error) const {
    BitstreamWriter out("mesh-codec:mesh-pca");
    set_measured(out, error, static_cast<std::int64_t>(packed_.surface.size() + packed_.order.size()));
    ByteWriter setup;
    put_layout(setup, layout_of(mesh_));
    setup.put(step);
    for (const Block& block : blocks) put_varint(setup, static_cast<std::uint64_t>(block.paths.cols()));
    out.add_section("setup", std::move(setup).take());
    out.add_section("surface", packed_.surface);
    out.add_section("order", packed_.order);
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      out.add_section(fmt::format("b{}", b), blocks[b].basis_bytes);
      out.add_section(fmt::format("w{}", b), blocks[b].weight_bytes);
    }
    Eigen::Index most = 0;
    for (const Block& block : blocks) most = std::max(most, block.paths.cols());
    return finish_mesh_stream(std::move(out), layout_of(mesh_), most * mesh_.vertices);
  }

  const MeshSequence& mesh_;
  const Progress& progress_;
  std::vector<Triangle> triangles_;
  VertexWalk walk_;
  FrameBlocks split_;
  PackedKeyMesh packed_;
  std::vector<Eigen::MatrixXd> tables_;
  std::vector<PrincipalComponents> components_;
};

class PcaReader final : public MeshStreamReader {
 public:
  explicit PcaReader(Bitstream stream) : stream_(std::move(stream)) {
    ByteReader in(stream_.section("setup"), stream_.source());
    const MeshLayout described = get_layout(in, stream_.size());
    step_ = get_number(in, 1e-300, 1e13);
    split_ = {described.frames};
    KeyMesh mesh = unpack_key_mesh(stream_.section("surface"), stream_.section("order"), described.vertices,
                                   described.triangles, 1, stream_.source());
    const VertexWalk walk(described.vertices, mesh.triangles);
    for (int b = 0; b < split_.count(); ++b) read_block(in, b, walk, described);
    in.expect_end();
    layout_ = empty_sequence(described, std::move(mesh.triangles));
  }
  [[nodiscard]] const Bitstream& stream() const override { return stream_; }
  [[nodiscard]] const MeshSequence& layout() const override { return layout_; }
  [[nodiscard]] Points frame(int f) const override {
    const int b = split_.of(f);
    return frame_of(blocks_[static_cast<std::size_t>(b)], f - split_.first(b), split_.size(b), layout_.vertices, step_);
  }
  [[nodiscard]] std::int64_t connectivity_bytes() const override {
    return stream_.integer_option("connectivity", 0, std::int64_t{1} << 40);
  }

 private:
  void read_block(ByteReader& in, int b, const VertexWalk& walk, const MeshLayout& described) {
    const std::uint64_t components = get_varint(in);
    const int numbers = 3 * split_.size(b);
    if (components > static_cast<std::uint64_t>(numbers) ||
        static_cast<std::int64_t>(components) * described.vertices > most_mesh_numbers(stream_.size())) {
      in.fail(std::to_string(components) + " components", "what the encoder writes (damaged)");
    }
    const auto kept = static_cast<int>(components);
    const std::string number = std::to_string(b);
    Block& block = blocks_.emplace_back();
    block.paths = decode_frame_basis(stream_.section(fmt::format("b{}", number)), numbers, kept, stream_.source());
    block.weights =
        unpack_weights(stream_.section(fmt::format("w{}", number)), kept, described.vertices, walk, stream_.source());
  }

  Bitstream stream_;
  MeshSequence layout_;
  FrameBlocks split_;
  double step_ = 1;
  std::vector<Block> blocks_;
};

}  // namespace

Bytes encode_trajectory_pca(const MeshSequence& mesh, const MeshCodecOptions& options) {
  const Coder coder(mesh, options.progress);
  double spread = 0;
  for (int f = 0; f < mesh.frames; ++f) {
    const Points x = frame_points(mesh, f);
    spread += (x.rowwise() - x.colwise().mean()).squaredNorm();
  }
  const double numbers = 3.0 * mesh.vertices * mesh.frames;
  // Positions are floats: finer steps than those of the largest one would only make weights that no integer holds.
  double largest = 0;
  for (const float x : mesh.positions) largest = std::max(largest, std::abs(double{x}));
  const double least = std::max(largest * 1e-9, 1e-20);
  const auto tail_at = [&](double kg) { return 0.5 * kg * kg * 1e-4 * spread; };
  if (options.bytes) {
    // The tail goes with the step: an error of about 0.3 steps a number.
    const auto tail = [&](double step) { return 0.5 * numbers * step * step * 0.01; };
    const auto inverse = [&](double fineness) {
      return static_cast<double>(coder.code(1 / fineness, tail(1 / fineness), false).stream.size());
    };
    constexpr double lr_bytes = 16;  // which the streams of the search do not tell
    const double guess = 1 / std::max(std::sqrt(spread / numbers) * 0.05, least);
    const double fineness =
        largest_step(guess, guess * 1e-5, static_cast<double>(*options.bytes) - lr_bytes, 0.01, 14, inverse);
    if (fineness == 0) {
      throw Error(ErrorKind::usage, {.found = fmt::format("{} bytes for the stream", *options.bytes),
                                     .expected = "more for this sequence"});
    }
    return coder.code(1 / fineness, tail(1 / fineness), true).stream;
  }
  const double kg = options.kg.value_or(0.5);
  const double guess = std::max(10 * kg / 100 * std::sqrt(spread / numbers), least);
  double step =
      largest_step(guess, least, kg, 0.01, 14, [&](double at) { return coder.code(at, tail_at(kg), false).kg; });
  if (step == 0 && spread > 0) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("a kg of {} percent", kg), .expected = "more for this sequence"});
  }
  return coder.code(step > 0 ? step : least, tail_at(kg), true).stream;
}

std::unique_ptr<MeshStreamReader> open_trajectory_pca(Bitstream stream) {
  return std::make_unique<PcaReader>(std::move(stream));
}

}  // namespace kinespace
