// The streams of clips in fixtures/, which every build decodes to the same bits: what they were made of, and how.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kinespace/base/file.h"
#include "kinespace/codecs/pose_space/pose_space_basis.h"
#include "kinespace/codecs/registry.h"
#include "tests/codecs/sample_stream.h"

namespace kinespace::test {

// Two walks of which the first goes on for some steps, so that there is something to repeat, and two gestures.
inline std::vector<Clip> clip_fixture_sample() {
  const std::vector<Clip>& clips = sample_clips();
  std::vector<Clip> out;
  for (const auto& [clip, frames] : {std::pair<std::size_t, int>{0, 150}, {1, 60}, {6, 50}, {11, 50}}) {
    out.push_back(slice(clips[clip], 0, std::min(frames, clips[clip].frames)));
  }
  return out;
}

// The tables that one of the streams leaves out.
inline std::filesystem::path basis_fixture() {
  return std::filesystem::path(KINESPACE_FIXTURES) / "motion_space_basis_v1.bin";
}

inline PoseSpaceBasis basis_of_fixture() {
  const FileContent file(basis_fixture());
  return PoseSpaceBasis::unpack(file.bytes(), basis_fixture().string());
}

struct ClipFixture {
  std::string name;
  std::string codec;
  CodecOptions options;
  std::uint64_t values = 0;  // decoded_checksum
  std::size_t clips = 4;     // the first so many of the sample
  bool with_basis = false;

  [[nodiscard]] std::filesystem::path path() const {
    return std::filesystem::path(KINESPACE_FIXTURES) / (name + "_v1.ksm");
  }
};

inline std::vector<ClipFixture> clip_fixtures() {
  const CodecTarget half{.mean_error_cm = 0.5};
  return {{"motion_space", "motion-space", {.target = half}, 0x549ac9701289dcf},
          {"motion_space_max", "motion-space", {.target = {.max_error_cm = 1}}, 0x90128b5defff4cf0},
          {.name = "motion_space_with_basis",
           .codec = "motion-space",
           .options = {.target = half},
           .values = 0xf4902b0c3093a08c,
           .with_basis = true},
          {"rma", "rma", {.target = half}, 0x20d32907e81ac71e},
          {"rma_plain", "rma", {.target = half, .settings = {{"repeats", 0}, {"contacts", 0}}}, 0x1e8c3c54e986391},
          {"rma_paper", "rma", {.target = {.mean_error_cm = 2}, .settings = {{"profile", 1}}}, 0xeddc80f5434b9427},
          {"clip_pca", "clip-pca", {.target = half}, 0x66afde3ee8038913},
          {"qbc", "qbc", {.target = half}, 0x13b78c0689221706},
          {"qbc_paper", "qbc", {.settings = {{"merge", 0}}}, 0xacd8a9d9cfcc3db1},
          {"pca", "pca", {.target = half}, 0x1a150bf2593257c9},
          {"dwt", "dwt", {.target = half}, 0x1ecc9bb1575974a0},
          {"awt", "awt", {.target = half}, 0x6e6c0cc4a17b5b30},
          {"fourier", "fourier", {.target = half}, 0x4117c62fef63025f},
          {"legendre", "legendre", {.target = half}, 0x5457993277bdcaf1},
          {.name = "raw_zstd", .codec = "raw+zstd", .values = 0xf0d28bc48a30ca86, .clips = 1},
          {.name = "raw_xz", .codec = "raw+xz", .values = 0xf0d28bc48a30ca86, .clips = 1}};
}

// XXH3 of all that a decoded clip holds in numbers, over all clips.
inline std::uint64_t decoded_checksum(std::span<const Clip> clips) {
  std::vector<double> values;
  for (const Clip& clip : clips) {
    values.insert(values.end(), clip.rotations.begin(), clip.rotations.end());
    for (const auto& track : clip.translations) {
      for (const Eigen::Vector3d& at : track.values) values.insert(values.end(), at.begin(), at.end());
    }
  }
  return checksum64(std::as_bytes(std::span(values)));
}

}  // namespace kinespace::test
