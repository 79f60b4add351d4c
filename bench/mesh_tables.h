// Tables 2, 3 and 4 of chen2019, remade with the paper's profile on those of its sequences that are there.
#pragma once

#include <string>
#include <vector>

#include "bench/plot.h"
#include "bench/report.h"
#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

class MeshTables {
 public:
  // The paper's rows for a sequence (none for one it does not have), each with our figures beside its own.
  // `standard_s`: what the standard profile takes to encode it at KG 0.5 %.
  void measure(const std::string& name, const MeshSequence& mesh, double standard_s);
  // Rates and errors of the rows of that sequence: the profile's curve in figure 11.
  [[nodiscard]] std::vector<PlotSeries::Point> curve(const std::string& name) const;
  void add_to(BenchReport& report) &&;

 private:
  void measure_clusters(const std::string& name, const MeshSequence& mesh);
  void measure_times(const std::string& name, const MeshSequence& mesh, double standard_s);

  struct NamedPoint {
    std::string name;
    PlotSeries::Point point;
  };
  std::vector<NamedPoint> points_;
  BenchTable clusters_{
      .title = "chen2019, table 2: clusters (profile paper; the paper's own figures behind ours)",
      .columns = {"sequence", "clusters", "bases", "bpvf", "KG %", "LR", "paper: bpvf", "KG %", "LR of its own alpha"},
      .rows = {}};
  BenchTable bases_{.title = "chen2019, table 3: bases (profile paper; the paper's own figures behind ours)",
                    .columns = {"sequence", "bases", "clusters", "bpvf", "KG %", "LR", "decoding a frame, s",
                                "paper: bpvf", "KG %", "LR of its own alpha", "decoding a frame, s"},
                    .rows = {}};
  BenchTable times_{.title = "chen2019, table 4: encoding with 400 bases, s (the paper's on one core of an i7-3770)",
                    .columns = {"sequence", "profile paper, 1 cluster", "standard profile at KG 0.5 %",
                                "paper: clustering", "harmonics", "prediction", "all"},
                    .rows = {}};
};

}  // namespace kinespace
