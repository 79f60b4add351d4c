#include "kinespace/codecs/stream/joint_channels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/stream/detail/joint_turns.h"
#include "kinespace/entropy/range_coder.h"

namespace kinespace {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Base {
  Quaterniond turn = Quaterniond::Identity();
  Vector3d position = Vector3d::Zero();
};

// The joints above the travel root, from joint 0 down.
std::vector<int> joints_above(const Skeleton& skeleton) {
  std::vector<int> out;
  const auto parent = [&](int j) { return skeleton.joints[static_cast<std::size_t>(j)].parent; };
  for (int j = parent(skeleton.travel_root()); j >= 0; j = parent(j)) out.insert(out.begin(), j);
  return out;
}

Base base_of(const Clip& clip, const std::vector<int>& above, int frame) {
  Base out;
  for (const int j : above) {
    out.position += out.turn * clip.translation(j, frame);
    out.turn = out.turn * clip.rotation(j, frame);
  }
  return out;
}

// Plain products and sums: what reaches a decoded clip must not depend on how Eigen was compiled.
Quaterniond unit(double w, double x, double y, double z) {
  const double norm = std::sqrt(((w * w + x * x) + y * y) + z * z);
  if (!(norm > 0)) return Quaterniond::Identity();
  return {w / norm, x / norm, y / norm, z / norm};
}

constexpr int turn_count_bits = 2;
constexpr int bit_count_bits = 5;
constexpr int middle_bits = 28;

void put_bits(RangeEncoder& out, std::uint32_t value, int bits) {
  for (int i = bits - 1; i >= 0; --i) out.encode_even(((value >> i) & 1U) != 0);
}

std::uint32_t get_bits(RangeDecoder& in, int bits) {
  std::uint32_t out = 0;
  for (int i = 0; i < bits; ++i) out = (out << 1) | (in.decode_even() ? 1U : 0U);
  return out;
}

[[noreturn]] void damaged(const std::string& source) {
  throw Error(ErrorKind::bad_input, {.file = source,
                                     .found = "a table of joints that ends too early or too late",
                                     .expected = "what the encoder writes (damaged)"});
}

// A number of models that depends on nothing but the build, so that streams are alike.
struct LayoutModels {
  std::array<AdaptiveBit, 4> turns;
  AdaptiveBit undoes;
  AdaptiveBit middle;
  std::array<std::array<AdaptiveBit, 1U << bit_count_bits>, 4> bits;
};

template <typename Coder>
int code_tree(Coder& coder, AdaptiveBit* tree, int bits, int value) {
  std::size_t node = 1;
  for (int i = bits - 1; i >= 0; --i) {
    bool bit = ((value >> i) & 1) != 0;
    if constexpr (std::is_same_v<Coder, RangeEncoder>) {
      coder.encode(bit, tree[node]);
    } else {
      bit = coder.decode(tree[node]);
    }
    node = 2 * node + (bit ? 1 : 0);
  }
  return static_cast<int>(node) - (1 << bits);
}

void put_turn(RangeEncoder& out, const GridTurn& turn, AdaptiveBit* tree) {
  code_tree(out, tree, bit_count_bits, turn.bits);
  if (turn.bits == 0) return;
  put_bits(out, static_cast<std::uint32_t>(turn.largest), 2);
  const std::int32_t middle = 1 << turn.bits;
  for (const std::int32_t s : turn.steps) put_bits(out, static_cast<std::uint32_t>(s + middle), turn.bits + 1);
}

GridTurn get_turn(RangeDecoder& in, AdaptiveBit* tree, const std::string& source) {
  GridTurn out{.bits = code_tree(in, tree, bit_count_bits, 0)};
  if (out.bits == 1 || out.bits > GridTurn::most_bits) damaged(source);
  if (out.bits == 0) return out;
  out.largest = static_cast<int>(get_bits(in, 2));
  for (std::int32_t& s : out.steps) s = static_cast<std::int32_t>(get_bits(in, out.bits + 1)) - (1 << out.bits);
  return out;
}

}  // namespace

GridTurn GridTurn::nearest(const Quaterniond& q, int bits) {
  GridTurn out{.bits = bits};
  const std::array<double, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
  for (int k = 1; k < 4; ++k) {
    if (std::abs(wxyz[static_cast<std::size_t>(k)]) > std::abs(wxyz[static_cast<std::size_t>(out.largest)])) {
      out.largest = k;
    }
  }
  const double sign = wxyz[static_cast<std::size_t>(out.largest)] < 0 ? -1 : 1;
  const double steps = std::ldexp(1.0, bits);
  for (std::size_t k = 0, at = 0; k < 4; ++k) {
    if (static_cast<int>(k) == out.largest) continue;
    out.steps[at++] = static_cast<std::int32_t>(std::lround(sign * wxyz[k] * steps));
  }
  return out;
}

