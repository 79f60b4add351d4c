#include "kinespace/codecs/rma/marker_stream.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kinespace/codecs/rma/detail/seam_easing.h"
#include "kinespace/codecs/rma/detail/spline_fit.h"
#include "kinespace/entropy/adaptive_bits.h"

namespace kinespace {
namespace {

// Contexts of the coder.
constexpr int axis_buckets = 8;
enum Context : int {
  header = contact_contexts,
  kind,
  group_number,
  length,
  primary_number,
  reference_start,
  reference_move,
  pose,
  mean = pose + 3,
  range_number = mean + 6,
  bits_number,
  axis_count_number,
  minimum_number,
  axis_entry = minimum_number + 2 * axis_buckets,
  root_curve = axis_entry + axis_buckets,
  axis_curve = root_curve + root_contexts,
  context_count = axis_curve + 2 * axis_buckets * curve_contexts
};

int bucket(std::size_t axis) {
  constexpr std::array<int, 16> of{0, 1, 2, 3, 3, 4, 4, 5, 5, 5, 6, 6, 6, 6, 6, 6};
  return axis < of.size() ? of[axis] : 7;
}

int size_bucket(std::int64_t value) {
  const std::int64_t size = std::abs(value);
  return size == 0 ? 0 : size <= 1 ? 1 : size <= 4 ? 2 : 3;
}

constexpr std::int64_t largest_value = std::int64_t{1} << 30;

}  // namespace

double AxisSteps::range_cm() const {
  // 2^(range / 16) by square roots: the same bits everywhere.
  double out = std::ldexp(1.0, range >> 4);
  double root = 2;
  for (int bit = 8; bit >= 1; bit >>= 1) {
    root = std::sqrt(root);
    if ((range & bit) != 0) out *= root;
  }
  return out;
}

double AxisSteps::step_cm() const {
  return std::ldexp(range_cm(), -bits);
}

double AxisSteps::minimum_step_cm(int minimum_bits) const {
  return std::ldexp(range_cm(), -minimum_bits);
}

int AxisSteps::range_code(double range_cm) {
  constexpr double least = 1e-6;
  return static_cast<int>(std::ceil(16 * std::log2(std::max(range_cm, least)) + 1e-9));
}

int marker_dimensions(const ClipTable& table) {
  return 3 + 6 * static_cast<int>(table.skeletons.front().rotating_joints().size());
}

std::int64_t numbers_in(const MarkerStream& stream) {
  std::int64_t out = 0;
  const auto add = [&](const CurveCode& curve) {
    out += static_cast<std::int64_t>(curve.values.size() + curve.added.size()) + 16;
  };
  for (const MarkerClip& clip : stream.clips) {
    out += 32 + static_cast<std::int64_t>(clip.reference.size());
    for (const CurveCode& curve : clip.curves) add(curve);
  }
  for (const RootCode& root : stream.roots) {
    for (const CurveCode& curve : root.curves) add(curve);
  }
  for (const auto& clip : stream.contacts) {
    for (const ContactCode& code : clip) out += 16 + code.frames();
  }
  return out;
}

void put_reference_pose(ValueWriter& out, const ReferencePose& pose_, int context) {
  for (const auto& steps : pose_.steps) {
    for (int k = 0; k < 3; ++k) out.put(steps[static_cast<std::size_t>(k)], context + k);
  }
}

ReferencePose get_reference_pose(ValueReader& in, int joints, int context) {
  ReferencePose out;
  for (int j = 0; j < joints; ++j) {
    std::array<std::int8_t, 3> steps{};
    for (int k = 0; k < 3; ++k) {
      steps[static_cast<std::size_t>(k)] = static_cast<std::int8_t>(in.get_between(-127, 127, context + k));
    }
    out.steps.push_back(steps);
  }
  return out;
}

// Contexts of a curve: 0 first value; 1..4 differences by the size of the one before; 5, 6 whether a stretch between
// regular frames has added ones, by the stretch before; 7, 8 whether a frame of such a stretch is one.
void put_curve(ValueWriter& out, const CurveCode& curve, int frames, int span, int context) {
  const std::vector<int> regular = regular_knots(frames, span);
  std::size_t next = 0;
  bool before = false;
  for (std::size_t r = 0; r + 1 < regular.size(); ++r) {
    if (regular[r + 1] - regular[r] < 2) continue;
    const bool any = next < curve.added.size() && curve.added[next] < regular[r + 1];
    out.put_bit(any, context + 5 + (before ? 1 : 0));
    before = any;
    bool last = false;
    for (int f = regular[r] + 1; any && f < regular[r + 1]; ++f) {
      const bool here = next < curve.added.size() && curve.added[next] == f;
      out.put_bit(here, context + 7 + (last ? 1 : 0));
      next += here ? 1 : 0;
      last = here;
    }
  }
  std::int64_t difference = 0;
  for (std::size_t i = 0; i < curve.values.size(); ++i) {
    const std::int64_t value = curve.values[i];
    const std::int64_t base = i > 0 ? curve.values[i - 1] : 0;
    out.put(value - base, i == 0 ? context : context + 1 + size_bucket(difference));
    difference = i == 0 ? 0 : value - base;
  }
}

CurveCode get_curve(ValueReader& in, int frames, int span, int context, std::int64_t& numbers) {
  const std::vector<int> regular = regular_knots(frames, span);
  CurveCode out;
  numbers -= static_cast<std::int64_t>(regular.size()) + 16;
  if (numbers < 0) in.damaged();
  bool before = false;
  for (std::size_t r = 0; r + 1 < regular.size(); ++r) {
    if (regular[r + 1] - regular[r] < 2) continue;
    const bool any = in.get_bit(context + 5 + (before ? 1 : 0));
    before = any;
    bool last = false;
    for (int f = regular[r] + 1; any && f < regular[r + 1]; ++f) {
      const bool here = in.get_bit(context + 7 + (last ? 1 : 0));
      if (here) out.added.push_back(f);
      last = here;
    }
  }
  numbers -= 2 * static_cast<std::int64_t>(out.added.size());
  if (numbers < 0) in.damaged();
  out.values.reserve(regular.size() + out.added.size());
  std::int64_t value = 0;
  std::int64_t difference = 0;
  for (std::size_t i = 0; i < regular.size() + out.added.size(); ++i) {
    const std::int64_t step =
        in.get_between(-2 * largest_value, 2 * largest_value, i == 0 ? context : context + 1 + size_bucket(difference));
    value += step;
    if (std::abs(value) > largest_value) in.damaged();
    difference = i == 0 ? 0 : step;
    out.values.push_back(static_cast<std::int32_t>(value));
  }
  return out;
}

void put_root(ValueWriter& out, const RootCode& root, int span, int context) {
  out.put_bit(root.degrees == 6, context);
  for (std::size_t k = 0; k < root.curves.size(); ++k) {
    put_curve(out, root.curves[k], root.frames, span, context + 1 + curve_contexts * static_cast<int>(k));
  }
}

RootCode get_root(ValueReader& in, int frames, int span, int context, std::int64_t& numbers) {
  RootCode out{.degrees = in.get_bit(context) ? 6 : 4, .frames = frames, .curves = {}};
  for (int k = 0; k < RootAlignment::curve_count(out.degrees); ++k) {
    out.curves.push_back(get_curve(in, frames, span, context + 1 + curve_contexts * k, numbers));
  }
  return out;
}

namespace {

void put_group(ValueWriter& out, const MarkerGroup& group) {
  out.put(group.axis_count(), axis_count_number);
  std::array<std::int64_t, 6> before{};  // of the same axis of space, of markers of the same kind
  for (std::size_t i = 0; i < group.mean.size(); ++i) {
    const std::size_t k = i < 3 ? i : (i - 3) % 6;
    out.put(group.mean[i] - before[k], mean + static_cast<int>(k));
    before[k] = group.mean[i];
    if (i >= 3 && k < 3) before[k + 3] = group.mean[i];  // markers of one joint lie together
  }
  for (int rep = 0; rep < 2; ++rep) {
    std::int64_t last = 0;
    for (const AxisSteps& steps : group.steps[static_cast<std::size_t>(rep)]) {
      out.put(steps.range - last, range_number);
      out.put(steps.bits, bits_number);
      last = steps.range;
    }
  }
  const std::size_t d = group.mean.size();
  for (std::size_t i = 0; i < group.axes.size(); ++i) {
    const std::size_t at = i % d;
    // Both markers of a joint move alike.
    const std::int64_t near = at >= 6 && (at - 3) % 6 >= 3 ? group.axes[i - 3] : 0;
    out.put(group.axes[i] - near, axis_entry + bucket(i / d));
  }
}

MarkerGroup get_group(ValueReader& in, int dimensions) {
  MarkerGroup out;
  const std::int64_t axes = in.get_between(1, dimensions, axis_count_number);
  const auto d = static_cast<std::size_t>(dimensions);
  std::array<std::int64_t, 6> before{};
  for (std::size_t i = 0; i < d; ++i) {
    const std::size_t k = i < 3 ? i : (i - 3) % 6;
    before[k] += in.get_between(-largest_value, largest_value, mean + static_cast<int>(k));
    if (std::abs(before[k]) > largest_value) in.damaged();
    out.mean.push_back(static_cast<std::int32_t>(before[k]));
    if (i >= 3 && k < 3) before[k + 3] = before[k];
  }
  for (int rep = 0; rep < 2; ++rep) {
    std::int64_t last = 0;
    for (std::int64_t a = 0; a < axes; ++a) {
      last += in.get_between(-4096, 4096, range_number);
      if (std::abs(last) > 640) in.damaged();
      const auto bits = static_cast<int>(in.get_between(0, most_quantiser_bits, bits_number));
      out.steps[static_cast<std::size_t>(rep)].push_back({static_cast<int>(last), bits});
    }
  }
  out.axes.resize(d * static_cast<std::size_t>(axes));
  for (std::size_t i = 0; i < out.axes.size(); ++i) {
    const std::size_t at = i % d;
    const std::int64_t near = at >= 6 && (at - 3) % 6 >= 3 ? out.axes[i - 3] : 0;
    const std::int64_t entry = near + in.get_between(-8192, 8192, axis_entry + bucket(i / d));
    if (std::abs(entry) > 2 * 2048) in.damaged();
    out.axes[i] = static_cast<std::int16_t>(entry);
  }
  return out;
}

// The primary clips, in the order of the stream: what repeated ones refer to by number.
std::vector<int> primaries_of(const std::vector<MarkerClip>& clips) {
  std::vector<int> out;
  for (std::size_t c = 0; c < clips.size(); ++c) {
    if (clips[c].kind == MarkerClip::Kind::primary) out.push_back(static_cast<int>(c));
  }
  return out;
}

int curve_context(const MarkerClip& clip, std::size_t axis) {
  return axis_curve + curve_contexts * ((clip.repeats() ? axis_buckets : 0) + bucket(axis));
}
int minimum_context(const MarkerClip& clip, std::size_t axis) {
  return minimum_number + (clip.repeats() ? axis_buckets : 0) + bucket(axis);
}

void put_clip(ValueWriter& out, const MarkerStream& stream, const MarkerClip& clip, const std::vector<int>& primaries,
              int& last_primary) {
  if (clip.repeats()) {
    const auto number = static_cast<int>(std::ranges::lower_bound(primaries, clip.primary) - primaries.begin());
    out.put(number - last_primary, primary_number);
    last_primary = number;
    const std::vector<int> knots = regular_knots(clip.frames, stream.reference_span);
    for (std::size_t i = 0; i < knots.size(); ++i) {
      const std::int64_t expected = i > 0 ? clip.reference[i - 1] + knots[i] - knots[i - 1] : 0;
      out.put(clip.reference[i] - expected, i > 0 ? reference_move : reference_start);
    }
  }
  for (std::size_t a = 0; a < clip.curves.size(); ++a) {
    out.put(clip.curves[a].minimum, minimum_context(clip, a));
    put_curve(out, clip.curves[a], clip.frames, stream.span, curve_context(clip, a));
  }
}

void get_clip(ValueReader& in, const MarkerStream& stream, MarkerClip& clip, const std::vector<int>& primaries,
              int& last_primary, std::int64_t& numbers) {
  if (clip.repeats()) {
    const std::int64_t number = last_primary + in.get(primary_number);
    if (number < 0 || number >= static_cast<std::int64_t>(primaries.size())) in.damaged();
    last_primary = static_cast<int>(number);
    clip.primary = primaries[static_cast<std::size_t>(number)];
    const MarkerClip& primary = stream.clips[static_cast<std::size_t>(clip.primary)];
    if (primary.group != clip.group) in.damaged();
    const std::vector<int> knots = regular_knots(clip.frames, stream.reference_span);
    numbers -= static_cast<std::int64_t>(knots.size());
    if (numbers < 0) in.damaged();
    for (std::size_t i = 0; i < knots.size(); ++i) {
      const std::int64_t expected = i > 0 ? clip.reference[i - 1] + knots[i] - knots[i - 1] : 0;
      const std::int64_t at = expected + in.get(i > 0 ? reference_move : reference_start);
      if (at < 0 || at >= primary.frames) in.damaged();
      clip.reference.push_back(static_cast<std::int32_t>(at));
    }
  }
  const int axes = stream.groups[static_cast<std::size_t>(clip.group)].axis_count();
  for (std::size_t a = 0; a < static_cast<std::size_t>(axes); ++a) {
    const std::int64_t least = in.get_between(-largest_value, largest_value, minimum_context(clip, a));
    clip.curves.push_back(get_curve(in, clip.frames, stream.span, curve_context(clip, a), numbers));
    clip.curves.back().minimum = static_cast<std::int32_t>(least);
  }
}

void put_clip_list(ValueWriter& out, const MarkerStream& stream) {
  out.put(static_cast<std::int64_t>(stream.clips.size()), header);
  int before = 0;
  int last_group = 0;
  for (const MarkerClip& clip : stream.clips) {
    out.put(static_cast<int>(clip.kind), kind);
    out.put(clip.group - last_group, group_number);
    out.put(clip.frames - before, length);
    before = clip.frames;
    last_group = clip.group;
  }
}

void get_clip_list(ValueReader& in, MarkerStream& stream, std::int64_t frames, std::int64_t& numbers) {
  const std::int64_t count = in.get_between(1, frames, header);
  std::int64_t before = 0;
  std::int64_t group = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    numbers -= 32;
    if (numbers < 0) in.damaged();
    MarkerClip clip;
    clip.kind = static_cast<MarkerClip::Kind>(in.get_between(0, 2, kind));
    group += in.get(group_number);
    if (group < 0 || group >= static_cast<std::int64_t>(stream.groups.size())) in.damaged();
    clip.group = static_cast<int>(group);
    before += in.get(length);
    if (before < 1 || before > frames) in.damaged();
    frames -= before;
    clip.frames = static_cast<int>(before);
    stream.clips.push_back(std::move(clip));
  }
  if (frames != 0) in.damaged();
}

}  // namespace

