#include "kinespace/library/detail/space_codec.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/space_builder.h"
#include "kinespace/storage/bitstream.h"
#include "kinespace/storage/packed_floats.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

constexpr std::int64_t most_joints = 4096;
constexpr std::int64_t most_points = 1024;

void put_vector3(ByteWriter& out, const Eigen::Vector3d& v) {
  out.put_array(std::span<const double>(v.data(), 3));
}

Eigen::Vector3d get_vector3(ByteReader& in) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v(i) = in.get<double>();
  if (!v.allFinite()) in.fail("an offset that is no number", "finite values");
  return v;
}

// Column by column.
void put_matrix(ByteWriter& out, const Eigen::MatrixXd& m) {
  out.put_array(std::span<const double>(m.data(), static_cast<std::size_t>(m.size())));
}

Eigen::MatrixXd get_matrix(ByteReader& in, Eigen::Index rows, Eigen::Index cols) {
  const auto values = in.get_array<double>(static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(cols));
  Eigen::MatrixXd out = Eigen::Map<const Eigen::MatrixXd>(values.data(), rows, cols);
  if (!out.allFinite()) in.fail("a value that is no number", "finite values");
  return out;
}

// Column by column, from the diagonal down.
Eigen::MatrixXd lower_triangle(const Eigen::MatrixXd& m) {
  Eigen::MatrixXd out(m.rows() * (m.rows() + 1) / 2, 1);
  Eigen::Index at = 0;
  for (Eigen::Index c = 0; c < m.cols(); ++c) {
    out.col(0).segment(at, m.rows() - c) = m.col(c).tail(m.rows() - c);
    at += m.rows() - c;
  }
  return out;
}

Eigen::MatrixXd from_lower_triangle(const Eigen::VectorXd& values, Eigen::Index points) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(points, points);
  Eigen::Index at = 0;
  for (Eigen::Index c = 0; c < points; ++c) {
    out.col(c).tail(points - c) = values.segment(at, points - c);
    at += points - c;
  }
  return out;
}

Bytes group_section(const FunctionGroup& group, const CurveMoments& moments, bool pinned, bool noise) {
  ByteWriter out;
  put_varint(out, static_cast<std::uint64_t>(group.functions.cols()));
  put_varint(out, static_cast<std::uint64_t>(moments.count()));
  out.put(group.variance);
  if (pinned) out.put(group.left);
  if (noise) out.put(group.noise.value_or(0));
  put_matrix(out, group.mean);
  put_matrix(out, group.eigenvalues);
  put_matrix(out, group.functions);
  put_matrix(out, moments.mean());
  put_matrix(out, pinned ? lower_triangle(moments.scatter()) : moments.scatter());
  return std::move(out).take();
}

std::pair<FunctionGroup, CurveMoments> parse_group(std::span<const std::byte> bytes, int points, bool pinned,
                                                   bool noise, const std::string& source) {
  ByteReader in(bytes, source);
  const std::uint64_t functions = get_varint(in);
  if (functions > static_cast<std::uint64_t>(points)) {
    in.fail(fmt::format("{} functions", functions), fmt::format("at most {}", points));
  }
  const auto k = static_cast<Eigen::Index>(functions);
  const auto count = static_cast<std::int64_t>(get_varint(in) & 0x7fffffffffffffffU);
  FunctionGroup group;
  group.variance = in.get<double>();
  if (pinned) group.left = in.get<double>();
  const double noise_variance = noise ? in.get<double>() : 0;
  if (!(noise_variance >= 0) || !std::isfinite(noise_variance)) {
    in.fail("a noise variance that is none", "0 or more, finite");
  }
  if (!std::isfinite(group.variance) || !std::isfinite(group.left))
    in.fail("a variance that is no number", "a finite one");
  group.mean = get_matrix(in, points, 1);
  group.eigenvalues = get_matrix(in, k, 1);
  group.functions = get_matrix(in, points, k);
  if (!pinned) group.left = group.variance - group.eigenvalues.sum();
  if (noise) {
    if (!(group.eigenvalues.array() > 0).all() || !group.eigenvalues.allFinite() || !group.functions.allFinite()) {
      in.fail("functions without variance", "eigenvalues above 0");
    }
    group.expect_scores(noise_variance);
  }
  const Eigen::VectorXd mean = get_matrix(in, points, 1);
  const Eigen::MatrixXd scatter = pinned ? from_lower_triangle(get_matrix(in, points * (points + 1) / 2, 1), points)
                                         : get_matrix(in, points, points);
  in.expect_end();
  return {std::move(group), CurveMoments(count, mean, scatter)};
}

