#include "kinespace/codecs/rma/detail/window_prediction.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kinespace/codecs/rma/detail/spline_fit.h"
#include "kinespace/codecs/stream/natural_functions.h"

namespace kinespace {
namespace {

enum Context : int { used_bit, clip_number, turn_number, start_frame, frame_move };

// Without its mean.
void centre(std::span<double> curve) {
  double sum = 0;
  for (const double v : curve) sum += v;
  const double mean = sum / static_cast<double>(curve.size());
  for (double& v : curve) v -= mean;
}

}  // namespace

int WindowPrediction::first_frame() const {
  return *std::ranges::min_element(frames);
}

int WindowPrediction::last_frame() const {
  return *std::ranges::max_element(frames);
}

int prediction_span(double rate_hz) {
  return static_cast<int>(std::clamp(std::round(WindowPrediction::knot_span * rate_hz / 120), 4.0, 512.0));
}

void predict_window(const WindowPrediction& prediction, int points, int span, std::span<const double> reference,
                    int first, int count, std::span<double> out) {
  const std::vector<int> knots = regular_knots(points, span);
  const auto n = static_cast<std::size_t>(points);
  const auto width = static_cast<std::size_t>(count);
  const std::size_t dimensions = out.size() / n;
  std::size_t piece = 0;
  for (std::size_t f = 0; f < n; ++f) {
    while (piece + 2 < knots.size() && knots[piece + 1] <= static_cast<int>(f)) ++piece;
    double at = prediction.frames[piece] - first;
    if (knots.size() > 1) {
      const double part = static_cast<double>(static_cast<int>(f) - knots[piece]) / (knots[piece + 1] - knots[piece]);
      at += part * (prediction.frames[piece + 1] - prediction.frames[piece]);
    }
    const auto low = std::min(static_cast<std::size_t>(at), width - 1);
    const std::size_t high = std::min(low + 1, width - 1);
    const double b = at - static_cast<double>(low);
    for (std::size_t k = 0; k < dimensions; ++k) {
      out[k * n + f] = (1 - b) * reference[k * width + low] + b * reference[k * width + high];
    }
  }
  for (const std::size_t k : {std::size_t{0}, std::size_t{2}, std::size_t{3}}) centre(out.subspan(k * n, n));
  double sine = 0, cosine = 0;
  fixed_sin_cos(2 * std::numbers::pi * prediction.turn / WindowPrediction::turn_steps, sine, cosine);
  for (std::size_t f = 0; f < n; ++f) {
    const double x = out[f];
    const double z = out[2 * n + f];
    out[f] = cosine * x + sine * z;
    out[2 * n + f] = cosine * z - sine * x;
  }
}

void put_predictions(ValueWriter& out, const ClipTable& table, std::span<const WindowPrediction> predictions,
                     int context) {
  std::size_t w = 0;
  bool before = false;
  for (std::size_t c = 0; c < table.clips.size(); ++c) {
    int last_clip = static_cast<int>(c);
    int last_frame = 0;
    for (const int points : table.clips[c].blocks) {
      const WindowPrediction& p = predictions[w++];
      out.put_bit(p.used(), context + used_bit + (before ? 5 : 0));
      before = p.used();
      if (!p.used()) continue;
      out.put(p.clip - last_clip, context + clip_number);
      if (p.clip != last_clip) last_frame = 0;
      last_clip = p.clip;
      out.put(p.turn, context + turn_number);
      const std::vector<int> knots = regular_knots(points, prediction_span(table.clips[c].rate_hz));
      for (std::size_t i = 0; i < knots.size(); ++i) {
        const int expected = i > 0 ? p.frames[i - 1] + knots[i] - knots[i - 1] : last_frame;
        out.put(p.frames[i] - expected, context + (i > 0 ? frame_move : start_frame));
      }
      last_frame = p.frames.back();
    }
  }
}

std::vector<WindowPrediction> get_predictions(ValueReader& in, const ClipTable& table, int context) {
  std::vector<WindowPrediction> out;
  bool before = false;
  for (std::size_t c = 0; c < table.clips.size(); ++c) {
    std::int64_t last_clip = static_cast<std::int64_t>(c);
    std::int64_t last_frame = 0;
    for (const int points : table.clips[c].blocks) {
      WindowPrediction p;
      before = in.get_bit(context + used_bit + (before ? 5 : 0));
      if (before) {
        const std::int64_t clip = last_clip + in.get(context + clip_number);
        if (clip < 0 || clip >= static_cast<std::int64_t>(table.clips.size())) in.damaged();
        if (clip != last_clip) last_frame = 0;
        last_clip = clip;
        p.clip = static_cast<int>(clip);
        p.turn = static_cast<std::int32_t>(in.get_between(-1024, 1024, context + turn_number));
        const std::vector<int> knots = regular_knots(points, prediction_span(table.clips[c].rate_hz));
        for (std::size_t i = 0; i < knots.size(); ++i) {
          const std::int64_t expected = i > 0 ? last_frame + knots[i] - knots[i - 1] : last_frame;
          last_frame = expected + in.get(context + (i > 0 ? frame_move : start_frame));
          if (last_frame < 0 || last_frame >= table.clips[static_cast<std::size_t>(clip)].frames) in.damaged();
          p.frames.push_back(static_cast<std::int32_t>(last_frame));
        }
      }
      out.push_back(std::move(p));
    }
  }
  return out;
}

}  // namespace kinespace
