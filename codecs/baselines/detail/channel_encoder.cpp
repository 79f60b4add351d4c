#include "kinespace/codecs/baselines/detail/channel_encoder.h"

#include <algorithm>
#include <cmath>

#include "kinespace/base/parallel.h"
#include "kinespace/codecs/baselines/channel_codec.h"
#include "kinespace/codecs/baselines/detail/channel_metric.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/joint_channels.h"
#include "kinespace/codecs/stream/measured_stream.h"

namespace kinespace {
namespace {

constexpr std::int64_t few_frames = 30000;  // streams so short may be better off without learned starts
constexpr int quarters_per_octave = 4;

// Of channels that move nothing.
constexpr double lightest_weight = 1e-3;

// What plain rounding would give, which is where the spectrum starts from.
void add_plain(const PieceCoefficients& piece, int components, CodingStatistics& sums) {
  sums.magnitude.resize(static_cast<std::size_t>(components) * band_count);
  sums.coefficients.resize(sums.magnitude.size());
  const PieceShape& shape = piece.shape;
  for (int c = 0; c < components; ++c) {
    for (std::size_t band = 0; band < band_count; ++band) {
      const std::size_t cell = static_cast<std::size_t>(c) * band_count + band;
      sums.coefficients[cell] += shape.edges[band + 1] - shape.edges[band];
      if (c >= shape.components) continue;
      const double* row = piece.values.data() + static_cast<std::ptrdiff_t>(c) * shape.functions;
      for (int k = shape.edges[band]; k < shape.edges[band + 1]; ++k) {
        sums.magnitude[cell] += std::floor(std::abs(row[k]) + 0.5);
      }
    }
  }
}

Spectrum spectrum_of(const CodingStatistics& statistics, int components) {
  Spectrum out{.components = components, .level = {}};
  for (std::size_t i = 0; i < static_cast<std::size_t>(components) * band_count; ++i) {
    const double count = statistics.coefficients[i];
    out.level.push_back(count > 0 ? Spectrum::level_of(statistics.magnitude[i] / count) : std::uint8_t{0});
  }
  return out;
}

std::size_t size_of(const std::vector<PieceCode>& pieces) {
  std::size_t out = 0;
  for (const PieceCode& piece : pieces) {
    for (const Bytes& layer : piece.layers) out += layer.size();
  }
  return out;
}

}  // namespace

struct ChannelEncoder::Coded {
  ChannelTables tables;
  std::vector<PieceCoefficients> coefficients;
  std::vector<PieceCode> pieces;
  CodingStatistics statistics;
};

ChannelEncoder::ChannelEncoder(const ChannelTransform& transform, std::span<const Clip> clips,
                               const ChannelSearch& search, const Progress& progress)
    : transform_(transform),
      clips_(clips),
      progress_(progress),
      table_(clip_table_of(clips)),
      packed_clips_(pack_clip_table(table_)) {
  prepare(search);
}

void ChannelEncoder::prepare(const ChannelSearch& search) {
  tables_.layout = find_channel_layout(clips_, search);
  places_ = lay_out_pieces(table_);
  std::vector<std::size_t> first_piece;
  for (std::size_t p = 0; p < places_.size(); ++p) {
    if (places_[p].first == 0) first_piece.push_back(p);
  }
  first_piece.push_back(places_.size());
  const int channels = tables_.layout.channel_count();
  pieces_.resize(places_.size());
  parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
    progress_.check_stop();
    const Clip& clip = clips_[c];
    const ChannelCurves curves = channel_curves(clip, tables_.layout);
    require_channels_below(largest_channel_value, curves, clip.name);
    const Eigen::MatrixXd metric = channel_metric(clip, tables_.layout, curves);
    for (std::size_t p = first_piece[c]; p < first_piece[c + 1]; ++p) {
      ChannelPiece& piece = pieces_[p];
      piece = {
          .channels = channels, .frames = places_[p].frames, .rate_hz = clip.rate_hz, .values = {}, .metric = metric};
      for (int k = 0; k < channels; ++k) {
        const auto part = curves.channel(k).subspan(static_cast<std::size_t>(places_[p].first),
                                                    static_cast<std::size_t>(places_[p].frames));
        piece.values.insert(piece.values.end(), part.begin(), part.end());
      }
    }
  });
  if (transform_.weighted()) weigh(pieces_);
  analyses_.resize(pieces_.size());
  parallel_for(std::size_t{0}, pieces_.size(), [&](std::size_t p) { analyses_[p] = transform_.analyse(pieces_[p]); });
}