Quaterniond GridTurn::value() const {
  if (bits == 0) return Quaterniond::Identity();
  std::array<double, 4> wxyz{};
  double rest = 1;
  for (std::size_t k = 0, at = 0; k < 4; ++k) {
    if (static_cast<int>(k) == largest) continue;
    wxyz[k] = std::ldexp(static_cast<double>(steps[at++]), -bits);
    rest -= wxyz[k] * wxyz[k];
  }
  wxyz[static_cast<std::size_t>(largest)] = std::sqrt(std::max(rest, 0.0));
  return unit(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
}

int ChannelLayout::channel_count() const {
  int out = 3;
  for (const JointFreedom& joint : joints) out += joint.turns;
  return out;
}

ChannelCurves channel_curves(const Clip& clip, const ChannelLayout& layout) {
  const auto n = static_cast<std::size_t>(clip.frames);
  ChannelCurves out{.frames = clip.frames};
  out.values.resize(static_cast<std::size_t>(layout.channel_count()) * n);
  const int root = layout.joints.front().joint;
  const std::vector<int> above = joints_above(clip.skeleton);
  for (int f = 0; f < clip.frames; ++f) {
    const Base base = base_of(clip, above, f);
    const Vector3d position = base.position + base.turn * clip.translation(root, f);
    if (!position.allFinite()) {
      throw Error(ErrorKind::bad_input,
                  {.file = clip.name, .found = "a position that is no number", .expected = "finite positions"});
    }
    for (std::size_t k = 0; k < 3; ++k) {
      out.values[k * n + static_cast<std::size_t>(f)] = position[static_cast<Eigen::Index>(k)];
    }
  }
  std::vector<Quaterniond> turns;
  for (const JointFreedom& joint : layout.joints) {
    turns.clear();
    append_turns(clip, joint.joint, turns);
    JointTurns(joint).angles(turns, std::span(out.values)
                                        .subspan(static_cast<std::size_t>(joint.first_channel) * n,
                                                 static_cast<std::size_t>(joint.turns) * n));
  }
  return out;
}

void write_joint_channels(const JointFreedom& freedom, std::span<const double> channels, int first, int count,
                          Clip& clip) {
  const JointTurns rule(freedom);
  const bool travels = freedom.joint == clip.skeleton.travel_root();
  const std::vector<int> above = travels ? joints_above(clip.skeleton) : std::vector<int>{};
  std::vector<Quaterniond> turns(static_cast<std::size_t>(count));
  rule.rotations(channels.first(rule.turns() * turns.size()), turns);
  for (int i = 0; i < count; ++i) {
    const Quaterniond& q = turns[static_cast<std::size_t>(i)];
    clip.set_rotation(freedom.joint, first + i,
                      above.empty() ? q : base_of(clip, above, first + i).turn.conjugate() * q);
  }
}

void write_root_position(std::span<const double> channels, int first, int count, Clip& clip) {
  const auto n = static_cast<std::size_t>(count);
  const int root = clip.skeleton.travel_root();
  const std::vector<int> above = joints_above(clip.skeleton);
  clip.require_translation_track(root);
  for (std::size_t i = 0; i < n; ++i) {
    const int frame = first + static_cast<int>(i);
    const Base base = base_of(clip, above, frame);
    const Vector3d position(channels[i], channels[n + i], channels[2 * n + i]);
    clip.require_translation_track(root).values[static_cast<std::size_t>(frame)] =
        base.turn.conjugate() * (position - base.position);
  }
}

void write_channels(const ChannelLayout& layout, std::span<const double> channels, int first, int count, Clip& clip) {
  const auto n = static_cast<std::size_t>(count);
  write_root_position(channels.first(3 * n), first, count, clip);
  for (const JointFreedom& joint : layout.joints) {
    write_joint_channels(
        joint,
        channels.subspan(static_cast<std::size_t>(joint.first_channel) * n, static_cast<std::size_t>(joint.turns) * n),
        first, count, clip);
  }
}

Bytes pack_layout(const ChannelLayout& layout) {
  RangeEncoder out;
  LayoutModels models;
  for (const JointFreedom& joint : layout.joints) {
    code_tree(out, models.turns.data(), turn_count_bits, joint.turns);
    AdaptiveBit* tree = models.bits[static_cast<std::size_t>(joint.turns)].data();
    put_turn(out, joint.before, tree);
    if (joint.turns == 0) continue;
    out.encode(joint.after_undoes, models.undoes);
    if (!joint.after_undoes) put_turn(out, joint.after, tree);
    if (joint.turns != 2) continue;
    out.encode(joint.middle_degrees != 0, models.middle);
    if (joint.middle_degrees == 0) continue;
    const auto steps = static_cast<std::int32_t>(std::lround(joint.middle_degrees * (1 << 20)));
    put_bits(out, static_cast<std::uint32_t>(steps + (1 << (middle_bits - 1))), middle_bits);
  }
  return std::move(out).finish();
}

ChannelLayout unpack_layout(std::span<const std::byte> bytes, const Skeleton& skeleton, const std::string& source) {
  RangeDecoder in(bytes);
  LayoutModels models;
  ChannelLayout out;
  int next = 3;
  for (const int j : skeleton.rotating_joints()) {
    JointFreedom joint{.joint = j, .turns = code_tree(in, models.turns.data(), turn_count_bits, 0)};
    AdaptiveBit* tree = models.bits[static_cast<std::size_t>(joint.turns)].data();
    joint.before = get_turn(in, tree, source);
    if (joint.turns > 0) {
      joint.after_undoes = in.decode(models.undoes);
      if (!joint.after_undoes) joint.after = get_turn(in, tree, source);
    }
    if (joint.turns == 2 && in.decode(models.middle)) {
      const auto steps = static_cast<std::int32_t>(get_bits(in, middle_bits)) - (1 << (middle_bits - 1));
      joint.middle_degrees = static_cast<double>(steps) / (1 << 20);
    }
    joint.first_channel = next;
    next += joint.turns;
    if (in.overrun()) damaged(source);
    out.joints.push_back(joint);
  }
  if (!in.used_up()) damaged(source);
  return out;
}

void require_channels_below(double most, const ChannelCurves& curves, const std::string& clip) {
  for (const double v : curves.values) {
    if (std::abs(v) < most) continue;
    throw Error(ErrorKind::bad_input,
                {.file = clip,
                 .found = fmt::format("a root farther than {:.0f} km away, or a joint that turned {:.0f} times",
                                      most / 1e5, std::floor(most / 360)),
                 .expected = "positions in centimetres and rotations"});
  }
}

// The search for what joints can do.

namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double to_degrees = 180 / std::numbers::pi;
// Grids as coarse as rebuilding within this allows (or little more than the finest grid's error).
constexpr double grid_error_degrees = 2e-4;
constexpr int frame_bits = 5;  // where A and B only choose among exact descriptions

// R as numbers, row by row.
Vector9 flat(const Quaterniond& q) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> r = q.toRotationMatrix();
  return Eigen::Map<const Vector9>(r.data());
}

