#include "kinespace/mesh/picture.h"

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/mesh/sample_meshes.h"

namespace kinespace::test {
namespace {

struct Count {
  int drawn = 0, red = 0, blue = 0;
};
Count count(const Picture& picture, int left, int right) {
  Count out;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = left; x < right; ++x) {
      const std::uint8_t* p = picture.at(x, y);
      if (p[0] < 250) ++out.drawn;
      if (p[0] > p[2] + 60) ++out.red;
      if (p[2] > p[0] + 60) ++out.blue;
    }
  }
  return out;
}

const PictureOptions small{.panel_width = 100, .panel_height = 80};

TEST(Picture, a_front_view_shows_the_mesh_where_it_is) {
  // One triangle in the lower left half of its box.
  Points points(3, 3);
  points << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  const std::vector<Triangle> triangles = {{0, 1, 2}};
  const Picture p = draw_mesh(points, triangles, points, {}, 1,
                              {.panel_width = 100, .panel_height = 100, .turn_degrees = 0, .tilt_degrees = 0});
  EXPECT_LT(p.at(15, 80)[0], 250) << "lower left";
  EXPECT_EQ(p.at(85, 20)[0], 255) << "upper right";
  EXPECT_NEAR(count(p, 0, 100).drawn, 90 * 90 / 2, 100);
}

TEST(Picture, nearer_triangles_hide_farther_ones) {
  Points points(6, 3);
  points << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1;
  const std::vector<double> error = {0, 0, 0, 1, 1, 1};
  const PictureOptions front{.panel_width = 64, .panel_height = 64, .turn_degrees = 0, .tilt_degrees = 0};
  for (const auto& order : {std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}}, std::vector<Triangle>{{3, 4, 5}, {0, 1, 2}}}) {
    const Count c = count(draw_mesh(points, order, points, error, 1, front), 0, 64);
    EXPECT_GT(c.red, 1000);
    EXPECT_LT(c.blue, 20);
  }
}

TEST(Picture, comparison_colours_only_what_is_wrong) {
  const MeshSequence mesh = bending_tube(800, 2, 1.0);
  MeshSequence wrong = mesh;
  for (int v = 0; v < 200; ++v) wrong.frame(1)[static_cast<std::size_t>(3 * v)] += 0.05F;
  const ComparisonPicture same = draw_comparison(mesh, mesh, 1, PictureError::distance, small);
  const ComparisonPicture other = draw_comparison(mesh, wrong, 1, PictureError::distance, small);
  EXPECT_EQ(same.picture.width, 324);
  EXPECT_EQ(count(same.picture, 0, 200).red, 0) << "original and decoded are grey";
  EXPECT_GT(count(same.picture, 0, 100).drawn, 300);
  EXPECT_EQ(count(same.picture, 200, 300).red, 0);
  EXPECT_GT(count(same.picture, 200, 300).blue, 300);
  EXPECT_GT(count(other.picture, 200, 300).red, 50);
  EXPECT_GT(count(other.picture, 200, 300).blue, 200);
  EXPECT_NEAR(other.worst, 0.05, 1e-6);
}

TEST(Picture, png_has_its_signature_and_size) {
  const std::string png =
      format_png(draw_comparison(sheet(5, 5, 1), sheet(5, 5, 1), 0, PictureError::rigidity, small).picture);
  EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(png.substr(16, 8), std::string("\0\0\x01\x44\0\0\0\x50", 8));
  EXPECT_EQ(png.substr(png.size() - 8, 4), "IEND");
}

TEST(Picture, odd_meshes_and_options_are_taken_or_refused) {
  MeshSequence point = sheet(1, 1, 1);
  EXPECT_EQ(count(draw_comparison(point, point, 0, PictureError::distance, small).picture, 0, 200).drawn, 0);
  EXPECT_THROW((void)draw_comparison(point, point, 1), Error);
  EXPECT_THROW((void)draw_comparison(point, point, 0, PictureError::distance, {.panel_width = 2}), Error);
}

}  // namespace
}  // namespace kinespace::test
