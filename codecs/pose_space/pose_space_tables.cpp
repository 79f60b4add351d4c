#include "kinespace/codecs/pose_space/pose_space_tables.h"

#include <algorithm>
#include <cmath>

#include "kinespace/entropy/integer_coder.h"
#include "kinespace/motion/simd.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

Bytes pack_points(const ReconstructionPoints& points) {
  IntegerWriter out;
  for (const auto& row : points.shift) {
    for (std::size_t m = 0; m < row.size(); ++m) out.put(row[m], static_cast<int>(m));
  }
  return std::move(out).finish();
}

ReconstructionPoints unpack_points(std::span<const std::byte> bytes, const std::string& source) {
  IntegerReader in(bytes, source);
  ReconstructionPoints out;
  for (auto& row : out.shift) {
    for (std::size_t m = 0; m < row.size(); ++m) {
      row[m] = static_cast<std::int8_t>(in.get_between(-48, 48, static_cast<int>(m)));
    }
  }
  in.expect_end();
  return out;
}

double get_number(ByteReader& in, double least, double most, const char* what) {
  const auto value = in.get<double>();
  if (!(value >= least && value <= most)) in.fail(what, "a number in its range (damaged)");
  return value;
}

double get_step(ByteReader& in) {
  return get_number(in, 1e-12, 1e12, "a quantiser step out of range");
}

int get_group_frames(ByteReader& in) {
  const std::uint64_t frames = get_varint(in);
  if (frames < 1 || frames > (1U << 24)) in.fail("groups of no or too many frames", "1 to 2^24");
  return static_cast<int>(frames);
}

KINESPACE_VECTOR_CLONES void add_scaled(const double* from, double factor, double* to, std::size_t n) {
  for (std::size_t k = 0; k < n; ++k) to[k] += factor * from[k];
}

// Of a row of coefficients the number up to the last that is not zero.
std::size_t used(std::span<const double> row) {
  std::size_t n = row.size();
  while (n > 0 && row[n - 1] == 0) --n;
  return n;
}

}  // namespace

Bytes pack_pose_space_tables(const PoseSpaceTables& tables) {
  ByteWriter out;
  out.put(tables.step);
  out.put(tables.shell_weight);
  put_varint(out, static_cast<std::uint64_t>(tables.group_frames));
  for (const auto& steps : tables.reference.steps) out.put_array(std::span<const std::int8_t>(steps));
  put_varint(out, static_cast<std::uint64_t>(tables.basis.components));
  put_part(out, pack_basis(tables.basis));
  put_part(out, pack_spectrum(tables.coding.spectrum));
  put_part(out, pack_start(tables.coding.start));
  put_part(out, pack_points(tables.coding.points));
  return std::move(out).take();
}

PoseSpaceTables unpack_pose_space_tables(std::span<const std::byte> bytes, int rotating_joints,
                                         const std::string& source) {
  ByteReader in(bytes, source);
  PoseSpaceTables out;
  out.step = get_step(in);
  out.shell_weight = get_number(in, 0, 1e6, "a shell weight out of range");
  out.group_frames = get_group_frames(in);
  for (int j = 0; j < rotating_joints; ++j) {
    std::array<std::int8_t, 3> steps{};
    for (std::int8_t& s : steps) s = in.get<std::int8_t>();
    out.reference.steps.push_back(steps);
  }
  const int dimensions = out.reference.dimensions();
  const std::uint64_t components = get_varint(in);
  if (components > static_cast<std::uint64_t>(dimensions)) {
    in.fail(std::to_string(components) + " components", "at most " + std::to_string(dimensions));
  }
  const auto count = static_cast<int>(components);
  out.basis = unpack_basis(get_part(in, "bytes of a table"), dimensions, count, source);
  out.coding.spectrum = unpack_spectrum(get_part(in, "bytes of a table"), count, source);
  out.coding.start = unpack_start(get_part(in, "bytes of a table"), source);
  out.coding.points = unpack_points(get_part(in, "bytes of a table"), source);
  in.expect_end();
  return out;
}

Bytes pack_own_tables(const PoseSpaceTables& tables, int rung) {
  ByteWriter out;
  put_varint(out, static_cast<std::uint64_t>(rung));
  out.put(tables.step);
  put_varint(out, static_cast<std::uint64_t>(tables.group_frames));
  put_part(out, pack_spectrum(tables.coding.spectrum));
  return std::move(out).take();
}