struct Moments {
  Matrix9 square = Matrix9::Zero();      // mean of r r'
  Matrix9 covariance = Matrix9::Zero();  // about the mean of r
  Matrix3d middle = Matrix3d::Zero();    // mean of R
  Quaterniond mean = Quaterniond::Identity();
};

Moments moments_of(std::span<const Quaterniond> turns) {
  Moments out;
  Vector9 mean = Vector9::Zero();
  Eigen::Matrix4d quaternions = Eigen::Matrix4d::Zero();
  for (const Quaterniond& q : turns) {
    mean += flat(q);
    quaternions += q.coeffs() * q.coeffs().transpose();
  }
  const double n = static_cast<double>(turns.size());
  mean /= n;
  for (const Quaterniond& q : turns) {
    const Vector9 away = flat(q) - mean;
    out.covariance += away * away.transpose();
  }
  out.covariance /= n;
  out.square = out.covariance + mean * mean.transpose();
  out.middle = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(mean.data());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(quaternions);
  out.mean = Quaterniond(Eigen::Vector4d(solver.eigenvectors().col(3))).normalized();
  return out;
}

// The sum of squares (u (x) v)' form (u (x) v) as a form in u alone, or in v alone.
Matrix3d form_in_u(const Matrix9& form, const Vector3d& v) {
  Matrix3d out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out(i, j) = v.dot(form.block<3, 3>(3 * i, 3 * j) * v);
  }
  return out;
}
Matrix3d form_in_v(const Matrix9& form, const Vector3d& u) {
  Matrix3d out = Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out += u[i] * u[j] * form.block<3, 3>(3 * i, 3 * j);
  }
  return out;
}

