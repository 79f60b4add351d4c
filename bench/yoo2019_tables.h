// The tables and figures of yoo2019, remade on the clips given. Part of `kinespace bench yoo2019`.
//
// Errors are the paper's E (eq. 2) of each sampled curve against what was decoded of it, over [0, 1]: in the curves' unit
// (m/s, or of a unit quaternion's component). The set is cut at rests, as the paper has no cycles (section 7.2).
#pragma once

#include <filesystem>
#include <optional>

#include "bench/prepared_set.h"
#include "bench/report.h"

namespace kinespace {

// Table 1: error, variance and functions without and with registration. Table 2: the three groupings.
void add_space_tables(const PreparedSet& set, const Compute& compute, BenchReport& report);

// Tables 3 to 5: error and time of the smoothed analysis of 210 and of 6510 curves, beside the paper's, and beside what
// fdapace (R) gave where `golden` has a case of 210 curves.
void add_smoothing_tables(const PreparedSet& set, const std::optional<std::filesystem::path>& golden,
                          BenchReport& report);

// Table 6: functions that the same error takes, ours, Fourier's and Legendre's; `judged`: with bars, which are for
// captured motion. Figure 8: the three near a sharp change.
void add_basis_tables(const PreparedSet& set, bool judged, BenchReport& report);

// Tables 7 and 8: ratio and distortion rate of motion vectors of 6 functions. Figure 9: ratio by number of functions.
void add_vector_tables(const PreparedSet& set, const Compute& compute, BenchReport& report);

// The name of a set as part of the name of a picture's file: letters, digits, '.', '+', '_' and '-'; all else becomes '-'.
[[nodiscard]] std::string picture_name(const std::string& set);

}  // namespace kinespace
