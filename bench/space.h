// Rows of `kinespace bench fpca` about the motion space on real clips.
#pragma once

#include "bench/report.h"
#include "kinespace/kernels/device.h"

namespace kinespace {

// Joint error by level of detail, jumps at cuts, the worth of alignment (yoo2019, table 1): bandai1+bandai2, cmu 01-03.
void space_rows(const BenchOptions& options, const Compute& compute, BenchReport& report);

// How many functions the same error takes in our basis, in Fourier's and in Legendre's (yoo2019, table 6): cmu.
void basis_rows(const BenchOptions& options, BenchReport& report);

}  // namespace kinespace
