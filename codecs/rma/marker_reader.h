// What readers of streams of whole clips share: the table of clips, ranges, several clips at a time. A part of a clip
// is cut from the whole clip: contacts and seams reach over it.
#pragma once

#include <memory>
#include <vector>

#include "kinespace/codecs/stream/clip_table.h"
#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

class MarkerReader : public StreamReader {
 public:
  explicit MarkerReader(Bitstream stream);

  [[nodiscard]] const Bitstream& stream() const override { return stream_; }
  [[nodiscard]] std::span<const ClipSummary> clips() const override { return summaries_; }
  [[nodiscard]] const Skeleton& skeleton(std::size_t clip) const override;
  [[nodiscard]] Clip decode(std::size_t clip, int first, int count, int level) const override;
  [[nodiscard]] std::vector<Clip> decode_all(int level) const override;
  using StreamReader::decode;
  using StreamReader::decode_all;

 protected:
  [[nodiscard]] const ClipTable& table() const { return table_; }
  [[nodiscard]] int dimensions() const;  // of markers
  [[nodiscard]] virtual Clip whole(std::size_t clip) const = 0;

 private:
  Bitstream stream_;
  ClipTable table_;
  std::vector<ClipSummary> summaries_;
};

// No more frames are believed than would fit this.
[[nodiscard]] std::int64_t most_frames(std::size_t bytes);
// Makes a stream that says much in few bytes as long as a reader wants it for that.
void add_padding(BitstreamWriter& out, std::size_t bytes, std::int64_t frames, std::int64_t numbers);

}  // namespace kinespace
