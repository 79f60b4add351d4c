// Clips in glTF 2.0, for viewers, engines and the web (Khronos glTF 2.0 specification: metres, Y up, right-handed; our
// centimetres times 0.01).
//
// What is written:
//  - a node for each joint and each end site, posed as in the first frame, named as in the skeleton;
//  - one animation, times from 0 s: a LINEAR rotation sampler for every joint that turns, a translation sampler for
//    every joint with a translation track. Quaternions keep the hemisphere of the frame before, so that players which
//    interpolate take the short way. A joint that keeps its pose has no sampler; joint 0 always has one, so that the
//    clip's duration is there;
//  - one small skinned mesh, an octahedron a bone, so that viewers show something.
// What a file cannot hold is lost: channel orders, and exact doubles (glTF has 32-bit floats: 1e-5 cm within a few
// metres of the origin).
//
// What is read:
//  - the joints of the skins in the default scene, in the skins' order where that has parents first; without a skin, the
//    nodes that animations move, with all below them. Nodes between joints and above them are folded into the joint
//    below, matrices and scales of nodes too. Joint trees that share no node hang on a joint of the scene's name;
//  - in frames in which the bind pose has no rotations, as in BVH: that of the inverse bind matrices, else the nodes as
//    they stand. A node without children, mesh and animation below a leaf is its end site;
//  - animations as clips, sampled (STEP, LINEAR with slerp, CUBICSPLINE) from the first key to the last at the rate of
//    the keys: that of the channel with most keys when these are even, all keys lie on it, and it is 10 Hz or more or
//    all channels share those keys; else the first of 30, 24, 25, 60, 50, 48, 120, 100, 90, 72 and 240 Hz on which all
//    keys lie, else 30 Hz, with a note; options.rate_hz goes before all of these. A file without animations is one frame, the nodes as they stand;
//  - three rotation channels for each joint; positions for joint 0 and for those that an animation of the file moves by
//    more than 0.01 cm. Scales that are animated, or that differ between axes, stretch bones: translations then. Where
//    joints are is exact in all of these cases; their rotations are the products of those of the nodes.
// Sparse accessors, normalised integers, KHR_mesh_quantization and EXT_meshopt_compression are read, meshes (and how
// they are compressed), pictures and materials passed over; a file that requires another extension is refused by its
// name. Memory is bounded by the size of the file (gltf/budget.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/motion/clip.h"
#include "kinespace/motion/read_options.h"

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

// The animation that `options` name, else the first or all. A clip is called after the file, and the animation where the
// file has several: "file.walk". Buffers of a .gltf file are looked for beside `file` (gltf/detail/buffers.h). Throws
// Error{bad_input}.
[[nodiscard]] std::vector<Clip> parse_gltf(std::string_view bytes, const std::filesystem::path& file,
                                           const ClipReadOptions& options = {}, ClipsWanted wanted = ClipsWanted::one);
[[nodiscard]] std::vector<Clip> read_gltf(const std::filesystem::path& path, const ClipReadOptions& options = {},
                                          ClipsWanted wanted = ClipsWanted::one);

// What the animations of a file are called (gltf/animation.h), without reading them. Throws Error{bad_input}.
[[nodiscard]] std::vector<std::string> gltf_clips(const std::filesystem::path& path);

}  // namespace kinespace