struct Axes {
  Vector3d u = Vector3d::UnitZ();
  Vector3d v = Vector3d::UnitX();
  double value = std::numeric_limits<double>::infinity();
};

Vector3d least_direction(const Matrix3d& form, double& value) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(form);
  value = solver.eigenvalues()[0];
  return solver.eigenvectors().col(0);
}

// Best u for v and best v for u in turn.
void alternate(const Matrix9& form, int rounds, Axes& axes) {
  for (int round = 0; round < rounds; ++round) {
    const Vector3d before = axes.u;
    axes.v = least_direction(form_in_v(form, axes.u), axes.value);
    axes.u = least_direction(form_in_u(form, axes.v), axes.value);
    if (axes.u.dot(before) < 0) axes.u = -axes.u;
    if ((axes.u - before).norm() < 1e-13) return;
  }
}

// u (x) v of least value, from the nine eigenvectors as starts.
Axes least_axes(const Matrix9& form) {
  const Eigen::SelfAdjointEigenSolver<Matrix9> solver(form);
  Axes best;
  for (int k = 0; k < 9; ++k) {
    const Vector9 e = solver.eigenvectors().col(k);
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> matrix(e.data());
    const Eigen::JacobiSVD<Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Axes axes{.u = svd.matrixU().col(0), .v = svd.matrixV().col(0)};
    alternate(form, 20, axes);
    if (axes.value < best.value) best = axes;
  }
  alternate(form, 400, best);
  return best;
}

// How far, in degrees, the farthest frame is from what the freedom can express.
double largest_residual(const JointFreedom& freedom, std::span<const Quaterniond> turns) {
  const JointTurns rule(freedom);
  constexpr std::size_t block = 256;
  std::vector<double> angles(3 * block);
  std::vector<Quaterniond> rebuilt(block);
  double least = 1;
  for (std::size_t first = 0; first < turns.size(); first += block) {
    const std::size_t count = std::min(block, turns.size() - first);
    rule.angles(turns.subspan(first, count), std::span(angles).first(rule.turns() * count));
    rule.rotations(std::span<const double>(angles).first(rule.turns() * count), std::span(rebuilt).first(count));
    for (std::size_t f = 0; f < count; ++f) {
      // The sine of half the angle: its cosine says nothing about small ones.
      const Quaterniond apart = turns[first + f].conjugate() * rebuilt[f];
      least = std::min(least, 1 - apart.vec().squaredNorm());
    }
  }
  return 2 * std::asin(std::sqrt(std::max(0.0, 1 - least))) * to_degrees;
}

// A proposal with A and B not on a grid yet.
struct Proposal {
  int turns = 0;
  Quaterniond before = Quaterniond::Identity();
  Quaterniond after = Quaterniond::Identity();
  bool after_undoes = false;
  double middle_degrees = 0;
};

JointFreedom on_grid(const Proposal& proposal, int bits) {
  JointFreedom out{.turns = proposal.turns, .before = GridTurn::nearest(proposal.before, bits)};
  out.after_undoes = proposal.after_undoes;
  if (!out.after_undoes && proposal.turns > 0) out.after = GridTurn::nearest(proposal.after, bits);
  constexpr double grid = 1 << 20;
  out.middle_degrees = std::nearbyint(proposal.middle_degrees * grid) / grid;
  return out;
}

// The coarsest grid that does as well as the finest; false when even that leaves the tolerance.
bool accept(const Proposal& proposal, std::span<const Quaterniond> turns, double tolerance, JointFreedom& out) {
  const double finest = largest_residual(on_grid(proposal, GridTurn::most_bits), turns);
  if (!(finest <= tolerance)) return false;
  const double goal = std::min(tolerance, std::max(grid_error_degrees, 1.1 * finest));
  int bits = 10;
  for (; bits < GridTurn::most_bits; bits += 2) {
    if (largest_residual(on_grid(proposal, bits), turns) <= goal) break;
  }
  out = on_grid(proposal, std::min(bits, GridTurn::most_bits));
  return true;
}

Proposal hinge(const Vector3d& axis, const Quaterniond& mean) {
  Proposal out{.turns = 1, .before = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis)};
  // When the mean is a turn about the same axis, so are all, and no constant turn is left over.
  out.after_undoes = (mean.vec() - axis * axis.dot(mean.vec())).norm() < 1e-6;
  out.after = out.before.conjugate() * mean;
  return out;
}

Quaterniond frame_of(const Vector3d& x, const Vector3d& z) {
  Matrix3d axes;
  axes.col(0) = x;
  axes.col(2) = z;
  axes.col(1) = z.cross(x);
  return Quaterniond(axes).normalized();
}

