#include "kinespace/motion/curves.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kinespace/base/pages.h"

namespace kinespace {
namespace {

constexpr double cm_per_metre = 100;

// The joints above the travel root, from joint 0 down.
std::vector<int> ancestors_of(const Skeleton& skeleton, int joint) {
  std::vector<int> out;
  for (int j = skeleton.joints[static_cast<std::size_t>(joint)].parent; j >= 0;
       j = skeleton.joints[static_cast<std::size_t>(j)].parent) {
    out.push_back(j);
  }
  std::ranges::reverse(out);
  return out;
}

struct RigidMotion {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

RigidMotion compose(const Clip& clip, std::span<const int> joints, int frame) {
  RigidMotion out;
  for (const int j : joints) {
    out.position += out.rotation * clip.translation(j, frame);
    out.rotation = out.rotation * clip.rotation(j, frame);
  }
  return out;
}

// Fewest knots such that straight lines between them stay within the tolerance in every dimension (greedy: each piece
// reaches as far as the cone of allowed slopes from its first knot stays open).
SideTrack simplify(int joint, int dimensions, const std::vector<double>& samples, double tolerance) {
  const auto d = static_cast<std::size_t>(dimensions);
  const auto frames = samples.size() / d;
  SideTrack track{joint, dimensions, {0}, {samples.begin(), samples.begin() + dimensions}};
  std::size_t start = 0;
  std::vector<double> low(d), high(d);
  while (start + 1 < frames) {
    std::ranges::fill(low, -std::numeric_limits<double>::infinity());
    std::ranges::fill(high, std::numeric_limits<double>::infinity());
    std::size_t reach = start + 1;
    for (std::size_t f = start + 1; f < frames; ++f) {
      const double span = static_cast<double>(f - start);
      bool inside = true;  // the sample itself lies in the cone, so a line may end on it
      bool open = true;
      for (std::size_t k = 0; k < d; ++k) {
        const double change = samples[f * d + k] - samples[start * d + k];
        inside = inside && change / span >= low[k] && change / span <= high[k];
        low[k] = std::max(low[k], (change - tolerance) / span);
        high[k] = std::min(high[k], (change + tolerance) / span);
        open = open && low[k] <= high[k];
      }
      if (inside) reach = f;
      if (!open) break;
    }
    track.frames.push_back(static_cast<int>(reach));
    track.values.insert(track.values.end(), samples.begin() + static_cast<std::ptrdiff_t>(reach * d),
                        samples.begin() + static_cast<std::ptrdiff_t>((reach + 1) * d));
    start = reach;
  }
  return track;
}

SideTrack translation_side_track(const Clip::TranslationTrack& track) {
  std::vector<double> samples;
  samples.reserve(track.values.size() * 3);
  for (const auto& v : track.values) samples.insert(samples.end(), v.data(), v.data() + 3);
  return simplify(track.joint, 3, samples, 1e-4);
}

// The rotations of a joint above the travel root, kept unless they are all the identity.
void add_rotation_side_track(const Clip& clip, int joint, std::vector<SideTrack>& out) {
  const auto track = clip.rotation_track(joint);
  std::vector<double> samples(track.begin(), track.end());
  for (std::size_t i = 4; i + 3 < samples.size(); i += 4) {
    double dot = 0;
    for (std::size_t k = 0; k < 4; ++k) dot += samples[i + k] * samples[i + k - 4];
    if (dot < 0) {
      for (std::size_t k = 0; k < 4; ++k) samples[i + k] = -samples[i + k];
    }
  }
  bool rests = true;
  for (std::size_t i = 0; i < samples.size(); i += 4) rests = rests && std::abs(std::abs(samples[i]) - 1) < 1e-12;
  if (!rests) out.push_back(simplify(joint, 4, samples, 1e-7));
}

void interpolate(const SideTrack& track, int frame, std::size_t& piece, double* out) {
  while (piece + 2 < track.frames.size() && track.frames[piece + 1] <= frame) ++piece;
  const auto d = static_cast<std::size_t>(track.dimensions);
  if (track.frames.size() == 1) {
    std::copy_n(track.values.begin(), d, out);
    return;
  }
  const double span = track.frames[piece + 1] - track.frames[piece];
  const double b = (frame - track.frames[piece]) / span;
  for (std::size_t k = 0; k < d; ++k) {
    out[k] = (1 - b) * track.values[piece * d + k] + b * track.values[(piece + 1) * d + k];
  }
}

// Columns [at, at + 4) hold unit quaternions: takes out the sign flips from frame to frame.
void make_continuous(SampleMatrix& values, Eigen::Index at) {
  for (Eigen::Index f = 1; f < values.rows(); ++f) {
    if (values.row(f).segment<4>(at).dot(values.row(f - 1).segment<4>(at)) < 0) values.row(f).segment<4>(at) *= -1;
  }
}

}  // namespace

CurveLayout curve_layout(const Skeleton& skeleton) {
  return {skeleton.rotating_joints()};
}

std::vector<SideTrack> side_tracks_of(const Clip& clip) {
  const int root = curve_layout(clip.skeleton).joints.front();
  std::vector<SideTrack> out;
  for (const int j : ancestors_of(clip.skeleton, root)) add_rotation_side_track(clip, j, out);
  for (const auto& track : clip.translations) {
    if (track.joint != root) out.push_back(translation_side_track(track));
  }
  return out;
}

void apply_side_track(const SideTrack& track, int first, Clip& clip) {
  const auto after = std::ranges::upper_bound(track.frames, first);
  auto piece = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, after - track.frames.begin() - 1));
  piece = std::min(piece, track.frames.size() - std::min<std::size_t>(2, track.frames.size()));
  double v[4];
  for (int f = 0; f < clip.frames; ++f) {
    interpolate(track, first + f, piece, v);
    if (track.dimensions == 3) {
      clip.require_translation_track(track.joint).values[static_cast<std::size_t>(f)] = {v[0], v[1], v[2]};
    } else {
      clip.set_rotation(track.joint, f, Eigen::Quaterniond(v[0], v[1], v[2], v[3]).normalized());
    }
  }
}

