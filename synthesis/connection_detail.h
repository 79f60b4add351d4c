// Shared by the files of connection.h.
#pragma once

namespace kinespace {

constexpr int connection_bound_cells = 40;  // a stretch is bounded from below over so many cells of its time

}  // namespace kinespace
