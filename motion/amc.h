// AMC (Acclaim motion) files, with their ASF, to clips and back.
//
// A frame is a line with its number, then a line for the root and one for each bone with dofs, in any order. Frame
// numbers go up by one; the first may be any. Unless options.strict they may also go up by another step, which divides the
// rate, or leave frames out: the frame before stands there, and options.lost is told; both with a note. ":DEGREES", ":RADIANS" and ":SAMPLES-PER-SECOND n" are heeded, other ':'
// lines and '#' comments passed over. A file without a rate is at 120 Hz, as all of CMU's are.
//
// Bad input throws Error{bad_input} with file and line: a bone that the ASF does not have, missing in a frame, twice in
// one, or with too few or too many values; numbers that are none, nan or beyond 1e9; a frame number out of order; no
// frame.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "kinespace/motion/asf.h"
#include "kinespace/motion/clip.h"
#include "kinespace/motion/read_options.h"

namespace kinespace {

// `source_name` stands in messages; the clip is named after it, without folder and ending.
[[nodiscard]] Clip parse_amc(std::string_view text, const Asf& asf, const std::string& source_name,
                             const ClipReadOptions& options = {});
[[nodiscard]] Clip read_amc(const std::filesystem::path& amc, const std::filesystem::path& asf,
                            const ClipReadOptions& options = {});

// Any clip as ASF and AMC, world positions kept to 2e-5 cm (6 decimals of centimetres and degrees):
//  - joint 0 becomes "root", the others keep their names, with '_' for what the format cannot hold and a number behind
//    a name that comes twice;
//  - all axes are zero and lengths in cm (`length 2.54`, so that a unit is a centimetre); a bone that rotates has the
//    dofs rx ry rz, one with a translation track has tx ty tz before them;
//  - an ASF has no gaps: all children of a bone start at its end. A joint whose children start at different places gets
//    rigid helper bones named PARENT_to_CHILD, which read back as joints of their own.
struct AcclaimText {
  std::string asf;
  std::string amc;
};
[[nodiscard]] AcclaimText format_amc(const Clip& clip);

// Writes `amc` and, before it, the file of the same name with the ending .asf. Each is whole or not there. Throws
// Error.
void write_amc(const std::filesystem::path& amc, const Clip& clip);

}  // namespace kinespace
