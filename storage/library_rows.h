// What a library holds, as plain rows. The blobs are bitstreams (storage/bitstream.h) that bring their own checksums;
// what is in them is the business of whoever wrote them.
//
// Names and texts are UTF-8 of any length, with any characters.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kinespace/base/bytes.h"

namespace kinespace {

// A skeleton as a file had it, with its own offsets. Clips that share it to the bit share the row.
struct SkeletonRow {
  std::int64_t id = 0;    // given by the library
  std::string name;       // for people: the first file that brought it
  std::string tree_hash;  // of names, parents and channels: what the clips of one space have in common
  Bytes blob;
};

// A motion space: a basis and what belongs to it.
struct SpaceRow {
  std::int64_t id = 0;    // given by the library
  std::string name;       // unique
  std::string tree_hash;  // of the skeletons of its clips
  Bytes blob;             // left empty by Library::spaces
};

// A clip without its blobs: what a listing needs.
struct ClipRow {
  std::int64_t id = 0;  // given by the library, ascending in the order of adding
  std::int64_t space_id = 0;
  std::int64_t skeleton_id = 0;
  std::string name;                 // unique
  std::string source;               // the file it came from, as the user named it
  std::string source_hash;          // content_hash of that file: base/file.h
  double rate_hz = 0;               // > 0
  std::int64_t frames = 0;          // >= 1, at rate_hz
  std::vector<std::string> labels;  // in the order given
};

// The blobs of a clip; empty ones are stored as such.
struct ClipBlobs {
  Bytes vectors;                 // the motion vectors of its sequences
  Bytes warps;                   // the time warps of its sequences
  Bytes side;                    // start, heading, displacement, translations: what the curves leave out
  std::vector<float> retrieval;  // the one vector that queries search: as long as those of the space's other clips
};

enum class ClipBlob { vectors, warps, side };

// The retrieval vectors of a space in one block: row i belongs to clip_ids[i]; ids ascend.
struct RetrievalMatrix {
  std::vector<std::int64_t> clip_ids;
  std::size_t dimensions = 0;  // floats in a row; 0 when there are no clips
  std::vector<float> values;   // clip_ids.size() * dimensions
};

struct LibraryTotals {
  std::int64_t skeletons = 0;
  std::int64_t spaces = 0;
  std::int64_t clips = 0;
  std::int64_t frames = 0;
  double seconds = 0;  // of all clips together, frames / rate_hz
  std::int64_t space_bytes = 0;
  std::int64_t vector_bytes = 0;
  std::int64_t warp_bytes = 0;
  std::int64_t side_bytes = 0;
  std::int64_t retrieval_bytes = 0;
  std::int64_t artifact_bytes = 0;
  std::int64_t file_bytes = 0;
};

}  // namespace kinespace
