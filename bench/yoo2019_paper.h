// The numbers that yoo2019 prints, to stand beside ours in `kinespace bench yoo2019`.
#pragma once

#include <optional>
#include <string_view>

namespace kinespace {

// By the number of the table and its own words for row and column; figure 9 (section 7.2) counts as table 9. Nothing
// where the paper has no number ("N/A"), or no such cell.
[[nodiscard]] std::optional<double> paper_number(int table, std::string_view row, std::string_view column);

}  // namespace kinespace