PoseSpaceTables unpack_own_tables(std::span<const std::byte> bytes, std::span<const PoseSpaceTables> rungs,
                                  const std::string& source) {
  ByteReader in(bytes, source);
  const std::uint64_t rung = get_varint(in);
  if (rung >= rungs.size()) in.fail("a rung that the basis does not have", "the basis it was made with (damaged)");
  PoseSpaceTables out = rungs[rung];
  out.step = get_step(in);
  out.group_frames = get_group_frames(in);
  out.coding.spectrum = unpack_spectrum(get_part(in, "bytes of a table"), out.basis.components, source);
  in.expect_end();
  return out;
}

WindowLayout lay_out(const ClipTable& table, const Spectrum& spectrum, int group_frames) {
  WindowLayout out;
  int in_group = 0;
  for (std::size_t c = 0; c < table.clips.size(); ++c) {
    const ClipEntry& clip = table.clips[c];
    out.first_of_clip.push_back(out.windows.size());
    int first = 0;
    for (std::size_t b = 0; b < clip.blocks.size(); ++b) {
      const bool opens = out.groups.empty() || in_group >= group_frames;
      if (opens) {
        out.groups.push_back({out.windows.size(), 0});
        in_group = 0;
      }
      WindowPlace window{.clip = static_cast<int>(c),
                         .first = first,
                         .points = clip.blocks[b],
                         .finer = clip.finer[b],
                         .follows = b > 0 && !opens};
      window.functions = spectrum.functions_used(band_edges(window.points, window.points, clip.rate_hz));
      window.edges = band_edges(window.functions, window.points, clip.rate_hz);
      out.windows.push_back(window);
      ++out.groups.back().count;
      first += window.points;
      in_group += window.points;
    }
  }
  out.first_of_clip.push_back(out.windows.size());
  return out;
}

std::shared_ptr<const NaturalFunctions> FunctionTables::get(int points, int functions) {
  constexpr std::size_t most_bytes = std::size_t{32} << 20;
  const std::lock_guard lock(mutex_);
  const std::pair key(points, functions);
  const auto found = tables_.find(key);
  if (found != tables_.end()) return found->second;
  const std::size_t bytes =
      sizeof(double) * static_cast<std::size_t>(functions) * static_cast<std::size_t>((points + 1) / 2);
  if (bytes_ + bytes > most_bytes) {
    tables_.clear();
    bytes_ = 0;
  }
  bytes_ += bytes;
  return tables_.emplace(key, std::make_shared<const NaturalFunctions>(points, functions)).first->second;
}

Eigen::MatrixXd metric_at_rest(const ReferencePose& reference, const Skeleton& skeleton, double shell_weight) {
  const std::vector<double> rest(static_cast<std::size_t>(reference.dimensions()), 0.0);
  return fixed_cholesky(pose_metric(skeleton, reference, rest).lifted(shell_weight));
}

WindowSynthesis::WindowSynthesis(const PoseSpaceTables& tables, const Skeleton& skeleton)
    : basis_(solve_transposed(metric_at_rest(tables.reference, skeleton, tables.shell_weight), tables.basis.mixing())),
      step_(tables.step) {}

void WindowSynthesis::synthesise(const WindowPlace& window, std::span<const double> values, std::span<double> out,
                                 Scratch& scratch) const {
  const auto functions = static_cast<std::size_t>(window.functions);
  const auto dimensions = static_cast<std::size_t>(basis_.rows());
  scratch.coefficients.assign(dimensions * functions, 0.0);
  const double scale = step_ * std::pow(0.5, window.finer / 2) * (window.finer % 2 == 1 ? 0.70710678118654752 : 1.0);
  std::size_t longest = 0;
  for (Eigen::Index c = 0; c < basis_.cols(); ++c) {
    const auto row = values.subspan(static_cast<std::size_t>(c) * functions, functions);
    const std::size_t n = used(row);
    longest = std::max(longest, n);
    if (n == 0) continue;
    for (std::size_t d = 0; d < dimensions; ++d) {
      add_scaled(row.data(), scale * basis_(static_cast<Eigen::Index>(d), c),
                 scratch.coefficients.data() + d * functions, n);
    }
  }
  if (longest == 0) {
    std::ranges::fill(out, 0.0);
    return;
  }
  const auto natural = functions_->get(window.points, window.functions);
  natural->synthesise(scratch.coefficients.data(), static_cast<std::ptrdiff_t>(functions), static_cast<int>(longest),
                      static_cast<int>(dimensions), out.data(), scratch.sums);
}

}  // namespace kinespace