Proposal universal(const Axes& axes, const Matrix3d& middle) {
  Proposal out{.turns = 2};
  out.middle_degrees = -std::asin(std::clamp(axes.u.dot(middle * axes.v), -1.0, 1.0)) * to_degrees;
  if (std::abs(out.middle_degrees) < 1e-5) out.middle_degrees = 0;
  if (std::abs(axes.u.dot(axes.v)) < 1e-7) {
    out.before = frame_of((axes.v - axes.u * axes.u.dot(axes.v)).normalized(), axes.u);
    out.after_undoes = true;
    return out;
  }
  out.before = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axes.u);
  out.after = Quaterniond::FromTwoVectors(axes.v, Vector3d::UnitX());
  return out;
}

// Any turns, the mean at zero.
JointFreedom free_joint(const Moments& moments) {
  const Axes axes = least_axes(moments.square);
  Quaterniond before = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axes.u);
  Quaterniond after = Quaterniond::FromTwoVectors(axes.v, Vector3d::UnitX());
  const EulerAngles mean = euler_angles(zyx, before.conjugate() * moments.mean * after.conjugate());
  before = before * Eigen::AngleAxisd(mean[0] / to_degrees, Vector3d::UnitZ());
  after = Eigen::AngleAxisd(mean[2] / to_degrees, Vector3d::UnitX()) * after;
  return {.turns = 3, .before = GridTurn::nearest(before, frame_bits), .after = GridTurn::nearest(after, frame_bits)};
}

JointFreedom find_freedom(std::span<const Quaterniond> turns, double tolerance, bool travels) {
  const Moments moments = moments_of(turns);
  if (travels) return free_joint(moments);
  const double radians = tolerance / to_degrees;
  const double bound = 4 * radians * radians + 1e-18;  // of variances, when every frame is within the tolerance
  JointFreedom out;
  if (moments.covariance.trace() < 3 * bound && accept({.before = moments.mean}, turns, tolerance, out)) return out;
  Matrix3d about = Matrix3d::Zero();  // variance of R' u
  for (int k = 0; k < 3; ++k) about += form_in_u(moments.covariance, Vector3d::Unit(k));
  double variance = 0;
  const Vector3d axis = least_direction(about, variance);
  if (variance < 3 * bound && accept(hinge(axis, moments.mean), turns, tolerance, out)) return out;
  const Axes axes = least_axes(moments.covariance);
  constexpr double steepest = 75;
  if (axes.value < bound) {
    const Proposal proposal = universal(axes, moments.middle);
    if (std::abs(proposal.middle_degrees) < steepest && accept(proposal, turns, tolerance, out)) return out;
  }
  return free_joint(moments);
}

void check_trees(std::span<const Clip* const> clips) {
  if (clips.empty()) throw Error(ErrorKind::usage, {.found = "no clips", .expected = "at least one"});
  for (const Clip* clip : clips) {
    if (clip->skeleton.same_tree(clips.front()->skeleton)) continue;
    throw Error(ErrorKind::usage,
                {.file = clip->name, .found = "a skeleton of another tree", .expected = "that of the clips before"});
  }
}

}  // namespace

void ChannelSearch::validate() const {
  if (tolerance_degrees >= 1e-5 && tolerance_degrees <= 10) return;
  throw Error(ErrorKind::usage, {.found = fmt::format("ChannelSearch::tolerance_degrees = {}", tolerance_degrees),
                                 .expected = "1e-5 to 10"});
}

ChannelLayout find_channel_layout(std::span<const Clip* const> clips, const ChannelSearch& search) {
  search.validate();
  check_trees(clips);
  const std::vector<int> joints = clips.front()->skeleton.rotating_joints();
  ChannelLayout out;
  out.joints.resize(joints.size());
  parallel_for(std::size_t{0}, joints.size(), [&](std::size_t j) {
    std::vector<Quaterniond> turns;
    for (const Clip* clip : clips) append_turns(*clip, joints[j], turns);
    out.joints[j] = find_freedom(turns, search.tolerance_degrees, j == 0);
    out.joints[j].joint = joints[j];
  });
  int next = 3;
  for (JointFreedom& joint : out.joints) {
    joint.first_channel = next;
    next += joint.turns;
  }
  return out;
}

ChannelLayout find_channel_layout(std::span<const Clip> clips, const ChannelSearch& search) {
  std::vector<const Clip*> all;
  for (const Clip& clip : clips) all.push_back(&clip);
  return find_channel_layout(std::span<const Clip* const>(all), search);
}

}  // namespace kinespace
