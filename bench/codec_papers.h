// The tables and figures of khan2014, which compares codecs, remade on the clips given. Part of `kinespace bench codecs`.
#pragma once

#include <span>
#include <vector>

#include "bench/codec_sweep.h"
#include "bench/report.h"

namespace kinespace {

// All codecs' sweeps of one clip.
struct ClipSweep {
  std::string clip;
  std::vector<std::vector<CodecPoint>> codecs;  // in the order of all_codecs()
};

[[nodiscard]] ClipSweep sweep_clip(const std::filesystem::path& path);

// One row a point, and the rate-distortion plots: bytes a frame over mean joint error.
void add_sweep(const ClipSweep& sweep, BenchReport& report);

// khan2014: table 4 (every codec at qbc's error), figure 11 (ratio over error, a clip a picture), figures 17 and 18
// (the limit of the squared distance over ratio and over error); and whether qbc is ahead at every point of its sweep.
void add_khan2014(std::span<const ClipSweep> sweeps, BenchReport& report);

}  // namespace kinespace
