#include "kinespace/codecs/pose_space/pose_space_basis.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/codecs/pose_space/detail/pose_space_search.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

// From a mean joint error of about 0.04 cm to 5 cm.
constexpr double finest_step = 0.25;
constexpr int ladder = 15;
constexpr double shell_ratio = 1.45;  // held on the average, so that single clips keep to 1.6
constexpr std::uint64_t most_rungs = 64;

}  // namespace

PoseSpaceBasis::PoseSpaceBasis(std::vector<Skeleton> skeletons, std::vector<PoseSpaceTables> rungs)
    : skeletons_(std::move(skeletons)), rungs_(std::move(rungs)), id_(content_hash(pack()).substr(0, 16)) {}

PoseSpaceBasis PoseSpaceBasis::learn(std::span<const Clip> clips, const Progress& progress) {
  PoseSpaceSearch search(clips, progress, {}, shell_ratio, nullptr);
  std::vector<PoseSpaceTables> rungs;
  // From coarse to fine: each starts from what the one before has learned.
  for (int r = ladder - 1; r >= 0; --r) {
    progress.at("learning the basis", 1 - static_cast<double>(r + 1) / ladder);
    rungs.push_back(search.tables_at(finest_step * std::pow(2.0, 0.5 * r), r == 0));
  }
  std::ranges::reverse(rungs);
  // What was read back is what every reader has.
  const PoseSpaceBasis made(search.skeletons(), std::move(rungs));
  return unpack(made.pack(), "the basis");
}

Bytes PoseSpaceBasis::pack() const {
  ByteWriter out;
  put_part(out, pack_skeletons(skeletons_));
  put_varint(out, rungs_.size());
  for (const PoseSpaceTables& tables : rungs_) put_part(out, pack_pose_space_tables(tables));
  return std::move(out).take();
}

PoseSpaceBasis PoseSpaceBasis::unpack(std::span<const std::byte> bytes, const std::string& source) {
  ByteReader in(bytes, source);
  std::vector<Skeleton> skeletons = unpack_skeletons(get_part(in, "bytes of skeletons"), source);
  const auto joints = static_cast<int>(skeletons.front().rotating_joints().size());
  const std::uint64_t count = get_varint(in);
  if (count < 1 || count > most_rungs) in.fail("a basis of no or too many rungs", "1 to 64");
  std::vector<PoseSpaceTables> rungs;
  for (std::uint64_t r = 0; r < count; ++r) {
    rungs.push_back(unpack_pose_space_tables(get_part(in, "bytes of a rung"), joints, source));
    const bool fits = rungs.back().reference.steps == rungs.front().reference.steps &&
                      (r == 0 || rungs.back().step > rungs[r - 1].step);
    if (!fits) in.fail("rungs that do not belong together", "one reference pose, steps that grow (damaged)");
  }
  in.expect_end();
  return {std::move(skeletons), std::move(rungs)};
}

int PoseSpaceBasis::rung_for(double step) const {
  std::size_t best = 0;
  for (std::size_t r = 1; r < rungs_.size(); ++r) {
    if (std::abs(std::log(rungs_[r].step / step)) < std::abs(std::log(rungs_[best].step / step))) best = r;
  }
  return static_cast<int>(best);
}

}  // namespace kinespace
