// mesh-harmonics, standard profile: settings, search for the target, measurement.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "base/error.h"
#include "codecs/mesh/harmonics_stream.h"
#include "mesh/mesh_error.h"
#include "mesh/rigid.h"

namespace kinespace {
namespace {

double env(const char* n, double d) {
  const char* e = std::getenv(n);
  return e ? std::atof(e) : d;
}

template <typename Do>
void for_frames(int frames, const Do& run) {
  tbb::parallel_for(tbb::blocked_range<int>(0, frames, 1), [&](const tbb::blocked_range<int>& range) {
    for (int f = range.begin(); f < range.end(); ++f) run(f);
  });
}

double rms_spread(const MeshSequence& mesh) {
  double sum = 0;
  for (int f = 0; f < mesh.frames; ++f) {
    const Points x = frame_points(mesh, f);
    sum += (x.rowwise() - x.colwise().mean()).squaredNorm();
  }
  return std::sqrt(sum / (3.0 * mesh.vertices * mesh.frames));
}

struct Settings {
  int functions = 400;
  double key_step = 1;
  double rate_weight = 0.12;
  double coarseness = 1;
  FrameTransform motion = FrameTransform::components, detail = FrameTransform::components;
  bool rotate = true;
};

// One choice of key-frame precision and functions, with the sequence in its coordinates.
class Analysis {
 public:
  Analysis(const MeshSequence& mesh, int key, const Settings& settings) : mesh_(mesh), settings_(settings) {
    setup_.layout = layout_of(mesh);
    setup_.functions = settings.functions;
    setup_.rotate = settings.rotate;
    setup_.size = diagonal(mesh);
    align(key);
    const Points key_points = frame_points(mesh, key);
    setup_.grid = grid_for(key_points, settings.key_step);
    KeyMesh key_mesh{
        .vertices = mesh.vertices, .triangles = mesh.triangles, .keys = {setup_.grid.quantised(key_points)}};
    packed_ = pack_key_mesh(key_mesh);
    connectivity_ = connectivity_size(key_mesh);
    const KeyMesh decoded = unpack_key_mesh(packed_.surface, packed_.order, mesh.vertices,
                                            static_cast<std::int64_t>(mesh.triangles.size()), 1, "");
    space_ =
        std::make_shared<HarmonicsSpace>(setup_.grid.points(decoded.keys[0]), decoded.triangles, settings.functions);
    find_coefficients();
    track_bytes_ = pack_track(track_);
  }

  struct Attempt {
    Bytes stream;
    double squared_error = 0;
    HarmonicsFrames frames;
  };

  void prepare(double /*step*/) {
    residuals_ = residual_table([&](int f) { return true_coefficients(f); });
    detail_ = std::make_unique<PartCoder>(residuals_, space_->vertex_graph());
  }
  // `exact`: residuals against the coded coefficients rather than the true ones.
  [[nodiscard]] Attempt code(double step, bool exact) const {
    Attempt out{.stream = {}, .squared_error = 0, .frames = HarmonicsFrames(space_, nullptr, settings_.rotate)};
    out.frames.track = track_;
    HarmonicsFrames::Block& block = out.frames.blocks.emplace_back();
    PartOptions options{.step = step,
                        .transform = settings_.motion,
                        .rate_weight = settings_.rate_weight,
                        .coarseness = settings_.coarseness};
    CodedPart motion = motion_->code(options);
    options.transform = settings_.detail;
    CodedPart detail;
    if (exact) {
      const Eigen::MatrixXd table =
          residual_table([&](int f) { return coefficients_of(space_->key_coefficients(), motion.part, f); });
      detail = PartCoder(table, space_->vertex_graph()).code(options);
    } else {
      detail = detail_->code(options);
    }
    if (env("M2V", 0) > 0) {
      std::fprintf(stderr,
                   "  step %.4g surface %zu order %zu (conn %ld) rigid %zu motion %zu (R %ld) detail %zu (R %ld) errA "
                   "%.4g errB %.4g (energy B %.4g)\n",
                   step, packed_.surface.size(), packed_.order.size(), static_cast<long>(connectivity_),
                   track_bytes_.size(), motion.bytes.size(), static_cast<long>(motion.part.functions.cols()),
                   detail.bytes.size(), static_cast<long>(detail.part.functions.cols()), motion.squared_error,
                   detail.squared_error, detail_->energy());
    }
    out.squared_error = motion.squared_error + detail.squared_error;
    HarmonicsSetup setup = setup_;
    setup.step = step;
    ByteWriter header;
    put_setup(header, setup);
    BitstreamWriter writer("mesh-codec:mesh-harmonics");
    writer.set_option("connectivity", connectivity_);
    writer.add_section("setup", std::move(header).take());
    writer.add_section("surface", packed_.surface);
    writer.add_section("order", packed_.order);
    writer.add_section("rigid", track_bytes_);
    writer.add_section("m0", motion.bytes);
    writer.add_section("d0", detail.bytes);
    out.stream = writer.finish();
    block.motion = std::move(motion.part);
    block.detail = std::move(detail.part);
    return out;
  }

