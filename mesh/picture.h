// Pictures of meshes, without a display.
//
// A mesh is drawn in parallel projection with smooth shading, grey, or coloured by a number at each vertex from blue
// (0) over white to red (`worst` and above), as figures 6 and 9 of chen2019 colour errors. Seen from the front: x to
// the right, y up, z towards the viewer; `turn_degrees` turns the mesh about the vertical first. Both sides of a
// triangle are lit. One set of inputs gives one picture on one machine.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kinespace/mesh/mesh_sequence.h"

namespace kinespace {

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;  // red, green, blue, row by row from the top

  [[nodiscard]] std::uint8_t* at(int x, int y) {
    return pixels.data() +
           3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  }
  [[nodiscard]] const std::uint8_t* at(int x, int y) const {
    return pixels.data() +
           3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  }
};

struct PictureOptions {
  int panel_width = 640;     // pixels of each of the panels; 16 to 8192
  int panel_height = 640;    // 16 to 8192
  double turn_degrees = 30;  // -360 to 360
  double tilt_degrees = 10;  // from above; -90 to 90
  // The error that is red, in the file's unit for distances; by default the 99th percentile over the drawn vertices.
  std::optional<double> worst;

  // Throws Error{usage} naming field, value and legal range.
  void validate() const;
};

// A mesh in grey, or with `colour_by` (one number a vertex, empty for none) coloured up to `worst`. The box of
// `frame_of` fills the picture: the same one for several pictures keeps them at one scale.
[[nodiscard]] Picture draw_mesh(const Points& points, std::span<const Triangle> triangles, const Points& frame_of,
                                std::span<const double> colour_by, double worst, const PictureOptions& options);

// What errors colour.
enum class PictureError : std::uint8_t {
  distance,  // of a vertex from where it should be
  rigidity,  // its share of the local rigidity error
};

struct ComparisonPicture {
  Picture picture;
  double worst = 0;  // the error that is red
};

// Original, decoded and the decoded coloured by the error, side by side with a colour bar, of one frame. Throws Error
// like mesh_error.h, and Error{usage} for a frame that is not there.
[[nodiscard]] ComparisonPicture draw_comparison(const MeshSequence& original, const MeshSequence& decoded, int frame,
                                                PictureError error = PictureError::distance,
                                                const PictureOptions& options = {});

// As PNG. Throws Error{machine} when that fails.
[[nodiscard]] std::string format_png(const Picture& picture);
void write_png(const std::filesystem::path& path, const Picture& picture);

}  // namespace kinespace
