// Motion files in and out, by their ending (motion/file_formats.h).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "kinespace/motion/clip.h"
#include "kinespace/motion/read_options.h"

namespace kinespace {

// Reads a clip; .amc with its .asf: `companion` when given, else the .asf file beside it whose name starts the AMC's
// (01_02.amc -> 01.asf; the longest such name), else the only .asf in the folder. Throws Error.
[[nodiscard]] Clip read_clip(const std::filesystem::path& path,
                             const std::optional<std::filesystem::path>& companion = {});

// The same, with choices: of a file that holds several clips (glTF) the one that is chosen, else the first.
[[nodiscard]] Clip read_clip(const std::filesystem::path& path, const ClipReadOptions& options);

// All clips of a file, or the one that is chosen; named after the file, with the animation's name behind it ("file.walk")
// where there are several. Throws Error.
[[nodiscard]] std::vector<Clip> read_clips(const std::filesystem::path& path, const ClipReadOptions& options = {});

// The names of the clips in a file that holds several, in the order of read_clips; one empty name where there is one clip.
// Throws Error.
[[nodiscard]] std::vector<std::string> clips_of_file(const std::filesystem::path& path);

// Writes a clip; .amc with an .asf beside it. The file is whole or not there. Throws Error.
void write_clip(const std::filesystem::path& path, const Clip& clip);

// The files that read_clip would read, and those that write_clip would write: an .amc goes with an .asf. For a caller
// who must not overwrite an input. Throw Error: no skeleton beside an .amc, an ending that cannot be written.
[[nodiscard]] std::vector<std::filesystem::path> files_read(const std::filesystem::path& path,
                                                            const std::optional<std::filesystem::path>& companion = {});
[[nodiscard]] std::vector<std::filesystem::path> files_written(const std::filesystem::path& path);

// True for endings that read_clip takes.
[[nodiscard]] bool is_motion_file(const std::filesystem::path& path);

}  // namespace kinespace
