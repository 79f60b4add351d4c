#include "tests/mesh/sample_meshes.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "tests/support/data.h"

namespace kinespace::test {
namespace {

void add_vertex(MeshSequence& mesh, double x, double y, double z) {
  for (const double c : {x, y, z}) mesh.positions.push_back(static_cast<float>(c));
}

}  // namespace

MeshSequence tetrahedron() {
  MeshSequence out{.name = "tetrahedron", .vertices = 4, .frames = 1};
  add_vertex(out, 0, 0, 0);
  add_vertex(out, 1, 0, 0);
  add_vertex(out, 0, 1, 0);
  add_vertex(out, 0, 0, 1);
  out.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return out;
}

MeshSequence sheet(int columns, int rows, int frames) {
  MeshSequence out{.name = "sheet", .vertices = columns * rows, .frames = frames};
  for (int f = 0; f < frames; ++f) {
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) add_vertex(out, x, y, std::sin(0.5 * x + 0.3 * y + 0.2 * f));
    }
  }
  for (int y = 0; y + 1 < rows; ++y) {
    for (int x = 0; x + 1 < columns; ++x) {
      const int v = y * columns + x;
      out.triangles.push_back({v, v + 1, v + columns});
      out.triangles.push_back({v + 1, v + columns + 1, v + columns});
    }
  }
  return out;
}

MeshSequence bending_tube(int vertices, int frames, double bend) {
  constexpr int around = 16;
  const int rings = std::max(4, vertices / around);
  const double length = 12;
  MeshSequence out{.name = "tube", .vertices = rings * around + 2, .frames = frames};
  for (int f = 0; f < frames; ++f) {
    const double curvature = bend * (f + 1) / frames / length;
    const auto add = [&](double s, double radius, double angle) {
      const double turn = curvature * s;
      const double along = curvature > 0 ? std::sin(turn) / curvature : s;
      const double lift = curvature > 0 ? (1 - std::cos(turn)) / curvature : 0;
      const double up = radius * std::cos(angle);
      add_vertex(out, along - std::sin(turn) * up, lift + std::cos(turn) * up, radius * std::sin(angle));
    };
    for (int r = 0; r < rings; ++r) {
      const double s = length * (r + 0.5) / rings;
      const double round = std::sqrt(std::sin(std::numbers::pi * (r + 0.5) / rings));
      for (int a = 0; a < around; ++a) {
        add(s, round * (1 + 0.05 * std::sin(2.1 * r) * std::cos(3.0 * a)), 2 * std::numbers::pi * a / around);
      }
    }
    add(0, 0, 0);
    add(length, 0, 0);
  }
  const int first_end = rings * around, second_end = first_end + 1;
  for (int a = 0; a < around; ++a) {
    const int next = (a + 1) % around;
    for (int r = 0; r + 1 < rings; ++r) {
      const int v = r * around + a, w = r * around + next;
      out.triangles.push_back({v, w, v + around});
      out.triangles.push_back({w, w + around, v + around});
    }
    out.triangles.push_back({first_end, next, a});
    out.triangles.push_back({second_end, (rings - 1) * around + a, (rings - 1) * around + next});
  }
  return out;
}

MeshSequence joined(const MeshSequence& a, const MeshSequence& b) {
  MeshSequence out{.name = "joined", .vertices = a.vertices + b.vertices, .frames = a.frames};
  for (int f = 0; f < a.frames; ++f) {
    out.positions.insert(out.positions.end(), a.frame(f).begin(), a.frame(f).end());
    out.positions.insert(out.positions.end(), b.frame(f).begin(), b.frame(f).end());
  }
  out.triangles = a.triangles;
  for (Triangle t : b.triangles) {
    for (auto& v : t) v += a.vertices;
    out.triangles.push_back(t);
  }
  return out;
}

MeshSequence moved_rigidly(const MeshSequence& mesh, double angle_per_frame) {
  MeshSequence out = mesh;
  for (int f = 0; f < mesh.frames; ++f) {
    const Eigen::AngleAxisd turn(angle_per_frame * (f + 1), Eigen::Vector3d(1, 2, 3).normalized());
    const Eigen::RowVector3d shift(1.0 + f, -2.0 * f, 0.5);
    set_frame(out, f, (frame_points(mesh, f) * turn.toRotationMatrix().transpose()).rowwise() + shift);
  }
  return out;
}

std::optional<std::filesystem::path> mesh_folder() {
  const auto data = data_folder();
  if (!data || !std::filesystem::exists(*data / "mesh")) return {};
  return *data / "mesh";
}

}  // namespace kinespace::test
