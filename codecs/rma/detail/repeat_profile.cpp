#include "kinespace/codecs/rma/detail/repeat_profile.h"

#include <algorithm>
#include <list>
#include <mutex>

#include "kinespace/base/error.h"
#include "kinespace/codecs/rma/detail/repeat_encoder.h"
#include "kinespace/codecs/rma/marker_stream.h"
#include "kinespace/codecs/stream/clip_reader.h"
#include "kinespace/codecs/stream/target_search.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

constexpr double steps_of_error = 7;  // a step for a mean joint error of 1 cm, about

// Groups that were decoded, the latest used first, as long as they take little memory.
class GroupCache {
 public:
  using Group = std::shared_ptr<const RepeatGroup>;
  [[nodiscard]] Group find(std::size_t number) {
    const std::scoped_lock lock(mutex_);
    for (auto at = kept_.begin(); at != kept_.end(); ++at) {
      if (at->first != number) continue;
      kept_.splice(kept_.begin(), kept_, at);
      return at->second;
    }
    return nullptr;
  }
  void keep(std::size_t number, Group group) {
    constexpr std::size_t most = std::size_t{12} << 20;
    const std::scoped_lock lock(mutex_);
    size_ += bytes(*group);
    kept_.emplace_front(number, std::move(group));
    while (size_ > most && kept_.size() > 1) {
      size_ -= bytes(*kept_.back().second);
      kept_.pop_back();
    }
  }

 private:
  static std::size_t bytes(const RepeatGroup& group) {
    return sizeof(double) * (group.values[0].size() + group.values[1].size());
  }
  std::mutex mutex_;
  std::list<std::pair<std::size_t, Group>> kept_;
  std::size_t size_ = 0;
};

class RepeatReader final : public ClipReader {
 public:
  explicit RepeatReader(Bitstream bits) : ClipReader(std::move(bits)) {
    const std::string& source = stream().source();
    const int joints = static_cast<int>(table().skeletons.front().rotating_joints().size());
    tables_.tables = unpack_pose_space_tables(stream().section("tables"), joints, source);
    unpack_repeats(stream().section("repeats"), table(), most_numbers(stream().size()), source, tables_);
    layout_ = std::make_unique<RepeatLayout>(table(), tables_);
    codes_ = unpack_parts(stream().section("windows"), layout_->plain.groups.size(), "bytes of a group", source);
    decoder_ = std::make_unique<RepeatDecoder>(
        table(), tables_, *layout_, [this](std::size_t g) { return group(g); }, source);
  }

 private:
  // Contacts and seams reach over the whole clip.
  [[nodiscard]] Clip part(std::size_t clip, int first, int count, int) const override {
    return cut(decoder_->decode(clip), first, count);
  }

  [[nodiscard]] std::shared_ptr<const RepeatGroup> group(std::size_t g) const {
    if (auto found = cache_.find(g)) return found;
    auto out = std::make_shared<RepeatGroup>();
    out->places.resize(layout_->plain.groups[g].count);
    ByteReader in(codes_[g], stream().source());
    for (const bool is_predicted : {false, true}) {
      const GroupPart part = group_part(*layout_, tables_, g, is_predicted);
      if (part.windows.empty()) continue;
      auto& values = out->values[is_predicted ? 1 : 0];
      values.assign(part.size, 0.0);
      std::vector<CoefficientBlock> blocks = part.blocks;
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        const std::size_t end = i + 1 < blocks.size() ? part.offsets[i + 1] : part.size;
        blocks[i].values = std::span(values).subspan(part.offsets[i], end - part.offsets[i]);
        out->places[part.windows[i] - layout_->plain.groups[g].first] = {part.offsets[i], end - part.offsets[i]};
      }
      std::vector<std::span<const std::byte>> layers;
      for (int layer = 0; layer < layer_count; ++layer) layers.push_back(get_part(in, "bytes of a layer"));
      decode_group(blocks, is_predicted ? tables_.predicted : tables_.tables.coding, layers, stream().source());
    }
    in.expect_end();
    cache_.keep(g, out);
    return out;
  }

  RepeatTables tables_;
  std::unique_ptr<RepeatLayout> layout_;
  std::vector<std::span<const std::byte>> codes_;
  std::unique_ptr<RepeatDecoder> decoder_;
  mutable GroupCache cache_;
};

}  // namespace

Bytes encode_repeat_profile(std::span<const Clip> clips, const CodecTarget& target, const RepeatSettings& settings,
                            const Progress& progress) {
  RepeatEncoder encoder(clips, {.repeats = settings.repeats, .contacts = settings.contacts}, progress);
  double step = settings.step;
  if (target.mean_error_cm) step = steps_of_error * *target.mean_error_cm;
  if (target.max_error_cm) step = steps_of_error * *target.max_error_cm / 8;
  double planned = 0;
  bool predicted = false;  // by any attempt
  const auto attempt_at = [&](double at, bool predict) {
    if (planned == 0 || at > 1.6 * planned || at < planned / 1.6) {
      encoder.plan(at);
      planned = at;
    }
    predicted = predicted || (predict && encoder.predicts());
    const RepeatAttempt made = encoder.attempt(at, predict);
    const MeasuredError error = made.error.measured();
    return CodedAttempt{write_repeat_stream(made, error), error};
  };
  const auto meet = [&](bool predict) {
    if (!target.any()) return attempt_at(step, predict).stream;
    return search_target(target, {.start = step, .least = 1e-6, .most = 1e4, .rounds = 7},
                         [&](double at) { return attempt_at(at, predict); });
  };
  Bytes best = meet(settings.repeats);
  if (!predicted) return best;
  // Never more than with every clip unique.
  planned = 0;
  Bytes alone = meet(false);
  const double told = Bitstream::parse(best, "").error().mean_joint_error_cm;
  const double untold = Bitstream::parse(alone, "").error().mean_joint_error_cm;
  // Of two within a size the nearer one, of two within an error the smaller one.
  if (target.bytes) return untold < told ? alone : best;
  if (!target.any()) return alone.size() <= best.size() && untold <= told ? alone : best;
  return alone.size() < best.size() ? alone : best;
}

std::unique_ptr<StreamReader> open_repeat_profile(Bitstream stream) {
  return std::make_unique<RepeatReader>(std::move(stream));
}

}  // namespace kinespace
