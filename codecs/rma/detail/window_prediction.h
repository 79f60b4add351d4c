// A window of motion told from another one: the reference frames that the repeated motion analysis found, as the
// decoder follows them.
//
// The pose vectors (codecs/stream/pose_vectors.h) of the reference frames, between two of them by straight lines, with the
// travel and the heading brought into place: both without their mean over the window, the travel turned about the
// vertical by `turn`. Where the window stands and looks is left to what is coded beside.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kinespace/codecs/stream/clip_table.h"
#include "kinespace/entropy/integer_coder.h"

namespace kinespace {

struct WindowPrediction {
  static constexpr int turn_steps = 64;  // to the turn
  static constexpr int knot_span = 48;   // frames between the frames that are told, at 120 Hz
  int clip = -1;                         // referred to; -1: the window stands for itself
  std::int32_t turn = 0;
  std::vector<std::int32_t> frames;  // of that clip, at regular_knots(points, span)

  [[nodiscard]] bool used() const { return clip >= 0; }
  [[nodiscard]] int first_frame() const;
  [[nodiscard]] int last_frame() const;
};

[[nodiscard]] int prediction_span(double rate_hz);

// reference: vectors [dimension][frame] of frames [first, first + count) of the clip referred to, which hold all that
// the prediction needs; out: [dimension][points]. The same bits on every machine.
void predict_window(const WindowPrediction& prediction, int points, int span, std::span<const double> reference,
                    int first, int count, std::span<double> out);

// By window of the table; contexts [context, context + prediction_contexts).
inline constexpr int prediction_contexts = 8;
void put_predictions(ValueWriter& out, const ClipTable& table, std::span<const WindowPrediction> predictions,
                     int context);
[[nodiscard]] std::vector<WindowPrediction> get_predictions(ValueReader& in, const ClipTable& table, int context);

}  // namespace kinespace
