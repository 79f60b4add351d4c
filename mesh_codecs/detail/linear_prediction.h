// Linear prediction of second order of many coefficients over time, closed loop (karni and gotsman 2004; chen2019 eq. 6
// and 7): c_t is expected to be a_0 + a_1 c_(t-1) + a_2 c_(t-2), of decoded values; what is missed is coded in steps.
//
// The first frame is expected to be like the key-frame, the second like the first. Short sequences use (0, 1, 0) for
// all, since coefficients of their own would cost more than they save.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"

namespace kinespace {

// Tables are [frame][coefficient], three coefficients (axes) for each function, smooth functions first.
struct CodedPrediction {
  Bytes coefficients, misses;
  std::vector<double> decoded;
};
[[nodiscard]] CodedPrediction encode_prediction(std::span<const double> table, std::span<const double> key, int frames,
                                                double step);
// Throws Error{bad_input} naming `source`.
[[nodiscard]] std::vector<double> decode_prediction(std::span<const std::byte> coefficients,
                                                    std::span<const std::byte> misses, std::span<const double> key,
                                                    int frames, double step, const std::string& source);

}  // namespace kinespace
