// The encoder of the codecs over channels (channel_codec.h), in steps that a search for a target repeats.
// Private to this folder.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/codecs/baselines/detail/channel_stream.h"
#include "kinespace/codecs/baselines/detail/channel_transform.h"
#include "kinespace/codecs/stream/measured_stream.h"

namespace kinespace {

class ChannelEncoder {
 public:
  // `search` says how closely joints must keep to fewer turns than three. The clips and the transform must outlive it.
  // Throws Error as Codec::encode does.
  ChannelEncoder(const ChannelTransform& transform, std::span<const Clip> clips, const ChannelSearch& search,
                 const Progress& progress);

  [[nodiscard]] CodedAttempt encode(const Quality& quality, double rate_weight);

 private:
  struct Coded;
  void prepare(const ChannelSearch& search);
  void weigh(std::vector<ChannelPiece>& pieces);
  void code(Coded& coded, double rate_weight) const;
  [[nodiscard]] Bytes write(const Coded& coded, const MeasuredError& error) const;

  const ChannelTransform& transform_;
  std::span<const Clip> clips_;
  const Progress& progress_;
  ClipTable table_;
  Bytes packed_clips_;
  std::vector<PiecePlace> places_;
  ChannelTables tables_;  // layout and weights
  std::vector<ChannelPiece> pieces_;
  std::vector<std::unique_ptr<PieceAnalysis>> analyses_;
};

}  // namespace kinespace
