#include "kinespace/codecs/pose_space/pose_space_codec.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/pose_space/detail/pose_space_encoder.h"
#include "kinespace/codecs/pose_space/detail/pose_space_search.h"
#include "kinespace/codecs/pose_space/pose_space_tables.h"
#include "kinespace/codecs/stream/clip_reader.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/measured_stream.h"

namespace kinespace {
namespace {

constexpr std::array pose_space_settings{
    CodecSetting{"step", 2.5, 1e-6, 1e6, "quantiser step where no target is given, in cm times the root of the joints"},
    CodecSetting{"shell_ratio", 1.6, 1.05, 100, "largest shell error, as a multiple of the mean joint error"},
    CodecSetting{"rate_weight", 0.18, 0, 1, "squared steps that a bit is worth when values are chosen"},
    CodecSetting{"window_s", 0, 0, 60, "length of the windows in seconds; 0: cut where it saves bits"},
    CodecSetting::whole("group_frames", 4096, 1, 1 << 20, "frames that are decoded together at least"),
};

}  // namespace

std::span<const CodecSetting> PoseSpaceCodec::settings() const {
  return pose_space_settings;
}

Bytes PoseSpaceCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  const PoseSpaceSettings settings{.rate_weight = setting(options, "rate_weight"),
                                   .window_s = setting(options, "window_s"),
                                   .group_frames = static_cast<int>(setting(options, "group_frames"))};
  PoseSpaceSearch search(clips, options.progress, settings, setting(options, "shell_ratio"), options.basis);
  const CodecTarget& target = options.target;
  if (target.mean_error_cm) return search.for_mean_error(*target.mean_error_cm);
  if (target.max_error_cm) return search.for_max_error(*target.max_error_cm);
  if (target.bytes) return search.for_bytes(*target.bytes);
  return search.at_step(setting(options, "step"));
}

// Decoding of motion-space streams.

namespace {

class PoseSpaceReader final : public ClipReader {
 public:
  PoseSpaceReader(Bitstream bits, const PoseSpaceBasis* basis)
      : ClipReader(std::move(bits), known_skeletons(basis), Length::may_be_cut_short),
        tables_(read_tables(basis)),
        layout_(lay_out(table(), tables_.coding.spectrum, tables_.group_frames)),
        synthesis_(tables_, table().skeletons.front()) {
    const auto blocks = stream().blocks("layers");
    if (blocks.size() > layer_count) {
      throw Error(ErrorKind::bad_input, {.file = stream().source(),
                                         .found = fmt::format("{} layers", blocks.size()),
                                         .expected = fmt::format("at most {}", layer_count)});
    }
    layers_.resize(layout_.groups.size());
    for (const auto block : blocks) {
      const auto parts = unpack_parts(block, layout_.groups.size(), "bytes of a group", stream().source());
      for (std::size_t g = 0; g < parts.size(); ++g) layers_[g].push_back(parts[g]);
    }
    levels_ = static_cast<int>(blocks.size());
  }

  [[nodiscard]] int levels() const override { return levels_; }

  [[nodiscard]] std::vector<Clip> decode_all(int level) const override {
    std::vector<Clip> out(clips().size());
    parallel_for(std::size_t{0}, out.size(), [&](std::size_t c) { out[c] = at_rest(c, 0, entry(c).frames); });
    parallel_for(std::size_t{0}, layout_.groups.size(), [&](std::size_t g) {
      const WindowGroup& group = layout_.groups[g];
      const GroupValues values = decode_values(g, level);
      WindowScratch scratch;
      for (std::size_t i = 0; i < group.count; ++i) {
        const auto clip = static_cast<std::size_t>(layout_.windows[group.first + i].clip);
        PoseWriter writer(tables_.reference, entry(clip).placement, out[clip]);
        write_window(values, i, group.first + i, 0, writer, scratch);
      }
    });
    return out;
  }