// A float that is no less: what is printed of an error is never below it.
float rounded_up(double value) {
  const auto near = static_cast<float>(value);
  return static_cast<double>(near) >= value ? near : std::nextafter(near, std::numeric_limits<float>::infinity());
}

std::string group_name(std::size_t i) {
  return fmt::format("group {}", i);
}

double step_of(const MotionSpace& set) {
  return score_step / std::sqrt(set.options().pace);
}

float stored_steps(float score, double step) {
  return static_cast<float>(std::round(static_cast<double>(score) / step));
}

// The rows of a sequence's scores that a level of detail has and the one before it has not. A row that the sequence
// before holds is not kept again: row 0 of a pinned space, but for the first sequence of a run.
struct RowRange {
  int first = 0;
  int last = 0;  // behind it
};
RowRange rows_of_level(const MotionSpace& set, const EncodedSequence& sequence, int level, bool shares_start) {
  RowRange out{level == 1 ? 0 : set.rows_at(sequence.level(level - 1)), set.rows_at(sequence.level(level))};
  if (shares_start && set.options().pinned && out.first == 0) ++out.first;
  return out;
}

// Visits the rows that a level has of all sequences: all first ones, then all second ones, and so on.
template <typename Clip, typename Visit>
void for_each_row(Clip& clip, const RegisteredSpace& space, int level, const Visit& visit) {
  bool more = true;
  for (int i = 0; more; ++i) {
    more = false;
    for (auto& run : clip.runs) {
      for (std::size_t k = 0; k < run.sequences.size(); ++k) {
        auto& sequence = run.sequences[k];
        const RowRange rows = rows_of_level(space.of(sequence.cycles), sequence, level, k > 0);
        if (rows.first + i < rows.last) visit(sequence, rows.first + i);
        more = more || rows.first + i + 1 < rows.last;
      }
    }
  }
}

// One level's scores of all sequences of a clip, in steps, as whole floats: their low bytes are zero and pack well.
// Row by row over the sequences that have one, so that like stands with like.
Bytes score_block(const EncodedClip& clip, const RegisteredSpace& space, int level) {
  std::vector<float> steps;
  for_each_row(clip, space, level, [&](const EncodedSequence& s, int row) {
    const double step = step_of(space.of(s.cycles));
    for (Eigen::Index c = 0; c < s.scores.cols(); ++c) steps.push_back(stored_steps(s.scores(row, c), step));
  });
  return pack_floats(steps);
}

// What sequences say besides where they lie.
struct SequenceFields {
  bool kinds = false;         // how many cycles they hold
  bool extra_detail = false;  // how many more numbers they take
};

bool has_extra_detail(const EncodedClip& clip) {
  return std::ranges::any_of(clip.runs, [](const EncodedRun& run) {
    return std::ranges::any_of(run.sequences, [](const EncodedSequence& s) { return s.extra_detail > 0; });
  });
}

Bytes pack_sequences(const EncodedClip& clip, SequenceFields fields) {
  ByteWriter out;
  put_varint(out, clip.runs.size());
  for (const EncodedRun& run : clip.runs) {
    put_varint(out, run.sequences.size());
    put_varint(out, static_cast<std::uint64_t>(run.sequences.front().first));
    for (const EncodedSequence& s : run.sequences) {
      put_varint(out, static_cast<std::uint64_t>(s.last - s.first));
      if (fields.kinds) out.put(static_cast<std::uint8_t>(s.cycles));
      if (fields.extra_detail) out.put(static_cast<std::uint8_t>(s.extra_detail));
      for (const std::int8_t a : s.warp.coefficients()) out.put(a);
    }
  }
  return std::move(out).take();
}

