// waving-cloth DIR: writes a flag in the wind, 2501 vertices in 60 frames, as a folder of OBJ files.
#include <cmath>
#include <filesystem>
#include <iostream>

#include "kinespace/base/error.h"
#include "kinespace/mesh/mesh_files.h"

namespace {

using kinespace::MeshSequence;

constexpr int columns = 61, rows = 41, frames = 60;
constexpr double spacing_cm = 2;

// Waves run from the pole (u = 0) to the free edge and grow on the way; gusts make them uneven.
double out_of_plane_cm(double u, double v, double t) {
  const double wave = std::sin(11 * u - 7 * t + 1.5 * v) + 0.4 * std::sin(19 * u - 11 * t - 4 * v);
  const double gust = 1 + 0.3 * std::sin(1.7 * t + 2 * v);
  return 9 * u * (1.4 - 0.4 * u) * wave * gust;
}

MeshSequence waving_cloth() {
  MeshSequence cloth{.name = "cloth", .vertices = columns * rows, .frames = frames};
  for (int f = 0; f < frames; ++f) {
    const double t = f / cloth.rate_hz;
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        const double u = x / (columns - 1.0), v = y / (rows - 1.0);
        const double sag = 6 * u * u * (1 + 0.2 * std::sin(3 * t));
        for (const double c : {spacing_cm * x * 0.93, 100 + spacing_cm * y - sag, out_of_plane_cm(u, v, t)}) {
          cloth.positions.push_back(static_cast<float>(c));
        }
      }
    }
  }
  for (int y = 0; y + 1 < rows; ++y) {
    for (int x = 0; x + 1 < columns; ++x) {
      const int at = y * columns + x;
      cloth.triangles.push_back({at, at + 1, at + columns});
      cloth.triangles.push_back({at + 1, at + columns + 1, at + columns});
    }
  }
  return cloth;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "waving-cloth DIR: writes a flag in the wind as a folder of OBJ files\n";
    return static_cast<int>(kinespace::ErrorKind::usage);
  }
  try {
    const MeshSequence cloth = waving_cloth();
    kinespace::write_mesh_sequence(argv[1], cloth, kinespace::MeshFormat::obj);
    std::cout << cloth.frames << " frames of " << cloth.vertices << " vertices in " << argv[1] << '\n';
    return 0;
  } catch (const kinespace::Error& error) {
    std::cerr << "waving-cloth: " << error.what() << '\n';
    return static_cast<int>(error.kind());
  }
}
