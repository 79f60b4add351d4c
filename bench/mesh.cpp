// `kinespace bench mesh`: what the mesh codecs make of the shared sequences; tables 2 to 4 and figure 11 of chen2019,
// remade on those of its sequences that are there.
#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "bench/plot.h"
#include "bench/report.h"
#include "bench/timing.h"
#include <fmt/format.h>
#include <tbb/global_control.h>

#include "base/error.h"
#include "codecs/mesh/mesh_codec.h"
#include "mesh/mesh_error.h"
#include "mesh/mesh_files.h"
#include "mesh/smooth_basis.h"

namespace kinespace {
namespace {

struct Point {
  double bpvf = 0, without_connectivity = 0, kg = 0, lr = 0;
  std::int64_t bytes = 0;
  double encode_s = 0;
};

struct Coded {
  Point point;
  Bytes stream;
};

// Encoded, opened again and measured on what was decoded.
Coded code(std::string_view codec, const MeshSequence& mesh, const MeshCodecOptions& options) {
  Coded out;
  out.point.encode_s = seconds([&] { out.stream = encode_mesh(codec, mesh, options); });
  const auto reader = open_mesh_stream(out.stream, "bench");
  const MeshError error = compare(mesh, reader->decode_all());
  Point& p = out.point;
  p.bytes = static_cast<std::int64_t>(out.stream.size());
  p.bpvf = bits_per_vertex_and_frame(p.bytes, mesh);
  p.without_connectivity = bits_per_vertex_and_frame(p.bytes - reader->connectivity_bytes(), mesh);
  p.kg = error.kg;
  p.lr = error.lr;
  return out;
}

struct Bar {
  double kg;
  std::optional<double> bpvf;
};
struct Sequence {
  std::string name;
  std::vector<Bar> bars;      // of the standard profile
  std::vector<Bar> of_paper;  // chen2019, its own runs, for the paper's profile
};
const std::vector<Sequence>& sequences() {
  static const std::vector<Sequence> all{{"horse-gallop", {{1, 0.36}, {0.5, 0.50}, {0.2, 0.95}}, {{0.84, 0.96}}},
                                         {"samba", {{1, 0.20}, {0.5, 0.40}, {0.2, 0.60}}, {{0.61, 0.90}, {0.97, 0.90}}},
                                         {"cloth", {{1, 0.55}, {0.5, std::nullopt}, {0.2, std::nullopt}}, {}}};
  return all;
}

class MeshBench {
 public:
  explicit MeshBench(const std::filesystem::path& folder) : folder_(folder) {}

  BenchReport run() {
    for (const Sequence& sequence : sequences()) measure(sequence);
    speed();
    elephant();
    report_.tables.push_back(std::move(clusters_));
    report_.tables.push_back(std::move(bases_));
    report_.tables.push_back(std::move(times_));
    Plot plot{.title = "chen2019, figure 11: rate and distortion",
              .x = {.label = "bits per vertex and frame", .logarithmic = true},
              .y = {.label = "KG error, percent", .logarithmic = true},
              .series = std::move(curves_)};
    report_.pictures.push_back({.name = "mesh-rate-distortion", .svg = to_svg(plot)});
    return std::move(report_);
  }

 private:
  void add(std::string name, const std::string& data, double value, std::string unit, std::optional<double> bar = {}) {
    report_.results.push_back(
        {.name = std::move(name), .data = data, .value = value, .unit = std::move(unit), .bar = bar});
  }
  [[nodiscard]] MeshSequence read(const std::string& name) const { return read_mesh_sequence(folder_ / name); }

  void measure(const Sequence& sequence) {
    const MeshSequence mesh = read(sequence.name);
    PlotSeries standard{.name = sequence.name + ", mesh-harmonics", .points = {}};
    PlotSeries pca{.name = sequence.name + ", mesh-pca", .points = {}};
    for (const Bar& bar : sequence.bars) {
      const Point p = code("mesh-harmonics", mesh, {.kg = bar.kg}).point;
      add(fmt::format("bits per vertex and frame at KG {} %", bar.kg), sequence.name, p.bpvf, "bpvf", bar.bpvf);
      add(fmt::format("the same without connectivity, at {:.3f} %", p.kg), sequence.name, p.without_connectivity,
          "bpvf");
      standard.points.push_back({p.bpvf, p.kg});
      const Point q = code("mesh-pca", mesh, {.kg = bar.kg}).point;
      add(fmt::format("mesh-pca at KG {} %", bar.kg), sequence.name, q.bpvf, "bpvf");
      pca.points.push_back({q.bpvf, q.kg});
      if (bar.kg == 1) {
        const Point same = code("mesh-harmonics", mesh, {.bytes = q.bytes}).point;
        add(fmt::format("LR at the bytes of mesh-pca ({:.3f} bpvf; bar: its LR)", q.bpvf), sequence.name, same.lr, "",
            q.lr);
        times_.rows.push_back({sequence.name, p.encode_s, q.encode_s});
      }
    }
    const Point draco = code("mesh-draco", mesh, {.kg = 1.0}).point;
    add("mesh-draco at KG 1 %", sequence.name, draco.bpvf, "bpvf");
    curves_.push_back(std::move(standard));
    curves_.push_back(std::move(pca));
    paper(sequence, mesh);
  }