// Runs and sequences without their scores. Together they must hold the frames of the clip once.
void unpack_sequences(ByteReader in, const RegisteredSpace& space, SequenceFields fields, EncodedClip& clip) {
  const std::size_t runs = get_count(in, 2, "runs");
  std::int64_t next = 0;
  for (std::size_t r = 0; r < runs; ++r) {
    EncodedRun& run = clip.runs.emplace_back();
    const std::size_t count = get_count(in, 1 + Warp::terms, "sequences");
    const std::uint64_t first = get_varint(in);
    if (count == 0 || first != static_cast<std::uint64_t>(next))
      in.fail("a run out of place", "runs that follow each other");
    std::int64_t at = next;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t length = get_varint(in);
      if (length > static_cast<std::uint64_t>(clip.frames))
        in.fail("a sequence beyond the clip's end", "frames of the clip");
      const int cycles = fields.kinds ? in.get<std::uint8_t>() : 0;
      if (!space.has(cycles)) {
        in.fail(fmt::format("a sequence of {} cycles", cycles), "a kind of sequence that the space has functions for");
      }
      const int extra_detail = fields.extra_detail ? in.get<std::uint8_t>() : 0;
      if (extra_detail > most_extra_detail) in.fail(fmt::format("a detail of {}", extra_detail), "0 to 240");
      Warp::Coefficients coefficients{};
      for (std::int8_t& a : coefficients) a = in.get<std::int8_t>();
      if (!Warp::legal(coefficients)) in.fail("a time warp that is not monotone", "slopes within [1/2, 2]");
      EncodedSequence s{.first = static_cast<int>(at),
                        .last = static_cast<int>(at + static_cast<std::int64_t>(length)),
                        .cycles = cycles,
                        .warp = Warp(coefficients),
                        .extra_detail = extra_detail};
      at = s.last;
      if (at >= clip.frames || (length == 0 && count > 1))
        in.fail("a sequence beyond the clip's end", "frames of the clip");
      run.sequences.push_back(std::move(s));
    }
    next = at + 1;
  }
  if (next != clip.frames) in.fail(fmt::format("sequences of {} frames", next), fmt::format("{} frames", clip.frames));
  in.expect_end();
}

void read_level(std::span<const std::byte> block, const RegisteredSpace& space, int level, const std::string& source,
                EncodedClip& clip) {
  std::size_t rows = 0;
  for_each_row(clip, space, level, [&](EncodedSequence&, int) { ++rows; });
  const auto curves = static_cast<std::size_t>(space.curves());
  const std::vector<float> steps = unpack_floats(block, rows * curves, source);
  std::size_t at = 0;
  for_each_row(clip, space, level, [&](EncodedSequence& s, int number) {
    auto row = s.scores.row(number);
    const auto step = static_cast<float>(step_of(space.of(s.cycles)));
    row = Eigen::Map<const Eigen::RowVectorXf>(steps.data() + at, row.size()) * step;
    if (!row.allFinite()) throw Error(ErrorKind::bad_input, {.file = source, .found = "a score that is no number"});
    at += curves;
  });
  if (level > 1 || !space.options().pinned) return;
  for (EncodedRun& run : clip.runs) {
    for (std::size_t i = 1; i < run.sequences.size(); ++i) {
      run.sequences[i].scores.row(0) = run.sequences[i - 1].scores.row(1);
    }
  }
}

Bytes pack_side(const EncodedClip& clip) {
  ByteWriter out;
  put_vector3(out, clip.placement.start_cm);
  out.put(clip.placement.heading_rad);
  for (const EncodedRun& run : clip.runs) {
    out.put_array(std::span<const float>(run.start.data(), 3));
    for (const EncodedSequence& s : run.sequences) out.put_array(std::span<const float>(s.travel.data(), 3));
  }
  out.put_bytes(pack_side_tracks(clip.side_tracks));
  return std::move(out).take();
}

void unpack_side(ByteReader in, EncodedClip& clip, const Skeleton& skeleton, const std::string& source) {
  const auto get3f = [&in] {
    Eigen::Vector3f v;
    for (int i = 0; i < 3; ++i) v(i) = in.get<float>();
    if (!v.allFinite()) in.fail("a position that is no number", "finite values");
    return v;
  };
  clip.placement.start_cm = get_vector3(in);
  clip.placement.heading_rad = in.get<double>();
  if (!std::isfinite(clip.placement.heading_rad)) in.fail("a heading that is no number", "a finite angle");
  for (EncodedRun& run : clip.runs) {
    run.start = get3f();
    for (EncodedSequence& s : run.sequences) s.travel = get3f();
  }
  clip.side_tracks = unpack_side_tracks(in.take(in.remaining()), clip.frames, skeleton, source);
}

Bytes one_section(const char* kind, const char* name, Bytes content) {
  BitstreamWriter out(kind);
  out.add_section(name, std::move(content));
  return out.finish();
}

}  // namespace

