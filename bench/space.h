// Rows of `kinespace bench fpca` about the motion space on real clips.
#pragma once

#include "bench/report.h"
#include "kinespace/kernels/device.h"

namespace kinespace {

// Joint error by level of detail, jumps at cuts, the worth of alignment (yoo2019, table 1): bandai1+bandai2, cmu 01-03.
void space_rows(const BenchOptions& options, const Compute& compute, BenchReport& report);

}  // namespace kinespace
