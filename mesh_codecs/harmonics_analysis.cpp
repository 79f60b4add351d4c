#include "kinespace/mesh_codecs/harmonics_analysis.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/parallel.h"
#include "kinespace/mesh/rigid.h"
#include "kinespace/mesh_codecs/detail/measured_mesh.h"

namespace kinespace {
HarmonicsAnalysis::HarmonicsAnalysis(const MeshSequence& mesh, const std::optional<Decimation>& decimation,
                                     const HarmonicsSettings& settings, const Progress& progress)
    : mesh_(mesh), decimation_(decimation), settings_(settings), progress_(progress), split_{mesh.frames} {
  if (decimation_) coarse_ = coarse_sequence(mesh, *decimation_);
  setup_.layout = layout_of(mesh);
  setup_.functions = settings.functions;
  setup_.rotate = settings.rotate;
  setup_.size = diagonal(mesh);
  progress_.check_stop();
  progress_.at("basis", 0);
  align();
  progress_.check_stop();
  pack_key();
  progress_.check_stop();
  find_coefficients();
  progress_.check_stop();
  find_residuals();
  progress_.at("basis", 1);
}

void HarmonicsAnalysis::align() {
  track_ = quantised(rigid_motions(coded(), settings_.key), setup_.size);
  track_bytes_ = pack_track(track_);
  aligned_.resize(static_cast<std::size_t>(mesh_.frames));
  parallel_for(0, mesh_.frames, [&](int f) {
    const auto at = static_cast<std::size_t>(f);
    aligned_[at] = track_.motion(at).undo(frame_points(coded(), f));
  });
}

void HarmonicsAnalysis::pack_key() {
  const Points key = frame_points(mesh_, settings_.key);
  setup_.grid = grid_for(key, settings_.key_step);
  const KeyMesh mesh{.vertices = mesh_.vertices,
                     .triangles = canonical_triangles(mesh_.triangles),
                     .keys = {setup_.grid.quantised(key)}};
  packed_ = pack_key_mesh(mesh);
  connectivity_ = connectivity_size(mesh);
  const Points decoded = setup_.grid.points(mesh.keys[0]);
  if (!decimation_) {
    space_ = settings_.eigenvectors
                 ? HarmonicsSpace::of_eigenvectors(decoded, mesh.triangles, settings_.functions)
                 : std::make_shared<const HarmonicsSpace>(decoded, mesh.triangles, settings_.functions);
    return;
  }
  setup_.coarse_vertices = static_cast<int>(decimation_->kept.size());
  setup_.coarse_triangles = static_cast<std::int64_t>(decimation_->triangles.size());
  refinement_ = std::make_shared<Refinement>(decoded, mesh.triangles, *decimation_);
  space_ = std::make_shared<HarmonicsSpace>(rows_of(decoded, decimation_->kept), decimation_->triangles,
                                            settings_.functions);
}

void HarmonicsAnalysis::find_coefficients() {
  for (int b = 0; b < split_.count(); ++b) {
    BlockTables& block = blocks_.emplace_back();
    block.coefficients.resize(3 * std::int64_t{space_->functions()}, split_.size(b));
    parallel_for(0, split_.size(b), [&](int at) {
      const Points& x = aligned_[static_cast<std::size_t>(split_.first(b) + at)];
      const Coefficients c = space_->coefficients(x, settings_.rotate) - space_->key_coefficients();
      for (int k = 0; k < space_->functions(); ++k) {
        for (int d = 0; d < 3; ++d) block.coefficients(3 * k + d, at) = c(k, d);
      }
    });
  }
  for (BlockTables& block : blocks_) {
    block.motion = std::make_unique<PartCoder>(block.coefficients, space_->function_graph());
  }
}

Coefficients HarmonicsAnalysis::true_coefficients(const BlockTables& block, int at) const {
  Coefficients c = space_->key_coefficients();
  for (int k = 0; k < space_->functions(); ++k) {
    for (int d = 0; d < 3; ++d) c(k, d) += block.coefficients(3 * k + d, at);
  }
  return c;
}

template <typename Which>
Eigen::MatrixXd HarmonicsAnalysis::residual_table(int block, const Which& coefficients) const {
  Eigen::MatrixXd out(3 * std::int64_t{space_->vertices()}, split_.size(block));
  parallel_for(0, split_.size(block), [&](int at) {
    space_->residual(aligned_[static_cast<std::size_t>(split_.first(block) + at)], coefficients(at), settings_.rotate,
                     std::span(out.col(at).data(), static_cast<std::size_t>(out.rows())));
  });
  return out;
}

void HarmonicsAnalysis::find_residuals() {
  for (int b = 0; b < split_.count(); ++b) {
    BlockTables& block = blocks_[static_cast<std::size_t>(b)];
    block.residuals = residual_table(b, [&](int at) { return true_coefficients(block, at); });
    block.detail = std::make_unique<PartCoder>(block.residuals, space_->vertex_graph());
  }
}

HarmonicsAnalysis::Attempt HarmonicsAnalysis::code(double step, bool exact, HarmonicsFrames* frames) const {
  progress_.check_stop();
  Attempt out;
  out.step = step;
  const PartOptions options{.step = step, .transform = settings_.transform};
  for (int b = 0; b < split_.count(); ++b) {
    const BlockTables& block = blocks_[static_cast<std::size_t>(b)];
    CodedPart motion = block.motion->code(options), detail;
    if (exact) {
      const Eigen::MatrixXd table =
          residual_table(b, [&](int at) { return coefficients_of(space_->key_coefficients(), motion.part, at); });
      detail = block.detail->code(options, table);
    } else {
      detail = block.detail->code(options);
    }
    out.numbers += 3 * std::int64_t{space_->vertices()} * (motion.part.functions.cols() + detail.part.functions.cols());
    out.squared_error += motion.squared_error + detail.squared_error;
    out.bytes += static_cast<std::int64_t>(motion.bytes.size() + detail.bytes.size());
    out.motion.push_back(std::move(motion.bytes));
    out.detail.push_back(std::move(detail.bytes));
    if (frames != nullptr) frames->add_block(motion.part, std::move(detail.part));
  }
  return out;
}

HarmonicsAnalysis::Trial HarmonicsAnalysis::encode(double step) const {
  HarmonicsFrames frames(space_, refinement_, settings_.rotate);
  frames.track = track_;
  Trial out{.attempt = code(step, true, &frames), .decoded = mesh_, .kg = 0};
  parallel_for(0, mesh_.frames, [&](int f) { set_frame(out.decoded, f, frames.frame(f)); });
  out.kg = compare_positions(mesh_, out.decoded).kg;
  return out;
}

std::int64_t HarmonicsAnalysis::size(const Trial& trial) const {
  constexpr std::int64_t errors = 24;  // their numbers have more digits than none
  return static_cast<std::int64_t>(stream_of(trial.attempt, {.kg = trial.kg}).size()) + errors;
}

double HarmonicsAnalysis::residual_energy() const {
  double sum = 0;
  for (const BlockTables& block : blocks_) sum += block.detail->energy();
  return sum;
}

Bytes HarmonicsAnalysis::finish(const Trial& trial) const {
  return stream_of(trial.attempt, compare(mesh_, trial.decoded));
}

std::int64_t HarmonicsAnalysis::fixed_bytes() const {
  return static_cast<std::int64_t>(packed_.surface.size() + packed_.order.size() + track_bytes_.size()) + 400;
}

Bytes HarmonicsAnalysis::stream_of(const Attempt& attempt, const MeshError& error) const {
  HarmonicsSetup setup = setup_;
  setup.step = attempt.step;
  ByteWriter header;
  put_setup(header, setup);
  BitstreamWriter out("mesh-codec:mesh-harmonics");
  set_measured(out, error, connectivity_);
  out.add_section("setup", std::move(header).take());
  out.add_section("surface", packed_.surface);
  out.add_section("order", packed_.order);
  if (decimation_) add_decimation(out, *decimation_);
  out.add_section("rigid", track_bytes_);
  for (std::size_t b = 0; b < attempt.motion.size(); ++b) {
    out.add_section(fmt::format("m{}", b), attempt.motion[b]);
    out.add_section(fmt::format("d{}", b), attempt.detail[b]);
  }
  const std::int64_t basis = std::int64_t{space_->functions()} * space_->vertices();
  return finish_mesh_stream(std::move(out), setup.layout, std::max(basis, attempt.numbers));
}

}  // namespace kinespace