Bytes pack_skeleton(const Skeleton& skeleton) {
  ByteWriter out;
  put_varint(out, static_cast<std::uint64_t>(skeleton.joint_count()));
  for (const Joint& joint : skeleton.joints) {
    put_short_string(out, joint.name);
    put_varint(out, static_cast<std::uint64_t>(joint.parent + 1));
    put_vector3(out, joint.offset);
    out.put(static_cast<std::uint8_t>(joint.channels.size()));
    for (const Channel c : joint.channels) out.put(static_cast<std::uint8_t>(c));
    out.put(static_cast<std::uint8_t>(joint.end_site ? 1 : 0));
    if (joint.end_site) put_vector3(out, *joint.end_site);
  }
  return one_section("skeleton", "joints", std::move(out).take());
}

Skeleton unpack_skeleton(std::span<const std::byte> bytes, const std::string& source) {
  const Bitstream stream = Bitstream::parse(bytes, source);
  stream.require_kind("skeleton");
  ByteReader in(stream.section("joints"), source);
  Skeleton out;
  const std::size_t count = get_count(in, 28, "joints");
  if (count == 0 || count > most_joints) in.fail(fmt::format("{} joints", count), fmt::format("1 to {}", most_joints));
  for (std::size_t j = 0; j < count; ++j) {
    Joint joint;
    joint.name = get_short_string(in);
    const std::uint64_t parent = get_varint(in);
    if (parent > j || (parent == 0) != (j == 0)) in.fail("a joint before its parent", "parents first, one root");
    joint.parent = static_cast<int>(parent) - 1;
    joint.offset = get_vector3(in);
    const auto channels = in.get<std::uint8_t>();
    if (channels > 6) in.fail("a joint with too many channels", "at most 6");
    for (int c = 0; c < channels; ++c) {
      const auto channel = in.get<std::uint8_t>();
      if (channel > 5) in.fail("an unknown channel", "0 to 5");
      joint.channels.push_back(static_cast<Channel>(channel));
    }
    if (in.get<std::uint8_t>() != 0) joint.end_site = get_vector3(in);
    out.joints.push_back(std::move(joint));
  }
  in.expect_end();
  return out;
}

Bytes pack_space(const MotionSpace& space) {
  BitstreamWriter out("motion-space");
  out.set_option("grouping", static_cast<std::int64_t>(space.options_.grouping));
  out.set_option("points", static_cast<std::int64_t>(space.points_));
  out.set_option("variance_share", space.options_.variance_share);
  if (space.options_.functions) out.set_option("functions", static_cast<std::int64_t>(*space.options_.functions));
  out.set_option("smooth", static_cast<std::int64_t>(space.options_.smooth ? 1 : 0));
  if (space.options_.pinned) out.set_option("pinned", std::int64_t{1});
  const bool noise = std::ranges::any_of(space.groups_, [](const FunctionGroup& g) { return g.noise.has_value(); });
  if (noise) out.set_option("noise", std::int64_t{1});
  if (space.options_.cycles > 0) out.set_option("cycles", static_cast<std::int64_t>(space.options_.cycles));
  if (space.options_.pace != 1) out.set_option("pace", space.options_.pace);
  out.add_section("skeleton", pack_skeleton(space.skeleton_));
  ByteWriter references;
  put_matrix(references, space.references_);
  out.add_section("references", std::move(references).take());
  for (std::size_t g = 0; g < space.groups_.size(); ++g) {
    out.add_section(group_name(g), group_section(space.groups_[g], space.moments_[g], space.options_.pinned, noise));
  }
  return out.finish();
}

MotionSpace unpack_space(std::span<const std::byte> bytes, const std::string& source) {
  const Bitstream stream = Bitstream::parse(bytes, source);
  stream.require_kind("motion-space");
  MotionSpaceOptions options;
  options.grouping = static_cast<Grouping>(stream.integer_option("grouping", 0, 2));
  const int points = static_cast<int>(stream.integer_option("points", 4, most_points));
  options.points = points;
  options.variance_share = stream.number_option("variance_share", 1e-9, 1);
  if (stream.find_option("functions") != nullptr) {
    options.functions = static_cast<int>(stream.integer_option("functions", 1, most_points));
  }
  options.smooth = stream.integer_option("smooth", 0, 1) == 1;
  if (stream.find_option("pinned") != nullptr) options.pinned = stream.integer_option("pinned", 0, 1) == 1;
  const bool noise = stream.find_option("noise") != nullptr && stream.integer_option("noise", 0, 1) == 1;
  if (stream.find_option("cycles") != nullptr) options.cycles = static_cast<int>(stream.integer_option("cycles", 0, 8));
  if (stream.find_option("pace") != nullptr) options.pace = stream.number_option("pace", 1, 100);
  MotionSpace space(unpack_skeleton(stream.section("skeleton"), source), options, points);
  ByteReader references(stream.section("references"), source);
  space.set_references(get_matrix(references, 4, space.layout().joint_count()));
  references.expect_end();
  for (int g = 0; g < space.group_count(); ++g) {
    auto [group, moments] =
        parse_group(stream.section(group_name(static_cast<std::size_t>(g))), points, options.pinned, noise, source);
    space.groups_.push_back(std::move(group));
    space.moments_.push_back(std::move(moments));
  }
  return space;
}