  void paper(const Sequence& sequence, const MeshSequence& mesh) {
    for (const Bar& bar : sequence.of_paper) {
      const Point p = code("mesh-harmonics", mesh, {.kg = bar.kg, .profile = MeshProfile::paper}).point;
      add(fmt::format("paper profile at the paper's KG {} %", bar.kg), sequence.name, p.bpvf, "bpvf", bar.bpvf);
    }
    if (sequence.of_paper.empty()) return;
    for (const int clusters : {1, 2, 4}) {
      const Point p =
          code("mesh-harmonics", mesh, {.profile = MeshProfile::paper, .bases = 300, .clusters = clusters}).point;
      clusters_.rows.push_back({sequence.name, static_cast<double>(clusters), 300.0, p.bpvf, p.kg, p.lr});
    }
    for (const int bases : {200, 400}) {
      const Coded coded = code("mesh-harmonics", mesh, {.profile = MeshProfile::paper, .bases = bases, .clusters = 2});
      const auto reader = open_mesh_stream(coded.stream, "bench");
      bases_.rows.push_back({sequence.name, static_cast<double>(bases), 2.0, coded.point.bpvf, coded.point.kg,
                             coded.point.lr, milliseconds_a_frame(*reader) / 1000});
    }
  }

  // On one core; the least of a few, since other programs only slow it down.
  static double milliseconds_a_frame(const MeshStreamReader& reader) {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    double best = std::numeric_limits<double>::infinity();
    for (int f = 0; f < std::min(reader.layout().frames, 12); ++f) {
      best = std::min(best, 1000 * seconds([&] { static_cast<void>(reader.frame(f)); }));
    }
    return best;
  }

  void speed() {
    const MeshSequence mesh = read("horse-gallop");
    const Coded coded = code("mesh-harmonics", mesh, {.kg = 0.5, .bases = 400});
    add("encoding with 400 functions", "horse-gallop", coded.point.encode_s, "s", 15);
    add("decoding a frame, one core", "horse-gallop", milliseconds_a_frame(*open_mesh_stream(coded.stream, "bench")),
        "ms", 4);
    const Points key = frame_points(mesh, 0);
    double best = std::numeric_limits<double>::infinity();
    for (int round = 0; round < 3; ++round) {
      best = std::min(best, seconds([&] { static_cast<void>(smooth_basis(key, mesh.triangles, {.functions = 400})); }));
    }
    add("basis of 400 functions", "horse-gallop", best, "s", 5);
  }

  void elephant() {
    if (!std::filesystem::exists(folder_ / "elephant-gallop")) return;
    const MeshSequence mesh = read("elephant-gallop");
    const Point p = code("mesh-harmonics", mesh, {.kg = 1.5, .coarse_vertices = 10'000}).point;
    add("encoding, multi-resolution of 10 000 vertices", "elephant-gallop", p.encode_s, "s", 60);
    add(fmt::format("bits per vertex and frame at KG {:.2f} %", p.kg), "elephant-gallop", p.bpvf, "bpvf");
  }

  std::filesystem::path folder_;
  BenchReport report_{
      .bench = "mesh",
      .device = "cpu",
      .threads = static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism))};
  BenchTable clusters_{.title = "chen2019, table 2: clusters (paper's profile)",
                       .columns = {"sequence", "clusters", "bases", "bpvf", "KG %", "LR"},
                       .rows = {}};
  BenchTable bases_{.title = "chen2019, table 3: bases (paper's profile)",
                    .columns = {"sequence", "bases", "clusters", "bpvf", "KG %", "LR", "decoding a frame, s"},
                    .rows = {}};
  BenchTable times_{.title = "chen2019, table 4: encoding, s",
                    .columns = {"sequence", "mesh-harmonics at KG 1 %", "mesh-pca at KG 1 %"},
                    .rows = {}};
  std::vector<PlotSeries> curves_;
};

}  // namespace

BenchReport bench_mesh(const BenchOptions& options) {
  return MeshBench(options.data / "mesh").run();
}

}  // namespace kinespace
