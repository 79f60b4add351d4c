#include "bench/yoo2019_paper.h"

#include <algorithm>
#include <array>

namespace kinespace {
namespace {

struct PaperNumber {
  int table;
  std::string_view row;
  std::string_view column;
  double value;
};

constexpr auto paper_numbers = std::to_array<PaperNumber>({
    {1, "Before DTW", "Avg Error", 0.003176},
    {1, "Before DTW", "Var.", 0.000079},
    {1, "Before DTW", "# of Basis Func", 10},
    {1, "After DTW", "Avg Error", 0.002338},
    {1, "After DTW", "Var.", 0.000088},
    {1, "After DTW", "# of Basis Func", 6},

    {2, "Per Component", "Avg Error", 0.002525},
    {2, "Per Component", "Var.", 0.000093},
    {2, "Per Component", "# of Basis Func", 114},
    {2, "Per Joint Component", "Avg Error", 0.002140},
    {2, "Per Joint Component", "Var.", 0.000051},
    {2, "Per Joint Component", "# of Basis Func", 2032},
    {2, "All Together", "Avg Error", 0.002255},
    {2, "All Together", "Var.", 0.000084},
    {2, "All Together", "# of Basis Func", 23},

    // Average error, maximum error, processing time (s).
    {3, "PACE", "210 curves", 0.00326511},
    {3, "PACE", "6510 curves", 0.00145804},
    {3, "Ours", "210 curves", 0.00326484},
    {3, "Ours", "6510 curves", 0.00146001},
    {4, "PACE", "210 curves", 0.06804195},
    {4, "PACE", "6510 curves", 0.20938692},
    {4, "Ours", "210 curves", 0.06802791},
    {4, "Ours", "6510 curves", 0.20937758},
    {5, "PACE", "210 curves", 24.2851400},
    {5, "PACE", "6510 curves", 784.976200},
    {5, "Ours", "210 curves", 2.27931000},
    {5, "Ours", "6510 curves", 3.47349000},

    {6, "Total", "Our method", 96},
    {6, "Total", "Fourier", 476},
    {6, "Total", "Legendre", 293},

    // Compression ratio; the columns are CMU's subject and take.
    {7, "Liu and McMillan", "13_29", 55},
    {7, "Liu and McMillan", "85_12", 18},
    {7, "Liu and McMillan", "86_02", 53},
    {7, "Liu and McMillan", "86_08", 56},
    {7, "Tournier et al.", "09_06", 18},
    {7, "Tournier et al.", "15_04", 69},
    {7, "Tournier et al.", "17_08", 182},
    {7, "Tournier et al.", "17_10", 61},
    {7, "Tournier et al.", "85_12", 97},
    {7, "Ours", "09_06", 19},
    {7, "Ours", "13_29", 33},
    {7, "Ours", "15_04", 63},
    {7, "Ours", "17_08", 34},
    {7, "Ours", "17_10", 33},
    {7, "Ours", "85_12", 34},
    {7, "Ours", "86_02", 34},
    {7, "Ours", "86_08", 29},

    // Distortion rate, percent.
    {8, "Liu and McMillan", "13_29", 5.1},
    {8, "Liu and McMillan", "85_12", 7.1},
    {8, "Liu and McMillan", "86_02", 5.1},
    {8, "Liu and McMillan", "86_08", 5.4},
    {8, "Tournier et al.", "09_06", 0.36},
    {8, "Tournier et al.", "15_04", 1.55},
    {8, "Tournier et al.", "17_08", 0.049},
    {8, "Tournier et al.", "17_10", 0.49},
    {8, "Tournier et al.", "85_12", 0.56},
    {8, "Ours", "09_06", 1.11},
    {8, "Ours", "13_29", 0.30},
    {8, "Ours", "15_04", 0.21},
    {8, "Ours", "17_08", 0.39},
    {8, "Ours", "17_10", 0.23},
    {8, "Ours", "85_12", 0.34},
    {8, "Ours", "86_02", 0.38},
    {8, "Ours", "86_08", 0.40},

    // Section 7.2: "for the first 5 basis functions".
    {9, "5", "Our method", 50},
    {9, "5", "Fourier", 9},
    {9, "5", "Legendre", 10},
});

}  // namespace

std::optional<double> paper_number(int table, std::string_view row, std::string_view column) {
  const auto found = std::ranges::find_if(paper_numbers, [&](const PaperNumber& number) {
    return number.table == table && number.row == row && number.column == column;
  });
  if (found == paper_numbers.end()) return {};
  return found->value;
}

}  // namespace kinespace
