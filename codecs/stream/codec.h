// What every codec of clips does: clips to a stream, a stream to clips.
//
// A stream is a Bitstream (storage/bitstream.h) whose kind is "codec:" and the codec's name; it says in its header how
// far its clips are from what was encoded (measured on the decoded clips, never estimated). A codec is driven by its
// own settings or by a target that it then meets. A decoded clip is a full clip: name, rate, skeleton, root, rotations,
// and the translations of joints that move.
//
//   const Bytes stream = encode("motion-space", clips, {.target = {.mean_error_cm = 0.5}});   // codecs/registry.h
//   const auto reader = open_stream(stream, "dance.ksm");
//   const Clip clip = reader->decode(0);
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/base/progress.h"
#include "kinespace/motion/clip.h"
#include "kinespace/storage/bitstream.h"
#include "kinespace/storage/payload_version.h"

namespace kinespace {

// What the stream must keep to. At most one; none: the codec's settings decide.
struct CodecTarget {
  std::optional<double> mean_error_cm;  // of joint positions over all joints and frames of all clips, > 0
  std::optional<double> max_error_cm;   // no joint in any frame farther off than this, > 0
  std::optional<std::int64_t> bytes;    // of the whole stream, > 0

  [[nodiscard]] bool any() const { return mean_error_cm || max_error_cm || bytes; }
  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// Throws the Error{usage} of a codec that cannot keep to its target: "a target that cannot be met: FOUND, expected
// EXPECTED".
[[noreturn]] void cannot_meet(const std::string& found, std::string expected);
[[noreturn]] void cannot_meet(const CodecTarget& target);

// What a codec can be set by: a number, a whole number, on or off, or one of a few words.
struct CodecSetting {
  enum class Kind : std::uint8_t { number, whole, flag, choice };

  std::string_view name;
  double initial = 0;
  double least = 0;
  double most = 0;
  std::string_view meaning;  // with its unit
  Kind kind = Kind::number;
  std::array<std::string_view, 3> words = {};  // of a choice, by its number

  static constexpr CodecSetting whole(std::string_view name, int initial, int least, int most,
                                      std::string_view meaning) {
    return {name,       static_cast<double>(initial), static_cast<double>(least), static_cast<double>(most), meaning,
            Kind::whole};
  }
  static constexpr CodecSetting flag(std::string_view name, bool initial, std::string_view meaning) {
    return {name, initial ? 1.0 : 0.0, 0, 1, meaning, Kind::flag, {"off", "on"}};
  }
  // Of two words, the first when nothing is set.
  static constexpr CodecSetting choice(std::string_view name, std::string_view first, std::string_view second,
                                       std::string_view meaning) {
    return {name, 0, 0, 1, meaning, Kind::choice, {first, second}};
  }

  [[nodiscard]] bool allows(double value) const;
  // A value as a user writes it, and what may be written: "on", "0.5 to 100", "default or paper".
  [[nodiscard]] std::string text(double value) const;
  [[nodiscard]] std::string range() const;
  // The value that is written so; also numbers of words. Throws Error{usage} naming setting, text and range.
  [[nodiscard]] double parse(std::string_view text) const;
};

// The kind of a codec's streams; of none, what all of them begin with.
[[nodiscard]] std::string stream_kind(std::string_view codec);

class PoseSpaceBasis;

struct CodecOptions {
  CodecTarget target;
  // Tables that the reader has too (codecs/pose_space/pose_space_basis.h), for codecs that take them; nullptr: none.
  const PoseSpaceBasis* basis = nullptr;
  std::map<std::string, double, std::less<>> settings;  // by CodecSetting::name; the rest are as they are
  Progress progress;
};

// A clip of a stream, before it is decoded.
struct ClipSummary {
  std::string name;
  double rate_hz = 0;
  int frames = 0;
};

// An open stream. Decoding is safe from several threads, and gives the same bits whatever their number.
class StreamReader {
 public:
  virtual ~StreamReader() = default;
  StreamReader() = default;
  StreamReader(const StreamReader&) = delete;
  StreamReader& operator=(const StreamReader&) = delete;

  [[nodiscard]] virtual const Bitstream& stream() const = 0;
  [[nodiscard]] virtual std::span<const ClipSummary> clips() const = 0;
  // The skeleton of a clip.
  [[nodiscard]] virtual const Skeleton& skeleton(std::size_t clip) const = 0;
  // How many levels of detail there are to decode, of those that the stream was made with: a stream that was cut short
  // has fewer. Codecs that know no levels have one.
  [[nodiscard]] virtual int levels() const { return 1; }

  // Frames [first, first + count) of a clip, with the first `level` levels (all when < 0). Throws Error{usage} for what
  // is not there, Error{bad_input} when the stream is damaged.
  [[nodiscard]] virtual Clip decode(std::size_t clip, int first, int count, int level) const = 0;
  // All clips, several at a time.
  [[nodiscard]] virtual std::vector<Clip> decode_all(int level) const = 0;

  // Whether one joint can be decoded from its own bytes alone.
  [[nodiscard]] virtual bool decodes_joints() const { return false; }
  // Frames [first, first + count) of one joint (an index of skeleton(clip)): a clip in which the others keep their rest
  // pose, but for those above the travel root. Throws Error{usage} when the codec cannot, or there is no such joint.
  [[nodiscard]] virtual Clip decode_joint(std::size_t clip, int joint, int first, int count) const;
  // The frames that can be shown without decoding what lies between them, ascending; empty when there are none.
  [[nodiscard]] virtual std::vector<int> preview_frames(std::size_t /*clip*/) const { return {}; }
  // Those frames as a clip. Throws Error{usage} when there are none.
  [[nodiscard]] virtual Clip decode_preview(std::size_t clip) const;

  [[nodiscard]] Clip decode(std::size_t clip, int level = -1) const {
    return decode(clip, 0, clips()[clip].frames, level);
  }
  [[nodiscard]] std::vector<Clip> decode_all() const { return decode_all(-1); }
  // Throws Error{usage} when there is no clip of that name.
  [[nodiscard]] std::size_t find(std::string_view name) const;
};

class Codec {
 public:
  virtual ~Codec() = default;
  Codec() = default;
  Codec(const Codec&) = delete;
  Codec& operator=(const Codec&) = delete;

  [[nodiscard]] virtual std::string_view name() const = 0;
  [[nodiscard]] virtual std::span<const CodecSetting> settings() const = 0;
  // Those of its streams that this build reads.
  [[nodiscard]] virtual std::span<const PayloadVersion> versions() const { return first_payload; }
  // Whether CodecOptions::basis may be given.
  [[nodiscard]] virtual bool takes_basis() const { return false; }
  // Options have been checked. Throws Error{usage} when the target cannot be met, Error{bad_input} for clips that
  // cannot be encoded (no frames, values that are no numbers).
  [[nodiscard]] virtual Bytes encode(std::span<const Clip> clips, const CodecOptions& options) const = 0;
  // The stream's bytes must outlive the reader.
  [[nodiscard]] virtual std::unique_ptr<StreamReader> open(Bitstream stream) const = 0;
  // The same with the tables that a stream may leave out, for codecs that take them; nullptr: none.
  [[nodiscard]] virtual std::unique_ptr<StreamReader> open_with(const PoseSpaceBasis* /*basis*/,
                                                                Bitstream stream) const {
    return open(std::move(stream));
  }

 protected:
  // The value of one of settings(); of a flag, whether it is on.
  [[nodiscard]] double setting(const CodecOptions& options, std::string_view name) const;
  [[nodiscard]] bool flag(const CodecOptions& options, std::string_view name) const;
};

}  // namespace kinespace