  // Groups are decoded and measured several at a time, and added up in their order.
  [[nodiscard]] ClipErrorSums error_of(std::span<const Clip> originals) const {
    const std::size_t at_once = 4 * tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    std::vector<ClipErrorSums> clips(originals.size());
    std::vector<std::vector<RunErrors>> measured(at_once);
    for (std::size_t from = 0; from < layout_.groups.size(); from += at_once) {
      const std::size_t to = std::min(from + at_once, layout_.groups.size());
      parallel_for(from, to, [&](std::size_t g) { measured[g - from] = group_errors(g, originals); });
      for (std::size_t g = from; g < to; ++g) {
        for (const RunErrors& run : measured[g - from]) {
          for (const JointError& joint : run.joints) clips[run.clip].add(joint);
        }
      }
    }
    ClipErrorSums out;
    for (const ClipErrorSums& clip : clips) out.add(clip);
    return out;
  }

 private:
  [[nodiscard]] Clip part(std::size_t clip, int first, int count, int level) const override {
    // From the first window that is needed to the last.
    std::size_t begin = layout_.first_of_clip[clip];
    while (layout_.windows[begin].first + layout_.windows[begin].points <= first) ++begin;
    std::size_t end = begin;
    while (end < layout_.first_of_clip[clip + 1] && layout_.windows[end].first < first + count) ++end;
    const int decoded_first = layout_.windows[begin].first;
    const WindowPlace& last = layout_.windows[end - 1];
    Clip out = at_rest(clip, decoded_first, last.first + last.points - decoded_first);
    WindowScratch scratch;
    for (std::size_t g = 0; g < layout_.groups.size(); ++g) {
      const WindowGroup& group = layout_.groups[g];
      const std::size_t from = std::max(begin, group.first);
      const std::size_t to = std::min(end, group.first + group.count);
      if (from >= to) continue;
      const GroupValues values = decode_values(g, level);
      PoseWriter writer(tables_.reference, entry(clip).placement, out);
      for (std::size_t w = from; w < to; ++w) write_window(values, w - group.first, w, decoded_first, writer, scratch);
    }
    return cut(std::move(out), first - decoded_first, count);
  }

  // Of windows of one clip that follow one another.
  struct RunErrors {
    std::size_t clip = 0;
    std::vector<JointError> joints;
  };

  [[nodiscard]] std::vector<RunErrors> group_errors(std::size_t g, std::span<const Clip> originals) const {
    const WindowGroup& group = layout_.groups[g];
    const GroupValues values = decode_values(g, -1);
    WindowScratch scratch;
    std::vector<RunErrors> out;
    for (std::size_t w = group.first; w < group.first + group.count;) {
      const auto clip = static_cast<std::size_t>(layout_.windows[w].clip);
      const std::size_t begin = w;
      while (w < group.first + group.count && layout_.windows[w].clip == layout_.windows[begin].clip) ++w;
      const int first = layout_.windows[begin].first;
      const int count = layout_.windows[w - 1].first + layout_.windows[w - 1].points - first;
      Clip decoded = at_rest(clip, first, count);
      PoseWriter writer(tables_.reference, entry(clip).placement, decoded);
      for (std::size_t i = begin; i < w; ++i) write_window(values, i - group.first, i, first, writer, scratch);
      append_joint_errors(originals[clip], decoded, first, count, 0, out.emplace_back(RunErrors{clip, {}}).joints);
    }
    return out;
  }

  struct GroupValues {
    std::vector<double> values;
    std::vector<std::size_t> offsets;
  };

  // What writing a window needs and the next window of the loop takes up again.
  struct WindowScratch {
    WindowSynthesis::Scratch synthesis;
    std::vector<double> vectors;
  };

  [[nodiscard]] static std::span<const Skeleton> known_skeletons(const PoseSpaceBasis* basis) {
    if (basis == nullptr) return {};
    return basis->skeletons();
  }

