#include "kinespace/codecs/baselines/detail/channel_stream.h"

#include <algorithm>

#include "kinespace/entropy/integer_coder.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

constexpr int largest_shift = 48;    // of reconstruction points, in 1/64 steps
constexpr int largest_weight = 120;  // 2^30

// Weights and reconstruction points: most of them like the ones before.
Bytes pack_numbers(const ChannelTables& tables) {
  IntegerWriter out;
  int last = 0;
  for (const int w : tables.weights) {
    out.put(w - last, 0);
    last = w;
  }
  for (const auto& row : tables.coding.points.shift) {
    for (std::size_t m = 0; m < row.size(); ++m) out.put(row[m], 1 + static_cast<int>(m));
  }
  return std::move(out).finish();
}

void unpack_numbers(std::span<const std::byte> bytes, int weights, ChannelTables& tables, const std::string& source) {
  IntegerReader in(bytes, source);
  std::int64_t last = 0;
  for (int c = 0; c < weights; ++c) {
    last += in.get(0);
    if (last < -largest_weight || last > largest_weight) in.damaged();
    tables.weights.push_back(static_cast<int>(last));
  }
  for (auto& row : tables.coding.points.shift) {
    for (std::size_t m = 0; m < row.size(); ++m) {
      row[m] = static_cast<std::int8_t>(in.get_between(-largest_shift, largest_shift, 1 + static_cast<int>(m)));
    }
  }
  in.expect_end();
}

}  // namespace

std::vector<PiecePlace> lay_out_pieces(const ClipTable& clips) {
  std::vector<PiecePlace> out;
  for (std::size_t c = 0; c < clips.clips.size(); ++c) {
    const std::int64_t frames = clips.clips[c].frames;
    const std::int64_t pieces = (frames + longest_piece - 1) / longest_piece;
    for (std::int64_t p = 0; p < pieces; ++p) {
      const std::int64_t first = frames * p / pieces, end = frames * (p + 1) / pieces;
      out.push_back({static_cast<int>(c), static_cast<int>(first), static_cast<int>(end - first)});
    }
  }
  return out;
}

double ChannelTables::weight(int channel) const {
  return weights.empty() ? 1 : grid_step(steps_per_octave / 4 * weights[static_cast<std::size_t>(channel)]);
}

Bytes pack_channel_tables(const ChannelTables& tables) {
  ByteWriter out;
  put_part(out, pack_layout(tables.layout));
  put_part(out, pack_numbers(tables));
  put_varint(out, static_cast<std::uint64_t>(tables.coding.spectrum.components));
  put_part(out, pack_spectrum(tables.coding.spectrum));
  put_part(out, pack_start(tables.coding.start));
  return std::move(out).take();
}

ChannelTables unpack_channel_tables(std::span<const std::byte> bytes, const Skeleton& skeleton, bool weighted,
                                    const std::string& source) {
  ByteReader in(bytes, source);
  ChannelTables out;
  out.layout = unpack_layout(get_part(in, "bytes of a part"), skeleton, source);
  const int channels = out.layout.channel_count();
  unpack_numbers(get_part(in, "bytes of a part"), weighted ? channels : 0, out, source);
  const std::uint64_t components = get_varint(in);
  if (components > static_cast<std::uint64_t>(channels)) {
    in.fail(std::to_string(components) + " components", "at most as many as channels (damaged)");
  }
  out.coding.spectrum = unpack_spectrum(get_part(in, "bytes of a part"), static_cast<int>(components), source);
  out.coding.start = unpack_start(get_part(in, "bytes of a part"), source);
  in.expect_end();
  return out;
}

Bytes pack_piece(const PieceCode& piece) {
  ByteWriter out;
  put_signed_varint(out, piece.step_index);
  put_part(out, piece.side);
  for (const Bytes& layer : piece.layers) put_part(out, layer);
  return std::move(out).take();
}

PieceView view_piece(std::span<const std::byte> bytes, const std::string& source) {
  ByteReader in(bytes, source);
  PieceView out;
  const std::int64_t index = get_signed_varint(in);
  if (index < -largest_step_index || index > largest_step_index)
    in.fail("a quantiser step out of range", "2^-32 to 2^32");
  out.step = grid_step(static_cast<int>(index));
  out.side = get_part(in, "bytes of a part");
  for (int layer = 0; layer < layer_count; ++layer) out.layers.push_back(get_part(in, "bytes of a part"));
  in.expect_end();
  return out;
}

PieceShape coded_shape(PieceShape shape, const Spectrum& spectrum) {
  shape.functions = spectrum.functions_used(shape.edges);
  for (int& edge : shape.edges) edge = std::min(edge, shape.functions);
  return shape;
}

}  // namespace kinespace