namespace {

std::string set_name(std::size_t cycles) {
  return fmt::format("cycles {}", cycles);
}

}  // namespace

// The set of sequences cut at rests as it ever was; the others, each whole, behind it.
Bytes pack_space(const RegisteredSpace& space) {
  BitstreamWriter out("registered-space");
  out.set_option("warped", static_cast<std::int64_t>(space.warped() ? 1 : 0));
  for (std::size_t cycles = 0; cycles < space.sets().size(); ++cycles) {
    if (space.has(static_cast<int>(cycles))) out.add_section(set_name(cycles), pack_space(space.sets()[cycles]));
  }
  return out.finish();
}

RegisteredSpace unpack_registered_space(std::span<const std::byte> bytes, const std::string& source) {
  const Bitstream stream = Bitstream::parse(bytes, source);
  if (stream.kind() == "motion-space") {  // of before sequences had kinds; its warps were found without a trial
    RegisteredSpace out(unpack_space(bytes, source));
    out.set_warped(true);
    return out;
  }
  stream.require_kind("registered-space");
  std::vector<MotionSpace> sets{unpack_space(stream.section(set_name(0)), source)};
  if (sets.front().options().cycles != 0) {
    throw Error(ErrorKind::bad_input,
                {.file = source, .found = "no set for motion cut at rests", .expected = "that set first"});
  }
  for (std::size_t cycles = 1; cycles <= 8; ++cycles) {
    if (!stream.has_section(set_name(cycles))) continue;
    MotionSpace set = unpack_space(stream.section(set_name(cycles)), source);
    const bool alike = set.skeleton().same_tree(sets.front().skeleton()) &&
                       set.options().cycles == static_cast<int>(cycles) &&
                       set.options().grouping == sets.front().options().grouping &&
                       set.options().pinned == sets.front().options().pinned;
    if (!alike) {
      throw Error(ErrorKind::bad_input, {.file = source,
                                         .found = "function sets that do not belong together",
                                         .expected = "one skeleton, one grouping"});
    }
    while (sets.size() < cycles) {
      MotionSpaceOptions none = sets.front().options();
      none.cycles = static_cast<int>(sets.size());
      sets.emplace_back(sets.front().skeleton(), none, sets.front().points()).set_references(sets.front().references());
    }
    sets.push_back(std::move(set));
  }
  RegisteredSpace out(std::move(sets));
  out.set_warped(stream.integer_option("warped", 0, 1) == 1);
  return out;
}

namespace {

constexpr const char* own_slopes = "own_slopes";  // levels were measured with the slopes of both sides of a cut

Bytes pack_levels(const std::vector<LevelError>& levels) {
  ByteWriter out;
  put_varint(out, levels.size());
  for (const LevelError& l : levels) {
    put_varint(out, static_cast<std::uint64_t>(l.level));
    out.put(rounded_up(l.error.mean_joint_error_cm));
    out.put(rounded_up(l.error.max_joint_error_cm));
  }
  return std::move(out).take();
}

std::vector<LevelError> unpack_levels(ByteReader in, int levels) {
  std::vector<LevelError> out(get_count(in, 9, "levels of detail"));
  int before = 0;
  for (LevelError& l : out) {
    const std::uint64_t level = get_varint(in);
    if (level <= static_cast<std::uint64_t>(before) || level > static_cast<std::uint64_t>(levels)) {
      in.fail(fmt::format("level of detail {}", level), fmt::format("ascending levels up to {}", levels));
    }
    before = l.level = static_cast<int>(level);
    l.error.mean_joint_error_cm = static_cast<double>(in.get<float>());
    l.error.max_joint_error_cm = static_cast<double>(in.get<float>());
    const bool sound = l.error.mean_joint_error_cm >= 0 && l.error.max_joint_error_cm >= l.error.mean_joint_error_cm;
    if (!sound || !std::isfinite(l.error.max_joint_error_cm)) {
      in.fail("an error that is no distance", "cm");
    }
  }
  in.expect_end();
  return out;
}

std::vector<LevelError> level_errors_of(const Bitstream& side, const RegisteredSpace& space,
                                        const std::string& source) {
  if (!side.has_section("levels")) return {};
  std::vector<LevelError> out = unpack_levels(ByteReader(side.section("levels"), source), space.levels());
  // Coarser levels of before have other slopes beside cuts now; that of all functions is what it was.
  const bool as_played = side.find_option(own_slopes) != nullptr && side.integer_option(own_slopes, 0, 1) == 1;
  if (!as_played) std::erase_if(out, [&](const LevelError& l) { return l.level < space.levels(); });
  return out;
}

}  // namespace

