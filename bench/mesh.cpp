// `kinespace bench mesh`: what the mesh codecs make of the shared sequences; tables 2 to 4 and figure 11 of chen2019,
// remade on those of its sequences that are there.
#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "bench/mesh_measures.h"
#include "bench/mesh_tables.h"
#include "bench/plot.h"
#include "bench/report.h"
#include "bench/timing.h"
#include "kinespace/base/parallel.h"
#include "kinespace/mesh/mesh_files.h"

namespace kinespace {
namespace {

struct MeshBar {
  double kg;
  std::optional<double> bpvf;
};
struct Sequence {
  std::string name;
  std::vector<MeshBar> bars;      // of the standard profile
  std::vector<MeshBar> of_paper;  // chen2019, its own runs, for the paper's profile
};
const std::vector<Sequence>& sequences() {
  static const std::vector<Sequence> all{{"horse-gallop", {{1, 0.36}, {0.5, 0.50}, {0.2, 0.95}}, {{0.84, 0.96}}},
                                         {"samba", {{1, 0.20}, {0.5, 0.40}, {0.2, 0.60}}, {{0.61, 0.90}, {0.97, 0.90}}},
                                         {"cloth", {{1, 0.55}, {0.5, std::nullopt}, {0.2, std::nullopt}}, {{1, 0.5}}}};
  return all;
}

class MeshBench {
 public:
  explicit MeshBench(const std::filesystem::path& folder) : folder_(folder) {}

  BenchReport run() {
    const double all = seconds([&] {
      elephant();  // first: its memory is the process's
      for (const Sequence& sequence : sequences()) measure(sequence, read(sequence.name));
      speed();
    });
    add("the whole bench", "all sequences", all, "s");
    std::move(tables_).add_to(report_);
    report_.tables.push_back(std::move(rates_));
    report_.tables.push_back(std::move(spaces_));
    for (const Sequence& sequence : sequences()) draw(sequence.name);
    return std::move(report_);
  }

 private:
  void add(std::string name, const std::string& data, double value, std::string unit, std::optional<double> bar = {}) {
    report_.results.push_back(
        {.name = std::move(name), .data = data, .value = value, .unit = std::move(unit), .bar = bar});
  }
  [[nodiscard]] MeshSequence read(const std::string& name) const { return read_mesh_sequence(folder_ / name); }

  // A row of the table of rates, and a point of the codec's curve.
  void note(const std::string& sequence, const std::string& codec, const MeshPoint& p) {
    rates_.rows.push_back({sequence, codec, p.kg, p.bpvf, p.without_connectivity, p.lr, p.encode_s});
    const auto of_codec = [&](const Curve& c) { return c.sequence == sequence && c.series.name == codec; };
    auto curve = std::find_if(curves_.begin(), curves_.end(), of_codec);
    if (curve == curves_.end()) curve = curves_.insert(curve, {sequence, {.name = codec, .points = {}}});
    curve->series.points.push_back({p.bpvf, p.kg});
  }

  // Figure 11, a picture for each sequence.
  void draw(const std::string& sequence) {
    Plot plot{.title = "chen2019, figure 11: rate and distortion of " + sequence,
              .x = {.label = "bits per vertex and frame", .logarithmic = true},
              .y = {.label = "KG error, percent", .logarithmic = true},
              .series = {}};
    for (Curve& curve : curves_) {
      if (curve.sequence != sequence) continue;
      std::ranges::sort(curve.series.points, {}, &PlotSeries::Point::x);
      plot.series.push_back(curve.series);
    }
    report_.pictures.push_back({.name = "mesh-rate-distortion-" + sequence, .svg = to_svg(plot)});
  }

  void measure(const Sequence& sequence, const MeshSequence& mesh) {
    standard(sequence, mesh);
    pca(sequence, mesh);
    for (const double kg : {1.0, 0.5}) {
      const MeshPoint p = encode_only("mesh-draco", mesh, {.kg = kg}).point;
      add(fmt::format("mesh-draco at KG {} %", kg), sequence.name, p.bpvf, "bpvf");
      note(sequence.name, "mesh-draco", p);
    }
    paper(sequence, mesh);
    spaces(sequence.name, mesh);
  }

  void standard(const Sequence& sequence, const MeshSequence& mesh) {
    for (const MeshBar& bar : sequence.bars) {
      const MeshPoint p = code_mesh("mesh-harmonics", mesh, {.kg = bar.kg}).point;
      add(fmt::format("rate at KG {} %", bar.kg), sequence.name, p.bpvf, "bpvf", bar.bpvf);
      add(fmt::format("encoding at KG {} %", bar.kg), sequence.name, p.encode_s, "s");
      note(sequence.name, "standard profile", p);
      if (bar.kg == 0.5) standard_s_ = p.encode_s;
    }
  }

