// The codecs over channels: how they meet a target, and how their streams are decoded.
#include "kinespace/codecs/baselines/channel_codec.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/baselines/detail/channel_encoder.h"
#include "kinespace/codecs/baselines/detail/channel_stream.h"
#include "kinespace/codecs/stream/clip_reader.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/joint_channels.h"
#include "kinespace/codecs/stream/measured_stream.h"
#include "kinespace/codecs/stream/target_search.h"

namespace kinespace {
namespace {

// Small errors want joints held to their turns more closely.
ChannelSearch search_for(const CodecTarget& target) {
  ChannelSearch out;
  const double error = target.mean_error_cm  ? *target.mean_error_cm
                       : target.max_error_cm ? *target.max_error_cm / 4
                                             : 1;
  out.tolerance_degrees = std::clamp(0.05 * error, 1e-5, out.tolerance_degrees);
  return out;
}

// About the error that may be expected, in cm.
SearchRange range_for(const CodecTarget& target) {
  SearchRange out{.start = 1, .least = 1e-7, .most = 1e6, .rounds = 12};
  if (target.mean_error_cm) out.start = *target.mean_error_cm;
  if (target.max_error_cm) out.start = *target.max_error_cm / 6;
  out.start = std::clamp(out.start, 10 * out.least, out.most / 10);
  return out;
}

}  // namespace

std::string_view ChannelCodec::name() const {
  return transform_.name();
}

std::span<const CodecSetting> ChannelCodec::settings() const {
  return transform_.settings();
}

Bytes ChannelCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  ChannelEncoder encoder(transform_, clips, search_for(options.target), options.progress);
  const double step = setting(options, "step");
  const double rate_weight = setting(options, "rate_weight");
  if (options.target.any()) {
    return search_target(options.target, range_for(options.target), [&](double tolerance) {
      return encoder.encode({.tolerance = tolerance, .step = step}, rate_weight);
    });
  }
  return encoder.encode({.amount = setting(options, settings().front().name), .step = step}, rate_weight).stream;
}

// Decoding of streams of channel_codec.h.

namespace {

class ChannelReader final : public ClipReader {
 public:
  ChannelReader(const ChannelTransform& transform, Bitstream bits)
      : ClipReader(std::move(bits)),
        transform_(transform),
        tables_(unpack_channel_tables(stream().section("tables"), table().skeletons.front(), transform.weighted(),
                                      stream().source())),
        places_(lay_out_pieces(table())),
        pieces_(unpack_parts(stream().section("pieces"), places_.size(), "bytes of a piece", stream().source())) {
    for (std::size_t p = 0; p < places_.size(); ++p) {
      if (places_[p].first == 0) first_piece_.push_back(p);
    }
    first_piece_.push_back(places_.size());
  }

 private:
  [[nodiscard]] Clip part(std::size_t clip, int first, int count, int /*level*/) const override {
    std::size_t begin = first_piece_[clip];
    while (places_[begin].first + places_[begin].frames <= first) ++begin;
    std::size_t end = begin;
    while (end < first_piece_[clip + 1] && places_[end].first < first + count) ++end;
    const int decoded_first = places_[begin].first;
    const int decoded = places_[end - 1].first + places_[end - 1].frames - decoded_first;
    Clip out = at_rest(clip, decoded_first, decoded);
    for (std::size_t p = begin; p < end; ++p) write_piece(p, decoded_first, out);
    return cut(std::move(out), first - decoded_first, count);
  }

  void write_piece(std::size_t p, int decoded_first, Clip& out) const {
    const PiecePlace& place = places_[p];
    const PieceView code = view_piece(pieces_[p], stream().source());
    const int channels = tables_.layout.channel_count();
    const PieceShape whole = transform_.shape(channels, place.frames, out.rate_hz, code.side, stream().source());
    const int components = tables_.coding.spectrum.components;
    if (whole.components > components) damaged("more components in a piece than in the tables");
    const PieceShape shape = coded_shape(whole, tables_.coding.spectrum);
    std::vector<double> coefficients(static_cast<std::size_t>(components) * static_cast<std::size_t>(shape.functions),
                                     0.0);
    CoefficientBlock block{.functions = shape.functions, .edges = shape.edges, .values = coefficients};
    decode_group(std::span(&block, 1), tables_.coding, code.layers, stream().source());
    for (double& c : coefficients) c *= code.step;
    std::vector<double> values(static_cast<std::size_t>(channels) * static_cast<std::size_t>(place.frames), 0.0);
    transform_.synthesise(shape, code.side, coefficients, place.frames, code.step, values, stream().source());
    for (int c = 0; c < channels; ++c) {
      const double scale = 1 / tables_.weight(c);
      const auto n = static_cast<std::size_t>(place.frames);
      for (double& v : std::span(values).subspan(static_cast<std::size_t>(c) * n, n)) {
        v *= scale;
        if (!(std::abs(v) < 2 * largest_channel_value)) damaged("channels that are no numbers or huge");
      }
    }
    write_channels(tables_.layout, values, place.first - decoded_first, place.frames, out);
  }

  [[noreturn]] void damaged(std::string found) const {
    throw Error(
        ErrorKind::bad_input,
        {.file = stream().source(), .found = std::move(found), .expected = "what the encoder writes (damaged)"});
  }

  const ChannelTransform& transform_;
  ChannelTables tables_;
  std::vector<PiecePlace> places_;
  std::vector<std::span<const std::byte>> pieces_;
  std::vector<std::size_t> first_piece_;  // by clip, and the end
};

}  // namespace

std::unique_ptr<StreamReader> open_channel_stream(const ChannelTransform& transform, Bitstream stream) {
  return std::make_unique<ChannelReader>(transform, std::move(stream));
}

std::unique_ptr<StreamReader> ChannelCodec::open(Bitstream stream) const {
  stream.require_kind(stream_kind(name()));
  return open_channel_stream(transform_, std::move(stream));
}

}  // namespace kinespace
