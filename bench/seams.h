// The seams of transitions between random pairs of clips: how suddenly joints move there, and what the feet do.
#pragma once

#include <string>

#include "bench/report.h"
#include "kinespace/library/library_view.h"

namespace kinespace {

void seam_rows(const std::string& data, LibraryView& view, BenchReport& report);

}  // namespace kinespace