std::vector<LevelError> unpack_level_errors(std::span<const std::byte> bytes, const RegisteredSpace& space,
                                            const std::string& source) {
  const Bitstream side = Bitstream::parse(bytes, source);
  side.require_kind("clip-side");
  return level_errors_of(side, space, source);
}

namespace {

std::optional<KeptFeet> feet_of(const Bitstream& side, int frames, const Skeleton& skeleton,
                                const std::string& source) {
  if (!side.has_section("feet")) return std::nullopt;
  return unpack_feet(side.section("feet"), frames, skeleton, source);
}

}  // namespace

std::optional<KeptFeet> unpack_clip_feet(std::span<const std::byte> bytes, int frames, const Skeleton& skeleton,
                                         const std::string& source) {
  const Bitstream side = Bitstream::parse(bytes, source);
  side.require_kind("clip-side");
  return feet_of(side, frames, skeleton, source);
}

PackedClip pack_clip(const EncodedClip& clip, const RegisteredSpace& space) {
  PackedClip out;
  BitstreamWriter vectors("clip-vectors");
  std::vector<Bytes> blocks;
  for (int level = 1; level <= space.levels(); ++level) blocks.push_back(score_block(clip, space, level));
  vectors.set_error(clip.error);
  vectors.add_progressive_section("scores", blocks);
  out.vectors = vectors.finish();
  const SequenceFields fields{.kinds = space.sets().size() > 1, .extra_detail = has_extra_detail(clip)};
  BitstreamWriter warps("clip-warps");
  if (fields.kinds) warps.set_option("kinds", std::int64_t{1});
  if (fields.extra_detail) warps.set_option("extra_detail", std::int64_t{1});
  warps.add_section("sequences", pack_sequences(clip, fields));
  out.warps = warps.finish();
  BitstreamWriter side("clip-side");
  side.add_section("side", pack_side(clip));
  if (!clip.levels.empty()) {
    side.set_option(own_slopes, std::int64_t{1});
    side.add_section("levels", pack_levels(clip.levels));
  }
  if (clip.feet) side.add_section("feet", pack_feet(*clip.feet));
  out.side = side.finish();
  return out;
}

void round_to_stored(EncodedClip& clip, const RegisteredSpace& space) {
  for (EncodedRun& run : clip.runs) {
    for (std::size_t k = 0; k < run.sequences.size(); ++k) {
      EncodedSequence& s = run.sequences[k];
      const double step = step_of(space.of(s.cycles));
      for (Eigen::Index i = 0; i < s.scores.size(); ++i) {
        float& score = s.scores.data()[i];
        score = stored_steps(score, step) * static_cast<float>(step);
      }
      if (k > 0 && space.options().pinned) s.scores.row(0) = run.sequences[k - 1].scores.row(1);
    }
  }
}