double heading_of(const Eigen::Quaterniond& q) {
  if (std::hypot(q.w(), q.y()) < 1e-9) return 0;
  double angle = 2 * std::atan2(q.y(), q.w());
  if (angle > std::numbers::pi) angle -= 2 * std::numbers::pi;
  if (angle <= -std::numbers::pi) angle += 2 * std::numbers::pi;
  return angle;
}

namespace {

constexpr int frames_at_a_time = 65536;

// The curves block by block of frames; `done` hears of each.
template <typename Done>
ClipCurves make_curves(const Clip& clip, const Done& done) {
  const CurveLayout layout = curve_layout(clip.skeleton);
  const int root = layout.joints.front();
  const std::vector<int> above = ancestors_of(clip.skeleton, root);

  ClipCurves out{.name = clip.name, .rate_hz = clip.rate_hz, .values = SampleMatrix(clip.frames, layout.curve_count())};
  out.side_tracks = side_tracks_of(clip);

  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  for (int first = 0; first < clip.frames; first += frames_at_a_time) {
    const int count = std::min(frames_at_a_time, clip.frames - first);
    for (int f = first; f < first + count; ++f) {
      const RigidMotion base = compose(clip, above, f);
      const Eigen::Vector3d position = base.position + base.rotation * clip.translation(root, f);
      const Eigen::Quaterniond rotation = base.rotation * clip.rotation(root, f);
      if (f == 0) {
        out.placement = {position, heading_of(rotation)};
        turn = Eigen::AngleAxisd(-out.placement.heading_rad, Eigen::Vector3d::UnitY());
      }
      const Eigen::Quaterniond q = turn * rotation;
      out.values.row(f).head<3>() = (turn * (position - out.placement.start_cm) / cm_per_metre).transpose();
      out.values.row(f).segment<4>(3) << q.w(), q.x(), q.y(), q.z();
    }
    for (int k = 1; k < layout.joint_count(); ++k) {
      const auto track = clip.rotation_track(layout.joints[static_cast<std::size_t>(k)]);
      out.values.block(first, 3 + 4 * k, count, 4) =
          Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>>(
              track.data() + 4 * static_cast<std::size_t>(first), count, 4);
    }
    done(first, count);
  }
  for (int k = 0; k < layout.joint_count(); ++k) make_continuous(out.values, 3 + 4 * k);
  return out;
}

}  // namespace

