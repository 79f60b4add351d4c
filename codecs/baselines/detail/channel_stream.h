// The stream of the codecs that code channels as transform coefficients (channel_codec.h):
//
//   clips    names, skeletons, rates, lengths, side tracks (codecs/stream/clip_table.h)
//   tables   which channels the joints have (codecs/stream/joint_channels.h); weights of the channels, where the transform has
//            them; where the coefficient coder starts (entropy/coefficient_coder.h)
//   pieces   the length of each piece's code, then the codes: the quantiser's step, what the transform wants to know,
//            and the coefficients. A piece is a whole clip; longer clips are cut evenly into pieces
//
// Private to this folder.
#pragma once

#include <string>
#include <vector>

#include "kinespace/codecs/baselines/detail/channel_transform.h"
#include "kinespace/codecs/stream/clip_table.h"
#include "kinespace/codecs/stream/joint_channels.h"

namespace kinespace {

inline constexpr int longest_piece = 16384;  // frames

struct PiecePlace {
  int clip = 0;
  int first = 0;
  int frames = 0;
};
// The pieces of all clips, clip by clip.
[[nodiscard]] std::vector<PiecePlace> lay_out_pieces(const ClipTable& clips);

struct ChannelTables {
  ChannelLayout layout;
  std::vector<int> weights;  // by channel: log2 of the weight, in quarters; empty: all 1
  CoefficientTables coding;

  [[nodiscard]] double weight(int channel) const;
};

[[nodiscard]] Bytes pack_channel_tables(const ChannelTables& tables);
// Throws Error{bad_input} naming `source`.
[[nodiscard]] ChannelTables unpack_channel_tables(std::span<const std::byte> bytes, const Skeleton& skeleton,
                                                  bool weighted, const std::string& source);

// One piece as bytes, and in parts.
struct PieceCode {
  int step_index = 0;
  Bytes side;
  std::vector<Bytes> layers;
};
[[nodiscard]] Bytes pack_piece(const PieceCode& piece);
struct PieceView {
  double step = 0;
  std::span<const std::byte> side;
  std::vector<std::span<const std::byte>> layers;
};
[[nodiscard]] PieceView view_piece(std::span<const std::byte> bytes, const std::string& source);

// The shape as it is coded: without the functions beyond the last band that the spectrum fills.
[[nodiscard]] PieceShape coded_shape(PieceShape shape, const Spectrum& spectrum);

}  // namespace kinespace