EncodedClip unpack_clip(const PackedClip& packed, const RegisteredSpace& space, const Skeleton& skeleton,
                        const EncodedClip& header, const std::string& source, int functions) {
  EncodedClip clip{.name = header.name, .rate_hz = header.rate_hz, .frames = header.frames};
  const Bitstream warps = Bitstream::parse(packed.warps, source);
  warps.require_kind("clip-warps");
  const auto has = [&warps](const char* option) {
    return warps.find_option(option) != nullptr && warps.integer_option(option, 0, 1) == 1;
  };
  const SequenceFields fields{.kinds = has("kinds"), .extra_detail = has("extra_detail")};
  unpack_sequences(ByteReader(warps.section("sequences"), source), space, fields, clip);
  const Bitstream side = Bitstream::parse(packed.side, source);
  side.require_kind("clip-side");
  unpack_side(ByteReader(side.section("side"), source), clip, skeleton, source);
  clip.levels = level_errors_of(side, space, source);
  clip.feet = feet_of(side, clip.frames, skeleton, source);

  const Bitstream vectors = Bitstream::parse_prefix(packed.vectors, source);
  vectors.require_kind("clip-vectors");
  clip.error = vectors.error();
  auto blocks = vectors.blocks("scores");
  if (blocks.size() > static_cast<std::size_t>(space.levels())) {
    throw Error(ErrorKind::bad_input, {.file = source,
                                       .found = fmt::format("{} levels of detail", blocks.size()),
                                       .expected = fmt::format("{}, as the space has", space.levels())});
  }
  if (blocks.empty() && space.options().pinned) {
    throw Error(ErrorKind::bad_input, {.file = source, .found = "no level of detail", .expected = "one at least"});
  }
  // Level 0 has the ends, which the first block holds.
  const std::size_t least = space.options().pinned ? 1 : 0;
  if (functions >= 0) blocks.resize(std::min(blocks.size(), std::max(least, static_cast<std::size_t>(functions))));
  for (EncodedRun& run : clip.runs) {
    for (EncodedSequence& s : run.sequences) s.scores = ScoreMatrix::Zero(space.of(s.cycles).rows(), space.curves());
  }
  for (std::size_t k = 0; k < blocks.size(); ++k) read_level(blocks[k], space, static_cast<int>(k) + 1, source, clip);
  return clip;
}

namespace {

constexpr int frames_per_part = 65536;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

int parts_of(int frames) {
  return (frames - 1) / frames_per_part + 1;
}

int rows_of_part(int frames, int part) {
  return std::min(frames_per_part, frames - part * frames_per_part);
}

void put_rows(ByteWriter& out, const SampleMatrix& values, int part) {
  const int rows = rows_of_part(static_cast<int>(values.rows()), part);
  const FloatRows some = values.middleRows(part * frames_per_part, rows).cast<float>();
  out.put_array(std::span<const float>(some.data(), static_cast<std::size_t>(some.size())));
}

void get_rows(ByteReader& in, int part, SampleMatrix& values) {
  const int rows = rows_of_part(static_cast<int>(values.rows()), part);
  const auto numbers =
      in.get_array<float>(static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(values.cols()));
  in.expect_end();
  values.middleRows(part * frames_per_part, rows) =
      Eigen::Map<const FloatRows>(numbers.data(), rows, values.cols()).cast<double>();
}

void put_head(ByteWriter& out, const PreparedClip& clip) {
  put_short_string(out, clip.curves.name);
  out.put(clip.curves.rate_hz);
  put_vector3(out, clip.curves.placement.start_cm);
  out.put(clip.curves.placement.heading_rad);
  put_varint(out, static_cast<std::uint64_t>(clip.curves.frames()));
  put_varint(out, clip.runs.size());
  for (const Run& run : clip.runs) {
    put_varint(out, run.cuts.size());
    for (const int frame : run.cuts) put_varint(out, static_cast<std::uint64_t>(frame));
    for (int i = 0; i < run.sequence_count(); ++i) put_varint(out, static_cast<std::uint64_t>(run.cycles_of(i)));
    put_varint(out, run.at_rests.size());
    for (const Run::Alternative& other : run.at_rests) {
      put_varint(out, static_cast<std::uint64_t>(other.sequence));
      put_varint(out, static_cast<std::uint64_t>(other.count));
      put_varint(out, other.cuts.size());
      for (const int frame : other.cuts) put_varint(out, static_cast<std::uint64_t>(frame));
    }
  }
  const Bytes skeleton = pack_skeleton(clip.skeleton);
  put_varint(out, skeleton.size());
  out.put_bytes(skeleton);
  const Bytes tracks = pack_side_tracks(clip.curves.side_tracks);
  put_varint(out, tracks.size());
  out.put_bytes(tracks);
}

// Other cuts of stretches of a run: each from one of its cuts to another, stretches ascending.
void get_alternatives(ByteReader& in, Run& run) {
  const std::size_t count = get_count(in, 3, "stretches");
  int next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t sequence = get_varint(in);
    const std::uint64_t sequences = get_varint(in);
    const auto all = static_cast<std::uint64_t>(run.sequence_count());
    if (sequence < static_cast<std::uint64_t>(next) || sequences < 1 || sequence >= all || sequences > all - sequence) {
      in.fail("a stretch out of place", "sequences of the run");
    }
    Run::Alternative other{static_cast<int>(sequence), static_cast<int>(sequences), {}};
    next = other.sequence + other.count;
    other.cuts.resize(get_count(in, 1, "cuts"));
    for (int& frame : other.cuts) {
      const std::uint64_t at = get_varint(in);
      if (at > static_cast<std::uint64_t>(run.cuts.back())) in.fail("a cut beyond the end", "frames of the run");
      frame = static_cast<int>(at);
    }
    const bool same_ends = other.cuts.size() >= 2 && other.cuts.front() == run.first_frame(other.sequence) &&
                           other.cuts.back() == run.last_frame(next - 1);
    if (!same_ends || !std::ranges::is_sorted(other.cuts, std::less_equal<>{})) {
      in.fail("cuts out of order", "ascending frames between the ends of the stretch");
    }
    run.at_rests.push_back(std::move(other));
  }
}

