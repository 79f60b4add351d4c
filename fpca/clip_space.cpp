#include "kinespace/fpca/clip_space.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/storage/bitstream.h"

namespace kinespace {
namespace {

constexpr int clip_points = 64;
constexpr int clips_per_visit = 64;

// T x C of the whole clip, breaks and all, velocity in metres per clip.
SampleMatrix clip_samples(const MotionSpace& space, const ClipCurves& curves) {
  const int last = curves.frames() - 1;
  Run whole{{0, last}};
  if (last == 0) whole.cuts = {0};
  SampleMatrix out = RunSampler(curves.values, whole, curves.rate_hz).sample(0, last, Warp(), space.points());
  out.array().rowwise() *= space.reference_signs(curves.values).array();
  out.leftCols<3>() *= last / curves.rate_hz;
  return out;
}

std::vector<SampleMatrix> block_samples(const PreparedSource& clips, const MotionSpace& space, int start, int count) {
  std::vector<SampleMatrix> out(static_cast<std::size_t>(count));
  parallel_for(0, count,
               [&](int i) { out[static_cast<std::size_t>(i)] = clip_samples(space, clips.load(start + i).curves); });
  return out;
}

template <typename Visit>
void for_each_block(const PreparedSource& clips, const MotionSpace& space, const Progress& progress,
                    const Visit& visit) {
  for (int start = 0; start < clips.count; start += clips_per_visit) {
    progress.check_stop();
    progress.at("index", static_cast<double>(start) / clips.count);
    visit(block_samples(clips, space, start, std::min(clips_per_visit, clips.count - start)));
  }
}

}  // namespace

void ClipSpaceOptions::validate() const {
  if (functions < 1 || functions > clip_points) {
    throw Error(ErrorKind::usage, {.found = fmt::format("ClipSpaceOptions::functions = {}", functions),
                                   .expected = fmt::format("1 to {}", clip_points)});
  }
  if (!(travel_share >= 0 && travel_share <= 10)) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("ClipSpaceOptions::travel_share = {}", travel_share), .expected = "0 to 10"});
  }
}

ClipSpace ClipSpace::build(const PreparedSource& clips, const Eigen::Matrix4Xd& references,
                           const ClipSpaceOptions& options, const Compute& compute, const Progress& progress) {
  options.validate();
  if (clips.count == 0) throw Error(ErrorKind::usage, {.found = "no clips", .expected = "one clip or more"});
  MotionSpace space(clips.load(0).skeleton, {.functions = options.functions}, clip_points);
  space.set_references(references);

  // Variance about the mean curve of each component, all points and clips together.
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(space.curves());
  Eigen::RowVectorXd squares = sum;
  for_each_block(clips, space, progress, [&](const std::vector<SampleMatrix>& block) {
    for (const SampleMatrix& s : block) {
      sum += s.colwise().mean();
      squares += s.colwise().squaredNorm() / static_cast<double>(s.rows());
    }
  });
  const Eigen::RowVectorXd variance = (squares / clips.count - (sum / clips.count).cwiseAbs2()).cwiseMax(0.0);
  const double travel = variance.head<3>().sum();
  const double rotation = variance.tail(space.curves() - 3).sum();
  const double scale = travel > 0 && rotation > 0 ? std::sqrt(options.travel_share * rotation / travel) : 1;

  std::vector<CurveMoments> moments = space.empty_moments();
  for_each_block(clips, space, progress, [&](std::vector<SampleMatrix> block) {
    for (SampleMatrix& s : block) s.leftCols<3>() *= scale;
    space.accumulate(block, moments, compute);
  });
  space.fit(std::move(moments));
  progress.at("index", 1);
  return {std::move(space), scale};
}

ClipSpace ClipSpace::extend(const PreparedSource& clips, const Compute& compute, const Progress& progress) const {
  std::vector<CurveMoments> moments = space_.moments();
  for_each_block(clips, space_, progress, [&](std::vector<SampleMatrix> block) {
    for (SampleMatrix& s : block) s.leftCols<3>() *= travel_scale_;
    space_.accumulate(block, moments, compute);
  });
  MotionSpace extended(space_.skeleton(), space_.options(), space_.points());
  extended.set_references(space_.references());
  extended.fit(std::move(moments));
  return {std::move(extended), travel_scale_};
}

std::vector<float> ClipSpace::vector_of(const ClipCurves& curves, const Compute& compute) const {
  const ClipCurves* const one = &curves;
  return std::move(vectors_of(std::span(&one, 1), compute).front());
}

std::vector<std::vector<float>> ClipSpace::vectors_of(std::span<const ClipCurves* const> clips,
                                                      const Compute& compute) const {
  std::vector<SampleMatrix> samples(clips.size());
  parallel_for(std::size_t{0}, clips.size(), [&](std::size_t i) {
    samples[i] = clip_samples(space_, *clips[i]);
    samples[i].leftCols<3>() *= travel_scale_;
  });
  std::vector<std::vector<float>> out;
  for (const ScoreMatrix& scores : space_.scores(samples, compute)) {
    out.emplace_back(scores.data(), scores.data() + scores.size());
  }
  return out;
}

Bytes ClipSpace::pack() const {
  BitstreamWriter out("clip-space");
  out.set_option("travel_scale", travel_scale_);
  out.add_section("space", pack_space(space_));
  return out.finish();
}

ClipSpace ClipSpace::unpack(std::span<const std::byte> bytes, const std::string& source) {
  const Bitstream stream = Bitstream::parse(bytes, source);
  stream.require_kind("clip-space");
  const double scale = stream.number_option("travel_scale", 0, 1e12);
  MotionSpace space = unpack_space(stream.section("space"), source);
  if (space.options().pinned || space.options().pace != 1 || space.options().cycles != 0) {
    throw Error(ErrorKind::bad_input,
                {.file = source, .found = "a space of sequences", .expected = "a space of whole clips"});
  }
  return {std::move(space), scale};
}

std::vector<float> distance_weights(const Skeleton& skeleton) {
  Eigen::RowVectorXd weights = curve_weights(skeleton);
  const double joints = static_cast<double>(weights.size() - 3);
  const double typical = std::sqrt(weights.tail(weights.size() - 3).squaredNorm() / joints);
  weights.head<3>().setConstant(typical);
  if (typical > 0) weights /= typical;
  std::vector<float> out(static_cast<std::size_t>(weights.size()));
  for (Eigen::Index c = 0; c < weights.size(); ++c) out[static_cast<std::size_t>(c)] = static_cast<float>(weights(c));
  return out;
}

double squared_distance(std::span<const float> a, std::span<const float> b, std::span<const float> weights) {
  double sum = 0;
  if (weights.empty()) {
    const Eigen::Map<const Eigen::VectorXf> x(a.data(), static_cast<Eigen::Index>(a.size()));
    const Eigen::Map<const Eigen::VectorXf> y(b.data(), static_cast<Eigen::Index>(b.size()));
    return static_cast<double>((x - y).squaredNorm());
  }
  const std::size_t curves = weights.size();
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = static_cast<double>(weights[i % curves]) * (static_cast<double>(a[i]) - static_cast<double>(b[i]));
    sum += d * d;
  }
  return sum;
}

}  // namespace kinespace