Bytes pack_marker_stream(const MarkerStream& stream) {
  ValueWriter out(context_count);
  for (const int span : {stream.span, stream.root_span, stream.reference_span}) out.put(span, header);
  out.put(stream.seam_limit_cm_s, header);
  put_reference_pose(out, stream.reference, pose);
  out.put(static_cast<std::int64_t>(stream.groups.size()), header);
  for (const MarkerGroup& group : stream.groups) put_group(out, group);
  put_clip_list(out, stream);
  const std::vector<int> primaries = primaries_of(stream.clips);
  int last_primary = 0;
  for (const MarkerClip& clip : stream.clips) put_clip(out, stream, clip, primaries, last_primary);
  for (std::size_t c = 0; c < stream.roots.size(); ++c) {
    put_root(out, stream.roots[c], stream.root_span, root_curve);
    put_contacts(out, stream.contacts[c]);
  }
  return std::move(out).finish();
}

MarkerStream unpack_marker_stream(std::span<const std::byte> bytes, const ClipTable& table, int dimensions,
                                  std::int64_t numbers, const std::string& source) {
  ValueReader in(bytes, context_count, source);
  MarkerStream out;
  for (int* span : {&out.span, &out.root_span, &out.reference_span}) {
    *span = static_cast<int>(in.get_between(1, 512, header));
  }
  out.seam_limit_cm_s = static_cast<int>(in.get_between(0, most_seam_limit, header));
  const int joints = static_cast<int>(table.skeletons.front().rotating_joints().size());
  out.reference = get_reference_pose(in, joints, pose);
  const std::int64_t groups = in.get_between(1, 4096, header);
  for (std::int64_t g = 0; g < groups; ++g) {
    out.groups.push_back(get_group(in, dimensions));
    numbers -= dimensions * (1 + out.groups.back().axis_count());
    if (numbers < 0) in.damaged();
  }
  get_clip_list(in, out, table.frames(), numbers);
  const std::vector<int> primaries = primaries_of(out.clips);
  int last_primary = 0;
  for (MarkerClip& clip : out.clips) get_clip(in, out, clip, primaries, last_primary, numbers);
  for (const ClipEntry& entry : table.clips) {
    out.roots.push_back(get_root(in, entry.frames, out.root_span, root_curve, numbers));
    const Skeleton& skeleton = table.skeletons[static_cast<std::size_t>(entry.skeleton)];
    out.contacts.push_back(get_contacts(in, entry.frames, skeleton.joint_count(), numbers));
  }
  in.expect_end();
  return out;
}

}  // namespace kinespace
