// What the readers of all codecs of clips are: a stream, its table of clips, ranges that are checked, several clips at a time.
// A codec adds how frames come out of its own sections.
#pragma once

#include <span>
#include <vector>

#include "kinespace/codecs/stream/clip_table.h"
#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

class ClipReader : public StreamReader {
 public:
  [[nodiscard]] const Bitstream& stream() const override { return stream_; }
  [[nodiscard]] std::span<const ClipSummary> clips() const override { return summaries_; }
  [[nodiscard]] const Skeleton& skeleton(std::size_t clip) const override;
  [[nodiscard]] Clip decode(std::size_t clip, int first, int count, int level) const override;
  [[nodiscard]] std::vector<Clip> decode_all(int level) const override;
  using StreamReader::decode;
  using StreamReader::decode_all;

 protected:
  enum class Length { whole, may_be_cut_short };

  // Unpacks the section "clips" and looks at the padding. `known`: skeletons that the table leaves out. Throws
  // Error{bad_input} for what is damaged, and for the beginning of a stream where it must be whole.
  explicit ClipReader(Bitstream stream, std::span<const Skeleton> known = {}, Length length = Length::whole);

  // Frames [first, first + count) of a clip; the range has been checked.
  [[nodiscard]] virtual Clip part(std::size_t clip, int first, int count, int level) const = 0;

  [[nodiscard]] const ClipTable& table() const { return table_; }
  [[nodiscard]] const ClipEntry& entry(std::size_t clip) const { return table_.clips[clip]; }
  // Throws Error{usage} when frames [first, first + count) of a clip are not there.
  void require_frames(std::size_t clip, int first, int count) const;
  // Those frames at rest, with a track for the travel root and the side tracks applied.
  [[nodiscard]] Clip at_rest(std::size_t clip, int first, int count) const;

 private:
  Bitstream stream_;
  ClipTable table_;
  std::vector<ClipSummary> summaries_;
};

// Frames [first, first + count) of a clip, which is moved where they are all of it.
[[nodiscard]] Clip cut(Clip clip, int first, int count);

}  // namespace kinespace