ClipCurves clip_curves(const Clip& clip) {
  return make_curves(clip, [](int, int) {});
}

ClipCurves clip_curves(Clip&& clip) {
  ClipCurves out = make_curves(clip, [&clip](int first, int count) {
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
      discard_pages(
          clip.rotation_track(j).subspan(4 * static_cast<std::size_t>(first), 4 * static_cast<std::size_t>(count)));
    }
  });
  clip = {};
  return out;
}

Clip clip_from_curves(const ClipCurves& curves, const Skeleton& skeleton) {
  return clip_of_frames(curves, curves.values, 0, skeleton);
}

Clip clip_of_frames(const ClipCurves& curves, const Eigen::Ref<const SampleMatrix>& rows, int first,
                    const Skeleton& skeleton) {
  const CurveLayout layout = curve_layout(skeleton);
  const int root = layout.joints.front();
  const std::vector<int> above = ancestors_of(skeleton, root);
  Clip clip = make_clip(curves.name, skeleton, curves.rate_hz, static_cast<int>(rows.rows()));
  for (const SideTrack& track : curves.side_tracks) apply_side_track(track, first, clip);

  const Eigen::Quaterniond turn(Eigen::AngleAxisd(curves.placement.heading_rad, Eigen::Vector3d::UnitY()));
  auto& travel = clip.require_translation_track(root);
  for (int f = 0; f < clip.frames; ++f) {
    const auto row = rows.row(f);
    const Eigen::Vector3d position =
        curves.placement.start_cm + turn * Eigen::Vector3d(row.head<3>().transpose() * cm_per_metre);
    const Eigen::Quaterniond rotation = turn * Eigen::Quaterniond(row(3), row(4), row(5), row(6)).normalized();
    const RigidMotion base = compose(clip, above, f);
    travel.values[static_cast<std::size_t>(f)] = base.rotation.conjugate() * (position - base.position);
    clip.set_rotation(root, f, base.rotation.conjugate() * rotation);
  }
  for (int k = 1; k < layout.joint_count(); ++k) {
    const int joint = layout.joints[static_cast<std::size_t>(k)];
    for (int f = 0; f < clip.frames; ++f) {
      const auto q = rows.row(f).segment<4>(3 + 4 * k);
      clip.set_rotation(joint, f, Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized());
    }
  }
  return clip;
}

Bytes pack_side_tracks(const std::vector<SideTrack>& tracks) {
  ByteWriter out;
  out.put(static_cast<std::uint32_t>(tracks.size()));
  for (const SideTrack& track : tracks) {
    out.put(static_cast<std::int32_t>(track.joint));
    out.put(static_cast<std::uint8_t>(track.dimensions));
    out.put(static_cast<std::uint32_t>(track.frames.size()));
    out.put_array(std::span<const int>(track.frames));
    out.put_array(std::span<const double>(track.values));
  }
  return std::move(out).take();
}

std::vector<SideTrack> unpack_side_tracks(std::span<const std::byte> bytes, int frames, const Skeleton& skeleton,
                                          const std::string& source) {
  ByteReader in(bytes, source);
  std::vector<SideTrack> out;
  const auto count = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count; ++i) {
    SideTrack track;
    track.joint = in.get<std::int32_t>();
    track.dimensions = in.get<std::uint8_t>();
    const auto knots = in.get<std::uint32_t>();
    track.frames = in.get_array<int>(knots);
    if (track.joint < 0 || track.joint >= skeleton.joint_count() || (track.dimensions != 3 && track.dimensions != 4)) {
      in.fail("a side track of joint " + std::to_string(track.joint), "a joint of the skeleton");
    }
    const bool whole = !track.frames.empty() && track.frames.front() == 0 && track.frames.back() == frames - 1 &&
                       std::ranges::is_sorted(track.frames, std::less_equal<>{});
    if (!whole) in.fail("side track knots out of order", "frames ascending from the first to the last");
    track.values =
        in.get_array<double>(static_cast<std::uint64_t>(knots) * static_cast<std::uint64_t>(track.dimensions));
    if (!std::ranges::all_of(track.values, [](double v) { return std::isfinite(v); })) {
      in.fail("a side track value that is no number", "finite values");
    }
    out.push_back(std::move(track));
  }
  in.expect_end();
  return out;
}

}  // namespace kinespace
