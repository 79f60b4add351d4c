// Clips to glTF 2.0, for viewers, engines and the web.
//
// What is written (Khronos glTF 2.0 specification, metres, Y up, right-handed; our centimetres times 0.01):
//  - a node for each joint and each end site, posed as in the first frame, named as in the skeleton;
//  - one animation, times from 0 s: a LINEAR rotation sampler for every joint that turns, a translation sampler for
//    every joint with a translation track. Quaternions keep the hemisphere of the frame before, so that players which
//    interpolate take the short way. A joint that keeps its pose has no sampler; joint 0 always has one, so that the
//    clip's duration is there;
//  - one small skinned mesh, an octahedron a bone, so that viewers show something.
//
// It is written only; there is no glTF reader. What a file cannot hold is lost: channel orders, and exact doubles (glTF
// has 32-bit floats: 1e-5 cm within a few metres of the origin).
#pragma once

#include <filesystem>
#include <string>

#include "kinespace/motion/clip.h"

namespace kinespace {

enum class GltfForm {
  text,    // .gltf: JSON with the numbers in it as base64, one file
  binary,  // .glb
};

// Throws Error{bad_input} when the clip is too large for one file: 2 GB of numbers, times that 32-bit floats cannot
// tell apart (8 million frames), 65536 joints.
[[nodiscard]] std::string format_gltf(const Clip& clip, GltfForm form);

// Binary when the path ends in .glb, else text. The file is whole or not there. Throws Error.
void write_gltf(const std::filesystem::path& path, const Clip& clip);

}  // namespace kinespace
