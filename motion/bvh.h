// BVH (Biovision hierarchy) files to clips and back.
//
// Format: M. Meredith, S. Maddock, Motion capture file formats explained, 2001. What real files do beyond it is read
// too:
//  - any channel order and count, 0 to 6 a joint, no channel twice; the rotation channels apply left to right;
//  - position channels on any joint replace its OFFSET as a whole (an axis without a channel is 0). Where they vary
//    they become a translation track; where they stay the same over the clip they become the joint's offset and no
//    track;
//  - words in any case, names with spaces (runs of white space become one space), equal names, tabs, LF, CR LF and CR,
//    a byte order mark, no newline at the end, End Sites anywhere (kept on leaves, where they mean something).
//
// One frame is one line. A frame time within 5e-5 of one over a whole number is that rate: 0.0333333 is 30 Hz.
//
// What is wrong and can be mended is, with a note, unless options.strict:
//  - the lines decide how many frames there are, whatever "Frames:" says; a last line that is cut short is left out;
//  - no frame at all, where "Frames: 0" says so: the rest pose, one frame;
//  - a line with "nan" in it is a lost frame: the one before stands there, and options.lost is told;
//  - a frame time of 10 to 1000 is a rate; one that is a usual rate's, rounded to the decimals that it has, is that
//    rate's: 0.033 is 30 Hz. options.rate_hz goes before any frame time;
//  - an End Site with channels is a joint "PARENT end".
//
// Units: a BVH has none. Its lengths are taken as centimetres, its angles are degrees, its Y is up.
//
// Bad input throws Error{bad_input} with file and line: a word out of place, a line with too few or too many numbers,
// inf, a number beyond 1e9, no channels at all, more than 1000 levels of joints, UTF-16, a small file that would need
// much memory.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/motion/clip.h"
#include "kinespace/motion/read_options.h"

namespace kinespace {

// `source_name` stands in messages; the clip is named after it, without folder and ending.
[[nodiscard]] Clip parse_bvh(std::string_view text, const std::string& source_name,
                             const ClipReadOptions& options = {});
[[nodiscard]] Clip read_bvh(const std::filesystem::path& path);
// Of a file with several ROOTs each is a clip, NAME.1 and so on; options.animation is a number or the name of a ROOT.
[[nodiscard]] std::vector<Clip> read_bvh(const std::filesystem::path& path, const ClipReadOptions& options,
                                         ClipsWanted wanted);
// "1", "2", ... one for each ROOT.
[[nodiscard]] std::vector<std::string> bvh_clips(const std::filesystem::path& path);

// The clip as BVH. Channels are the skeleton's own, more where they could not hold the motion (motion/euler.h,
// channels_to_write). Angles are continuous from frame to frame, through gimbal lock too; numbers of the motion have 6
// decimals, which moves no joint of a body by more than 2e-5 cm. A leaf without an end site gets one of length zero, as
// the format wants; braces and control characters in names become '_'.
[[nodiscard]] std::string format_bvh(const Clip& clip);
// The file is whole or not there. Throws Error.
void write_bvh(const std::filesystem::path& path, const Clip& clip);

}  // namespace kinespace
