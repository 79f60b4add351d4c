// mesh-harmonics, profile paper: chen2019 as printed, made safe.
//
// Frames are aligned to the first, clustered by k-medoids; the medoids are key-frames (Draco, one connectivity for
// all). Of each decoded key-frame the first K manifold harmonics; frames are K coefficients for each axis (least
// squares rather than the printed U' f), predicted by a linear prediction of second order of their own (eq. 6 and 7),
// from decoded values. Details come by deformation transfer from the key-frame (mesh/deformation.h), then the low
// frequencies are set right, which costs no bits. Key-frames themselves are what Draco gives.
//
//   setup                   layout, grid, size, step, functions, clusters; a checksum of each key-frame's harmonics
//   surface, order, rigid   as in harmonics_stream.h
//   clusters                the cluster of each frame, and the key-frames
//   a0, q0, a1, q1, ..      by cluster: prediction coefficients, and what they miss
#pragma once

#include <memory>

#include "kinespace/mesh_codecs/mesh_codec.h"

namespace kinespace {

[[nodiscard]] Bytes encode_paper_harmonics(const MeshSequence& mesh, const MeshCodecOptions& options);
// Throws Error{bad_input} also where the harmonics come out other than the encoder's.
[[nodiscard]] std::unique_ptr<MeshStreamReader> open_paper_harmonics(Bitstream stream, BasisCache* cache = nullptr);

}  // namespace kinespace
