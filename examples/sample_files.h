// Sample motions as files: NAME.bvh, and NAME.json with what is known about it.
//
//   {"clip": "walk_fast_002", "file": "walk_fast_002.bvh", "frames": 180, "rate_hz": 60.0, "labels": ["walk", "fast"],
//    "contacts": [{"side": "left", "joint": "LeftFoot", "first_frame": 12, "last_frame": 30}, ...]}
//
// Frames count from 0; both ends are included. See Contact in sample_motions.h for what a contact is.
#pragma once

#include <filesystem>
#include <string>

#include "examples/sample_motions.h"

namespace kinespace {

// The JSON above.
[[nodiscard]] std::string describe_sample(const SampleMotion& motion);

// Writes both files into an existing folder, over older ones of the same name. Throws Error{machine}.
void write_sample(const std::filesystem::path& folder, const SampleMotion& motion);

}  // namespace kinespace
