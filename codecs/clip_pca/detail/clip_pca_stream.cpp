#include "kinespace/codecs/clip_pca/detail/clip_pca_stream.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kinespace/codecs/rma/contact_ik.h"
#include "kinespace/codecs/rma/marker_clips.h"
#include "kinespace/codecs/rma/marker_decoder.h"
#include "kinespace/codecs/rma/seams.h"

namespace kinespace {
namespace {

constexpr double smoothing_s = 0.06;
constexpr int axis_buckets = 24;
enum Context : int {
  header = contact_contexts,
  pose,
  mean_number = pose + 3,
  range_number = mean_number + 4,
  axis_entry,
  group_number = axis_entry + 4,
  coefficient,
  root_context = coefficient + axis_buckets,
  context_count = root_context + root_contexts
};
constexpr std::int64_t largest_value = std::int64_t{1} << 30;

int bucket(std::size_t axis) {
  return static_cast<int>(std::min<std::size_t>(axis, axis_buckets - 1));
}

std::size_t pieces_of(int frames, int length) {
  return static_cast<std::size_t>((frames - 1) / length + 1);
}

}  // namespace

double ClipPcaGroup::step_cm(std::size_t axis) const {
  return AxisSteps{.range = range[axis], .bits = coefficient_bits}.step_cm();
}

std::array<double, 4> bernstein(int frame, int length) {
  const double u = static_cast<double>(frame) / (length - 1);
  const double v = 1 - u;
  return {v * v * v, 3 * v * v * u, 3 * v * u * u, u * u * u};
}

std::int64_t numbers_in(const ClipPcaStream& stream) {
  std::int64_t out = 0;
  for (const ClipPcaGroup& group : stream.groups)
    out += static_cast<std::int64_t>(group.mean.size() + group.axes.size());
  for (const ClipPcaPiece& piece : stream.pieces) out += 16 + static_cast<std::int64_t>(piece.coefficients.size());
  for (const RootCode& root : stream.roots) {
    for (const CurveCode& curve : root.curves) {
      out += 16 + static_cast<std::int64_t>(curve.values.size() + curve.added.size());
    }
  }
  for (const auto& clip : stream.contacts) {
    for (const ContactCode& code : clip) out += 16 + code.frames();
  }
  return out;
}

Bytes pack_clip_pca(const ClipPcaStream& stream) {
  ValueWriter out(context_count);
  out.put(stream.length, header);
  out.put(stream.root_span, header);
  put_reference_pose(out, stream.reference, pose);
  out.put(static_cast<std::int64_t>(stream.groups.size()), header);
  for (const ClipPcaGroup& group : stream.groups) {
    const std::size_t quarter = std::max<std::size_t>(1, group.mean.size() / 4);
    // Control points of a coordinate lie near each other.
    for (std::size_t i = 0; i < group.mean.size(); ++i) {
      const std::int64_t near = i >= quarter ? group.mean[i - quarter] : 0;
      out.put(group.mean[i] - near, mean_number + static_cast<int>(i / quarter));
    }
    out.put(group.axis_count(), header);
    for (const int range : group.range) out.put(range, range_number);
    for (std::size_t i = 0; i < group.axes.size(); ++i) {
      const std::size_t at = i % group.mean.size();
      out.put(group.axes[i] - (at >= quarter ? group.axes[i - quarter] : 0),
              axis_entry + static_cast<int>(at / quarter));
    }
  }
  for (const ClipPcaPiece& piece : stream.pieces) {
    out.put(piece.group, group_number);
    for (std::size_t a = 0; a < piece.coefficients.size(); ++a) out.put(piece.coefficients[a], coefficient + bucket(a));
  }
  for (std::size_t c = 0; c < stream.roots.size(); ++c) {
    put_root(out, stream.roots[c], stream.root_span, root_context);
    put_contacts(out, stream.contacts[c]);
  }
  return std::move(out).finish();
}

namespace {

ClipPcaGroup get_group(ValueReader& in, std::size_t size, std::int64_t& numbers) {
  ClipPcaGroup out;
  const std::size_t quarter = std::max<std::size_t>(1, size / 4);
  numbers -= static_cast<std::int64_t>(size);
  if (numbers < 0) in.damaged();
  for (std::size_t i = 0; i < size; ++i) {
    const std::int64_t near = i >= quarter ? out.mean[i - quarter] : 0;
    const std::int64_t value = near + in.get(mean_number + static_cast<int>(i / quarter));
    if (std::abs(value) > largest_value) in.damaged();
    out.mean.push_back(static_cast<std::int32_t>(value));
  }
  const std::int64_t axes = in.get_between(1, static_cast<std::int64_t>(size), header);
  numbers -= axes * static_cast<std::int64_t>(size);
  if (numbers < 0) in.damaged();
  for (std::int64_t a = 0; a < axes; ++a)
    out.range.push_back(static_cast<int>(in.get_between(-640, 640, range_number)));
  out.axes.resize(size * static_cast<std::size_t>(axes));
  for (std::size_t i = 0; i < out.axes.size(); ++i) {
    const std::size_t at = i % size;
    const std::int64_t near = at >= quarter ? out.axes[i - quarter] : 0;
    const std::int64_t value = near + in.get(axis_entry + static_cast<int>(at / quarter));
    if (std::abs(value) > 16384) in.damaged();
    out.axes[i] = static_cast<std::int16_t>(value);
  }
  return out;
}

}  // namespace

ClipPcaStream unpack_clip_pca(std::span<const std::byte> bytes, const ClipTable& table, int coordinates,
                              std::int64_t numbers, const std::string& source) {
  ValueReader in(bytes, context_count, source);
  ClipPcaStream out;
  out.length = static_cast<int>(in.get_between(2, 512, header));
  out.root_span = static_cast<int>(in.get_between(1, 512, header));
  out.reference = get_reference_pose(in, static_cast<int>(table.skeletons.front().rotating_joints().size()), pose);
  const std::int64_t groups = in.get_between(1, 4096, header);
  for (std::int64_t g = 0; g < groups; ++g) {
    out.groups.push_back(get_group(in, 4 * static_cast<std::size_t>(coordinates), numbers));
  }
  for (const ClipEntry& entry : table.clips) {
    for (std::size_t p = pieces_of(entry.frames, out.length); p > 0; --p) {
      ClipPcaPiece piece{.group = static_cast<int>(in.get_between(0, groups - 1, group_number)), .coefficients = {}};
      const int axes = out.groups[static_cast<std::size_t>(piece.group)].axis_count();
      numbers -= 16 + axes;
      if (numbers < 0) in.damaged();
      for (int a = 0; a < axes; ++a) {
        const std::int64_t value =
            in.get_between(-largest_value, largest_value, coefficient + bucket(static_cast<std::size_t>(a)));
        piece.coefficients.push_back(static_cast<std::int32_t>(value));
      }
      out.pieces.push_back(std::move(piece));
    }
  }
  for (const ClipEntry& entry : table.clips) {
    out.roots.push_back(get_root(in, entry.frames, out.root_span, root_context, numbers));
    const Skeleton& skeleton = table.skeletons[static_cast<std::size_t>(entry.skeleton)];
    out.contacts.push_back(get_contacts(in, entry.frames, skeleton.joint_count(), numbers));
  }
  in.expect_end();
  return out;
}

ClipPcaDecoder::ClipPcaDecoder(const ClipTable& table, const ClipPcaStream& stream) : table_(table), stream_(stream) {
  for (const Skeleton& skeleton : table.skeletons) rigs_.emplace_back(skeleton);
  std::size_t at = 0;
  for (const ClipEntry& entry : table.clips) {
    first_piece_.push_back(at);
    at += pieces_of(entry.frames, stream.length);
  }
  for (const ClipPcaGroup& group : stream.groups) {
    std::vector<double> axes;
    axes.reserve(group.axes.size());
    for (const std::int16_t a : group.axes) axes.push_back(a / ClipPcaGroup::axis_steps);
    axes_.push_back(std::move(axes));
  }
}

std::vector<double> ClipPcaDecoder::control_points(std::size_t number) const {
  const ClipPcaPiece& piece = stream_.pieces[number];
  const auto g = static_cast<std::size_t>(piece.group);
  const ClipPcaGroup& group = stream_.groups[g];
  std::vector<double> out;
  out.reserve(group.mean.size());
  for (const std::int32_t m : group.mean) out.push_back(m * ClipPcaGroup::mean_step_cm);
  for (std::size_t a = 0; a < piece.coefficients.size(); ++a) {
    const double h = piece.coefficients[a] * group.step_cm(a);
    const double* axis = axes_[g].data() + a * out.size();
    for (std::size_t k = 0; k < out.size(); ++k) out[k] += h * axis[k];
  }
  return out;
}

Clip ClipPcaDecoder::decode_without_contacts(std::size_t clip) const {
  const ClipEntry& entry = table_.clips[clip];
  const auto length = static_cast<std::size_t>(stream_.length);
  const MarkerRig& rig = rigs_[static_cast<std::size_t>(entry.skeleton)];
  const auto coordinates = static_cast<std::size_t>(rig.dimensions() + 3 * rig.joint_count());
  std::vector<int> seams;
  for (int f = stream_.length; f < entry.frames; f += stream_.length) seams.push_back(f);
  std::vector<std::vector<double>> pieces(pieces_of(entry.frames, stream_.length));
  const auto raw = [&](int frame, std::span<double> out) {
    const std::size_t p = static_cast<std::size_t>(frame) / length;
    if (pieces[p].empty()) {
      pieces[p] = control_points(first_piece_[clip] + p);
      if (p >= 2) pieces[p - 2] = {};
    }
    const auto weight = bernstein(static_cast<int>(static_cast<std::size_t>(frame) % length), stream_.length);
    const double* c = pieces[p].data();
    for (std::size_t k = 0; k < coordinates; ++k) {
      out[k] = weight[0] * c[k] + weight[1] * c[coordinates + k] + weight[2] * c[2 * coordinates + k] +
               weight[3] * c[3 * coordinates + k];
    }
  };
  SeamSmoother smoother(static_cast<int>(coordinates), entry.frames, seams, smoothing_s * entry.rate_hz, raw);
  return clip_from_markers(
      entry, table_.skeletons[static_cast<std::size_t>(entry.skeleton)], rig, stream_.reference,
      MarkerDecoder::alignment(stream_.roots[clip], stream_.root_span),
      [&](int frame, std::span<double> out) {
        raw(frame, out);
        smoother.apply(frame, out);
      },
      true);
}

Clip ClipPcaDecoder::decode(std::size_t clip) const {
  Clip out = decode_without_contacts(clip);
  hold_contacts(out, contact_tracks(stream_.contacts[clip], out));
  return out;
}

}  // namespace kinespace