// Scales every channel by how far it moves the body, on the average over the clips.
void ChannelEncoder::weigh(std::vector<ChannelPiece>& pieces) {
  Eigen::MatrixXd metric = Eigen::MatrixXd::Zero(pieces.front().channels, pieces.front().channels);
  double frames = 0;
  for (const ChannelPiece& piece : pieces) {
    metric += piece.frames * piece.metric;
    frames += piece.frames;
  }
  Eigen::VectorXd weights(metric.rows());
  for (Eigen::Index c = 0; c < metric.rows(); ++c) {
    const double moves = std::max(std::sqrt(metric(c, c) / frames), lightest_weight);
    tables_.weights.push_back(static_cast<int>(std::lround(quarters_per_octave * std::log2(moves))));
    weights[c] = tables_.weight(static_cast<int>(c));
  }
  for (ChannelPiece& piece : pieces) {
    for (std::size_t i = 0; i < piece.values.size(); ++i) {
      piece.values[i] *= weights[static_cast<Eigen::Index>(i / static_cast<std::size_t>(piece.frames))];
    }
    piece.metric = weights.cwiseInverse().asDiagonal() * piece.metric * weights.cwiseInverse().asDiagonal();
  }
}

void ChannelEncoder::code(Coded& coded, double rate_weight) const {
  const CoefficientTables& coding = coded.tables.coding;
  coded.pieces.resize(pieces_.size());
  std::vector<CodingStatistics> statistics(pieces_.size());
  parallel_for(std::size_t{0}, pieces_.size(), [&](std::size_t p) {
    const PieceCoefficients& from = coded.coefficients[p];
    const PieceShape shape = coded_shape(from.shape, coding.spectrum);
    const auto used = static_cast<std::size_t>(shape.functions);
    std::vector<double> wanted(static_cast<std::size_t>(coding.spectrum.components) * used, 0.0);
    for (std::size_t c = 0; c < static_cast<std::size_t>(shape.components); ++c) {
      std::copy_n(from.values.begin() + static_cast<std::ptrdiff_t>(c) * from.shape.functions, used,
                  wanted.begin() + static_cast<std::ptrdiff_t>(c * used));
    }
    std::vector<double> values(wanted.size(), 0.0);
    CoefficientBlock block{.functions = shape.functions, .edges = shape.edges, .wanted = wanted, .values = values};
    coded.pieces[p] = {.step_index = from.step_index, .side = from.side, .layers = {}};
    coded.pieces[p].layers = encode_group(std::span(&block, 1), coding, rate_weight, statistics[p]);
  });
  coded.statistics = {};
  for (const CodingStatistics& one : statistics) coded.statistics.add(one);
}

CodedAttempt ChannelEncoder::encode(const Quality& quality, double rate_weight) {
  Coded coded{.tables = tables_, .coefficients = {}, .pieces = {}, .statistics = {}};
  coded.coefficients.resize(pieces_.size());
  parallel_for(std::size_t{0}, pieces_.size(), [&](std::size_t p) {
    progress_.check_stop();
    coded.coefficients[p] = analyses_[p]->at(quality);
  });
  int components = 0;
  for (const PieceCoefficients& piece : coded.coefficients) components = std::max(components, piece.shape.components);
  CodingStatistics plain;
  plain.magnitude.resize(static_cast<std::size_t>(components) * band_count);
  plain.coefficients.resize(plain.magnitude.size());
  for (const PieceCoefficients& piece : coded.coefficients) add_plain(piece, components, plain);

  CoefficientTables& coding = coded.tables.coding;
  coding.spectrum = spectrum_of(plain, components);
  code(coded, rate_weight);
  // Once more with what was learned; of a short stream, without the learned start if that takes less.
  if (rate_weight > 0) coding.spectrum = spectrum_of(coded.statistics, components);
  coding.points = coded.statistics.reconstruction();
  const LearnedStart learned = coded.statistics.counts.learn();
  if (table_.frames() < few_frames) {
    code(coded, rate_weight);
    const std::size_t plain_size = size_of(coded.pieces);
    Coded other = coded;
    other.tables.coding.start = learned;
    code(other, rate_weight);
    if (size_of(other.pieces) + pack_start(learned).size() < plain_size) coded = std::move(other);
  } else {
    coding.start = learned;
    code(coded, rate_weight);
  }
  return write_measured(
      clips_, [&](const MeasuredError& error) { return write(coded, error); },
      [&](Bitstream stream) { return open_channel_stream(transform_, std::move(stream)); });
}

Bytes ChannelEncoder::write(const Coded& coded, const MeasuredError& error) const {
  BitstreamWriter out(stream_kind(transform_.name()));
  out.set_error(error);
  Bytes tables = pack_channel_tables(coded.tables);
  std::vector<Bytes> codes;
  for (const PieceCode& piece : coded.pieces) codes.push_back(pack_piece(piece));
  Bytes pieces = pack_parts(codes);
  const std::size_t size = packed_clips_.size() + tables.size() + pieces.size();
  out.add_section("clips", packed_clips_);
  out.add_section("tables", std::move(tables));
  out.add_section("pieces", std::move(pieces));
  add_padding(out, size, table_.frames());
  return out.finish();
}

}  // namespace kinespace