  void pca(const Sequence& sequence, const MeshSequence& mesh) {
    for (const MeshBar& bar : sequence.bars) {
      const MeshPoint p = code_mesh("mesh-pca", mesh, {.kg = bar.kg}).point;
      add(fmt::format("mesh-pca at KG {} %", bar.kg), sequence.name, p.bpvf, "bpvf");
      note(sequence.name, "mesh-pca", p);
      if (bar.kg != 1) continue;
      const MeshPoint same = code_mesh("mesh-harmonics", mesh, {.bytes = p.bytes}).point;
      add(fmt::format("LR at the {:.3f} bpvf of mesh-pca (bar: its LR)", p.bpvf), sequence.name, same.lr, "", p.lr);
      note(sequence.name, "standard profile", same);
    }
  }

  void paper(const Sequence& sequence, const MeshSequence& mesh) {
    for (const MeshBar& bar : sequence.of_paper) {
      const MeshPoint p = encode_only("mesh-harmonics", mesh, {.kg = bar.kg, .profile = MeshProfile::paper}).point;
      add(fmt::format("profile paper at KG {} %, as the paper's (bar: its rate)", bar.kg), sequence.name, p.bpvf,
          "bpvf", bar.bpvf);
      note(sequence.name, "profile paper", p);
    }
    tables_.measure(sequence.name, mesh, standard_s_);
    curves_.push_back({sequence.name, {.name = "paper's K and J", .points = tables_.curve(sequence.name)}});
  }

  // Smooth functions against eigenvectors in their place.
  void spaces(const std::string& name, const MeshSequence& mesh) {
    constexpr std::array projected{100, 200, 400};
    std::array<ProjectionError, projected.size()> errors;
    parallel_for(std::size_t{0}, errors.size(),
                 [&](std::size_t i) { errors[i] = projection_error(mesh, projected[i]); });
    for (std::size_t i = 0; i < errors.size(); ++i) {
      spaces_.rows.push_back({name, static_cast<double>(projected[i]), errors[i].smooth, errors[i].harmonics,
                              errors[i].smooth / errors[i].harmonics});
    }
    constexpr double kg = 0.5;
    constexpr std::array coded{400, 600};
    std::array<double, coded.size()> smooth{}, eigenvectors{};
    parallel_for(std::size_t{0}, 2 * coded.size(), [&](std::size_t i) {
      const bool of_eigenvectors = i % 2 == 1;
      (of_eigenvectors ? eigenvectors : smooth)[i / 2] = estimated_bpvf(mesh, kg, coded[i / 2], of_eigenvectors);
    });
    for (std::size_t i = 0; i < coded.size(); ++i) {
      add(fmt::format("rate on {} smooth functions at KG {} %, over that on eigenvectors", coded[i], kg), name,
          smooth[i] / eigenvectors[i], "");
    }
    add(fmt::format("the same for the better number of each at KG {} %", kg), name,
        std::ranges::min(smooth) / std::ranges::min(eigenvectors), "", 1.1);
  }

  void speed() {
    const std::string name = "horse-gallop";
    const MeshSequence mesh = read(name);
    const CodedMesh coded = encode_only("mesh-harmonics", mesh, {.kg = 0.5, .bases = 400});
    add("encoding with 400 functions", name, coded.point.encode_s, "s", 15);
    add("decoding a frame, one core", name, milliseconds_a_frame(*open_mesh_stream(coded.stream, "bench")), "ms", 4);
    const BasisSeconds basis = basis_seconds(mesh, 400);
    add("400 smooth functions, one core", name, basis.smooth, "s", 5);
    add("400 manifold harmonics, one core", name, basis.harmonics, "s", 5);
  }

  void elephant() {
    const std::string name = "elephant-gallop";
    if (!std::filesystem::exists(folder_ / name)) return;
    const MeshSequence mesh = read(name);
    MeshPoint p;
    const double memory =
        peak_memory_gib([&] { p = encode_only("mesh-harmonics", mesh, {.kg = 1.5, .coarse_vertices = 10'000}).point; });
    add("encoding, multi-resolution of 10 000 vertices", name, p.encode_s, "s", 60);
    add("most memory while encoding, with the sequence", name, memory, "GiB", 2);
    add(fmt::format("rate at KG {:.2f} %", p.kg), name, p.bpvf, "bpvf");
  }

  std::filesystem::path folder_;
  BenchReport report_{
      .bench = "mesh",
      .device = "cpu",
      .threads = static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism))};
  MeshTables tables_;
  double standard_s_ = 0;  // of the sequence at hand, at KG 0.5 %
  BenchTable rates_{.title = "Rate and distortion: bits per vertex and frame, of everything and without connectivity",
                    .columns = {"sequence", "codec", "KG %", "bpvf", "without connectivity", "LR", "encoding, s"},
                    .rows = {}};
  BenchTable spaces_{.title = "KG of frames projected on functions of the first, percent",
                     .columns = {"sequence", "functions", "smooth", "eigenvectors", "ratio"},
                     .rows = {}};
  struct Curve {
    std::string sequence;
    PlotSeries series;
  };
  std::vector<Curve> curves_;
};

}  // namespace

BenchReport bench_mesh(const BenchOptions& options) {
  return MeshBench(options.data / "mesh").run();
}

}  // namespace kinespace
