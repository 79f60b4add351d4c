// The rate of streamed covariance with its eigenproblem, against the bare product over the same data.
#pragma once

#include <vector>

#include "bench/report.h"
#include "kinespace/kernels/device.h"

namespace kinespace {

// 1 000 000 made curves of 128 points in 16 parts of 32 MB, everything on one thread; needs 0.6 GB of memory. The
// device is timed too, on all it has, unless it is the processor.
[[nodiscard]] std::vector<BenchResult> bench_covariance_stream(const Compute& device);

}  // namespace kinespace