  [[nodiscard]] PoseSpaceTables read_tables(const PoseSpaceBasis* basis) const {
    const auto bytes = stream().section("tables");
    const Skeleton& skeleton = table().skeletons.front();
    if (basis == nullptr) {
      return unpack_pose_space_tables(bytes, static_cast<int>(skeleton.rotating_joints().size()), stream().source());
    }
    if (!skeleton.same_tree(basis->skeletons().front())) {
      throw Error(ErrorKind::bad_input, {.file = stream().source(),
                                         .found = "a skeleton of another tree than its basis",
                                         .expected = "the skeleton of the basis (damaged)"});
    }
    return unpack_own_tables(bytes, basis->rungs(), stream().source());
  }

  [[nodiscard]] GroupValues decode_values(std::size_t g, int level) const {
    const WindowGroup& group = layout_.groups[g];
    const auto components = static_cast<std::size_t>(tables_.basis.components);
    GroupValues out;
    for (std::size_t i = 0; i < group.count; ++i) {
      out.offsets.push_back(out.values.size());
      const auto functions = static_cast<std::size_t>(layout_.windows[group.first + i].functions);
      out.values.resize(out.values.size() + components * functions, 0.0);
    }
    std::vector<CoefficientBlock> blocks;
    for (std::size_t i = 0; i < group.count; ++i) {
      const WindowPlace& window = layout_.windows[group.first + i];
      blocks.push_back(
          {.functions = window.functions,
           .edges = window.edges,
           .follows = window.follows,
           .values =
               std::span(out.values).subspan(out.offsets[i], components * static_cast<std::size_t>(window.functions))});
    }
    const std::size_t wanted =
        level < 0 ? layers_[g].size() : std::min(layers_[g].size(), static_cast<std::size_t>(level));
    decode_group(blocks, tables_.coding, std::span(layers_[g]).first(wanted), stream().source());
    return out;
  }

  void write_window(const GroupValues& values, std::size_t in_group, std::size_t w, int decoded_first,
                    PoseWriter& writer, WindowScratch& scratch) const {
    const WindowPlace& window = layout_.windows[w];
    const auto dimensions = static_cast<std::size_t>(tables_.reference.dimensions());
    scratch.vectors.resize(dimensions * static_cast<std::size_t>(window.points));
    const std::size_t size =
        static_cast<std::size_t>(tables_.basis.components) * static_cast<std::size_t>(window.functions);
    synthesis_.synthesise(window, std::span(values.values).subspan(values.offsets[in_group], size), scratch.vectors,
                          scratch.synthesis);
    writer.write(scratch.vectors, window.first - decoded_first, window.points);
  }

  PoseSpaceTables tables_;
  WindowLayout layout_;
  WindowSynthesis synthesis_;
  std::vector<std::vector<std::span<const std::byte>>> layers_;  // [group][layer]
  int levels_ = 0;
};

}  // namespace

std::unique_ptr<StreamReader> PoseSpaceCodec::open_with(const PoseSpaceBasis* basis, Bitstream stream) const {
  stream.require_kind(stream_kind(name()));
  const std::string* wanted = stream.find_option("basis");
  if (wanted == nullptr) return std::make_unique<PoseSpaceReader>(std::move(stream), nullptr);
  if (basis == nullptr || basis->id() != *wanted) {
    throw Error(ErrorKind::usage, {.file = stream.source(),
                                   .found = basis == nullptr ? "a stream that needs the basis of a library"
                                                             : "a stream that needs another basis",
                                   .expected = "basis " + *wanted,
                                   .remedy = "name the library that it was encoded with by --basis"});
  }
  return std::make_unique<PoseSpaceReader>(std::move(stream), basis);
}

ClipErrorSums decoded_error(std::span<const std::byte> stream, std::span<const Clip> originals,
                            const PoseSpaceBasis* basis) {
  return PoseSpaceReader(Bitstream::parse(stream, "the stream"), basis).error_of(originals);
}

std::unique_ptr<StreamReader> PoseSpaceCodec::open(Bitstream stream) const {
  return open_with(nullptr, std::move(stream));
}

}  // namespace kinespace
