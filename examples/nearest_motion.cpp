// From a folder of clips to the nearest motions of one of them, and that one played coarsely:
//
//   nearest-motion CLIPS_FOLDER A_CLIP.bvh
//
// Shows the four calls that most programs need: build_library, LibraryView, nearest_motions, LibraryView::clip.
#include <cstdio>
#include <filesystem>

#include "kinespace/base/error.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"
#include "kinespace/synthesis/retrieval.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: nearest-motion CLIPS_FOLDER A_CLIP.bvh\n");
    return 2;
  }
  try {
    const std::filesystem::path folder = argv[1];
    const std::filesystem::path file = std::filesystem::temp_directory_path() / "nearest-motion.kspace";
    const kinespace::LibraryReport report = kinespace::build_library(kinespace::find_motion_files({folder}), file, {});
    std::printf("%d clips, %d sequences, %d functions, %.3f cm mean error\n", report.clips, report.sequences,
                report.functions, report.mean_joint_error_cm);

    kinespace::LibraryView library(file);
    for (const kinespace::Match& match : kinespace::nearest_motions(library, kinespace::read_clip(argv[2]), {.k = 5})) {
      std::printf("%8.4f  %s\n", match.distance, match.clip.c_str());
    }

    const kinespace::ClipRow first = library.library().clips().front();
    const kinespace::Clip coarse = library.clip(first, 5);  // the first five functions
    kinespace::write_clip("coarse.bvh", coarse);
    return 0;
  } catch (const kinespace::Error& error) {
    std::fprintf(stderr, "nearest-motion: %s\n", error.what());
    return static_cast<int>(error.kind());
  }
}