 private:
  void align(int key) {
    const auto motions = rigid_motions(mesh_, key);
    track_ = quantised(motions, setup_.size);
    aligned_.resize(static_cast<std::size_t>(mesh_.frames));
    for_frames(mesh_.frames, [&](int f) {
      aligned_[static_cast<std::size_t>(f)] = track_.motion(static_cast<std::size_t>(f)).undo(frame_points(mesh_, f));
    });
  }
  void find_coefficients() {
    coefficients_.resize(3 * space_->functions(), mesh_.frames);
    for_frames(mesh_.frames, [&](int f) {
      const Coefficients c =
          space_->projection().coefficients(aligned_[static_cast<std::size_t>(f)]) - space_->key_coefficients();
      for (int k = 0; k < space_->functions(); ++k) {
        for (int d = 0; d < 3; ++d) coefficients_(3 * k + d, f) = c(k, d);
      }
    });
    motion_ = std::make_unique<PartCoder>(coefficients_, space_->function_graph());
  }
  [[nodiscard]] Coefficients true_coefficients(int f) const {
    Coefficients c = space_->key_coefficients();
    for (int k = 0; k < space_->functions(); ++k) {
      for (int d = 0; d < 3; ++d) c(k, d) += coefficients_(3 * k + d, f);
    }
    return c;
  }
  template <typename Which>
  [[nodiscard]] Eigen::MatrixXd residual_table(const Which& coefficients) const {
    Eigen::MatrixXd out(3 * std::int64_t{mesh_.vertices}, mesh_.frames);
    for_frames(mesh_.frames, [&](int f) {
      space_->residual(aligned_[static_cast<std::size_t>(f)], coefficients(f), settings_.rotate,
                       std::span(out.col(f).data(), static_cast<std::size_t>(out.rows())));
    });
    return out;
  }

  const MeshSequence& mesh_;
  Settings settings_;
  HarmonicsSetup setup_;
  RigidTrack track_;
  Bytes track_bytes_;
  PackedKeyMesh packed_;
  std::int64_t connectivity_ = 0;
  std::vector<Points> aligned_;
  std::shared_ptr<const HarmonicsSpace> space_;
  Eigen::MatrixXd coefficients_, residuals_;
  std::unique_ptr<PartCoder> motion_, detail_;
};

}  // namespace

Bytes encode_harmonics(const MeshSequence& mesh, const MeshCodecOptions& options) {
  const int key = cluster_frames(mesh, {.clusters = 1}).medoid[0];
  const double spread = rms_spread(mesh);
  const double kg = options.kg.value_or(0.5);
  const double rms = kg / 100 * spread;
  Settings settings;
  settings.functions = std::min(options.bases > 0 ? options.bases : 400, mesh.vertices);
  settings.key_step = rms * env("M2KEY", 1.7);
  settings.rate_weight = env("M2L", 0.12);
  settings.coarseness = env("M2C", 1);
  settings.rotate = env("M2R", 1) > 0;
  settings.motion = env("M2T", 0) > 0 ? FrameTransform::cosines : FrameTransform::components;
  settings.detail = env("M2TD", 0) > 0 ? FrameTransform::cosines : FrameTransform::components;
  Analysis analysis(mesh, key, settings);
  analysis.prepare(1);
  const double wanted = rms * rms * 3.0 * mesh.vertices * mesh.frames;
  double step = rms * 8;
  double low = 0, high = 0;
  for (int i = 0; i < 9; ++i) {
    const auto attempt = analysis.code(step, false);
    const double ratio = std::sqrt(attempt.squared_error / wanted);
    if (std::abs(ratio - 1) < 0.01) break;
    (ratio > 1 ? high : low) = step;
    step = low > 0 && high > 0 ? std::sqrt(low * high) : step / ratio;
  }
  auto attempt = analysis.code(step, true);
  std::fprintf(stderr, "kg by parts %.4f\n", std::sqrt(attempt.squared_error / wanted) * kg);
  return attempt.stream;
}

}  // namespace kinespace
