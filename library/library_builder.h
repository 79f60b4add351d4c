// From files to a library: read, cut, align, analyse, store. What `kinespace build` does.
//
// Clips are read and made ready one by one and kept in the partial file beside the target, so that memory does not grow
// with the library and a build that was stopped goes on where it was. The target is replaced in one step at the end.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/fpca/clip_space.h"
#include "kinespace/fpca/space_builder.h"
#include "kinespace/kernels/device.h"
#include "kinespace/library/bad_files.h"

namespace kinespace {

struct LibraryBuilderOptions {
  SpaceBuildOptions space;
  ClipSpaceOptions clips;
  bool by_skeleton = false;                  // one space for each joint tree, instead of an error
  bool add = false;                          // extend the library that is there
  std::optional<std::filesystem::path> asf;  // the skeleton of AMC files; else found beside them
  // Files that cannot be read are left out and listed in the report; else the first of them is an error. Where none is
  // left, it is an error, too.
  bool leave_out_bad = false;
};

struct LibraryReport {
  int clips = 0;  // in the library now
  int added = 0;
  int unchanged = 0;  // already there (same content), when adding
  int resumed = 0;    // taken from a build that was stopped
  int sequences = 0;
  int spaces = 0;
  int functions = 0;               // most of a curve: of the largest group of all sets
  int all_functions = 0;           // over all groups, sets and spaces
  double variance = 0;             // share covered, least of all spaces ...
  double movement = 0;             // ... and of each curve's about its own mean
  double mean_joint_error_cm = 0;  // of decoding the added clips with all functions
  double max_joint_error_cm = 0;
  std::int64_t frames = 0;
  double seconds = 0;         // of the library
  std::int64_t cycles = 0;    // whole ones in it ...
  double cyclic_seconds = 0;  // ... and how long they last together
  bool warped = false;        // whether warps of motion that was cut at rests won on held-out clips
  std::int64_t bytes = 0;
  std::vector<std::string> doubts;  // what looks wrong in clips (motion/plausibility.h), a line a kind
  std::vector<std::string> notes;   // what readers chose or passed over
  std::vector<BadFile> bad;         // left out
};

// Every motion file among the arguments: files as they are, folders with all below them; sorted, each once. Throws
// Error{bad_input} for what is not there and when nothing is found.
[[nodiscard]] std::vector<std::filesystem::path> find_motion_files(const std::vector<std::filesystem::path>& arguments);

// Names for clips: the file name without its ending; where two are equal, with as many folders in front as tell them
// apart.
[[nodiscard]] std::vector<std::string> clip_names(const std::vector<std::filesystem::path>& files);

// What the name says: its parts between underscores that are no numbers ("walk_happy_012" -> walk, happy).
[[nodiscard]] std::vector<std::string> labels_of(const std::string& name);

// All clips of the files; of a file that holds several each, named "FILE.ANIMATION".
[[nodiscard]] LibraryReport build_library(const std::vector<std::filesystem::path>& files,
                                          const std::filesystem::path& target, const LibraryBuilderOptions& options,
                                          const Compute& compute = {}, const Progress& progress = {});

}  // namespace kinespace