// All but the values; room for these is made where they are known to be there.
PreparedClip get_head(ByteReader& in, const std::string& source, int& frame_count) {
  PreparedClip out;
  out.curves.name = get_short_string(in);
  out.curves.rate_hz = in.get<double>();
  out.curves.placement.start_cm = get_vector3(in);
  out.curves.placement.heading_rad = in.get<double>();
  const std::uint64_t frames = get_varint(in);
  if (frames < 1 || frames > std::numeric_limits<int>::max()) in.fail("no number of frames", "1 to 2147483647");
  const std::size_t runs = get_count(in, 1, "runs");
  for (std::size_t r = 0; r < runs; ++r) {
    Run& run = out.runs.emplace_back();
    const std::size_t cuts = get_count(in, 1, "cuts");
    for (std::size_t i = 0; i < cuts; ++i) {
      const std::uint64_t frame = get_varint(in);
      if (frame >= frames) in.fail("a cut beyond the end", "frames of the clip");
      run.cuts.push_back(static_cast<int>(frame));
    }
    if (cuts == 0) in.fail("a run without frames", "one frame or more");
    if (!std::ranges::is_sorted(run.cuts, std::less_equal<>{})) in.fail("cuts out of order", "ascending frames");
    for (int i = 0; i < run.sequence_count(); ++i) {
      const std::uint64_t cycles = get_varint(in);
      if (cycles > 8) in.fail(fmt::format("a sequence of {} cycles", cycles), "0 to 8");
      run.cycles.push_back(static_cast<std::uint8_t>(cycles));
    }
    get_alternatives(in, run);
  }
  out.skeleton = unpack_skeleton(get_part(in, "bytes"), source);
  out.curves.side_tracks = unpack_side_tracks(get_part(in, "bytes"), static_cast<int>(frames), out.skeleton, source);
  frame_count = static_cast<int>(frames);
  return out;
}

}  // namespace

int prepared_parts(const PreparedClip& clip) {
  return parts_of(clip.curves.frames());
}

Bytes pack_prepared(const PreparedClip& clip, int part) {
  ByteWriter out;
  if (part == 0) put_head(out, clip);
  put_rows(out, clip.curves.values, part);
  return one_section("prepared-clip", "clip", std::move(out).take());
}

std::optional<PreparedClip> unpack_prepared(const std::function<std::optional<Bytes>(int part)>& part_of,
                                            const std::string& source) {
  PreparedClip out;
  int parts = 1;
  for (int part = 0; part < parts; ++part) {
    const std::optional<Bytes> bytes = part_of(part);
    if (!bytes) return std::nullopt;
    const Bitstream stream = Bitstream::parse(*bytes, source);
    stream.require_kind("prepared-clip");
    ByteReader in(stream.section("clip"), source);
    if (part == 0) {
      int frames = 0;
      out = get_head(in, source, frames);
      const int curves = curve_layout(out.skeleton).curve_count();
      const auto first_values = static_cast<std::size_t>(rows_of_part(frames, 0)) * static_cast<std::size_t>(curves);
      if (in.remaining() != first_values * sizeof(float)) in.fail("another number of values", "those of its frames");
      parts = parts_of(frames);
      if (parts > 1 && !part_of(parts - 1)) return std::nullopt;
      out.curves.values.resize(frames, curves);
    }
    get_rows(in, part, out.curves.values);
  }
  return out;
}

}  // namespace kinespace
