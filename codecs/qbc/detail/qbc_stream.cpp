#include "kinespace/codecs/qbc/detail/qbc_stream.h"

#include <bit>
#include <cmath>

#include "kinespace/entropy/integer_coder.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

// Contexts of entropy/integer_coder.h.
enum CurveNumber : int { interval_number, unit_flag, step_number, finer_number, grid_number, size_number };

constexpr int coarsest_grid_log = 5;
constexpr std::int64_t largest_curve = std::int64_t{1} << 34;

void put_float(IntegerWriter& out, float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  for (int shift = 0; shift < 32; shift += 8) out.put_byte(static_cast<std::uint8_t>(bits >> shift), 0);
}

float get_float(IntegerReader& in) {
  std::uint32_t bits = 0;
  for (int shift = 0; shift < 32; shift += 8) bits |= static_cast<std::uint32_t>(in.get_byte(0)) << shift;
  return std::bit_cast<float>(bits);
}

Bytes pack_table(const QbcTables& tables, std::span<const QbcCurve> curves) {
  IntegerWriter out;
  out.put(tables.interval, interval_number);
  out.put(tables.step_index, step_number);
  const bool usual = tables.root_unit == QbcTables{}.root_unit;
  out.put(usual ? 0 : 1, unit_flag);
  if (!usual) put_float(out, tables.root_unit);
  for (const QbcCurve& curve : curves) {
    out.put(curve.finer, finer_number);
    out.put(curve.grid_log - 1, grid_number);
    out.put(static_cast<std::int64_t>(curve.code.size()), size_number);
  }
  return std::move(out).finish();
}

QbcTables get_tables(IntegerReader& in) {
  QbcTables out;
  out.interval = static_cast<int>(in.get_between(1, longest_segment, interval_number));
  out.step_index = static_cast<int>(in.get_between(-QbcTables::finest, QbcTables::finest, step_number));
  if (in.get_between(0, 1, unit_flag) == 1) out.root_unit = get_float(in);
  if (!(out.root_unit >= 1e-4F && out.root_unit <= 1e4F)) in.damaged();
  return out;
}

}  // namespace

Bytes pack_curves(const QbcTables& tables, const ChannelLayout& layout, std::span<const QbcCurve> curves) {
  ByteWriter out;
  const auto put = [&](const Bytes& bytes) {
    put_varint(out, bytes.size());
    out.put_bytes(bytes);
  };
  put(pack_layout(layout));
  put(pack_table(tables, curves));
  for (const QbcCurve& curve : curves) out.put_bytes(curve.code);
  return std::move(out).take();
}

QbcCurves unpack_curves(std::span<const std::byte> bytes, const ClipTable& clips, const std::string& source) {
  ByteReader in(bytes, source);
  const auto take = [&](const char* what) { return in.take(get_count(in, 1, what)); };
  QbcCurves out;
  out.layout = unpack_layout(take("bytes of channels"), clips.skeletons.front(), source);
  const auto table = take("bytes of a table");
  IntegerReader numbers(table, source);
  out.tables = get_tables(numbers);
  std::vector<std::size_t> sizes;
  for (std::size_t c = 0; c < clips.clips.size(); ++c) {
    for (std::size_t j = 0; j < out.layout.joints.size(); ++j) {
      QbcCurveView curve;
      std::size_t size = 0;
      if (curve_dimensions(out.layout, j) > 0) {
        curve.finer = static_cast<int>(numbers.get_between(-QbcTables::finest, QbcTables::finest, finer_number));
        curve.grid_log = 1 + static_cast<int>(numbers.get_between(-1, coarsest_grid_log - 1, grid_number));
        size = static_cast<std::size_t>(numbers.get_between(0, largest_curve, size_number));
      }
      out.curves.push_back(curve);
      sizes.push_back(size);
    }
  }
  numbers.expect_end();
  for (std::size_t i = 0; i < sizes.size(); ++i) out.curves[i].code = in.take(sizes[i]);
  in.expect_end();
  return out;
}

}  // namespace kinespace
