// What a stream of the default profile holds, and the way back from it to clips.
//
// Sections:
//
//   clips    as in clip_table.h
//   tables   pose_space_tables.h: step, basis, spectrum of windows that stand for themselves
//   repeats  predictions by window, seams that are jumps, contacts; with predictions the spectrum and the start of the
//            models of predicted windows
//   windows  a code for each group of about 4096 frames: first of the windows that stand for themselves, then of the
//            predicted ones, each decodable without other groups
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "kinespace/codecs/pose_space/pose_space_tables.h"
#include "kinespace/codecs/rma/contact_trajectories.h"
#include "kinespace/codecs/rma/detail/seam_easing.h"
#include "kinespace/codecs/rma/detail/window_prediction.h"
#include "kinespace/codecs/stream/clip_table.h"

namespace kinespace {

// How long a contact fades out: longer than the paper's, as coarser postures are farther off.
inline constexpr double contact_blending_s = 0.15;

struct RepeatTables {
  PoseSpaceTables tables;
  CoefficientTables predicted;
  std::vector<WindowPrediction> predictions;       // by window
  std::vector<bool> jumps;                         // by window: it does not go on from the one before
  std::vector<std::vector<ContactCode>> contacts;  // by clip
  int seam_limit_cm_s = 0;                         // of seam_easing.h, 0 to most_seam_limit
};

[[nodiscard]] Bytes pack_repeats(const RepeatTables& tables, const ClipTable& clips);
// Fills all but `tables`. Throws Error{bad_input} naming `source`.
void unpack_repeats(std::span<const std::byte> bytes, const ClipTable& clips, std::int64_t numbers,
                    const std::string& source, RepeatTables& out);
[[nodiscard]] std::int64_t numbers_in(const RepeatTables& tables);

// Windows and groups, in both of the spectra.
struct RepeatLayout {
  WindowLayout plain;
  WindowLayout predicted;

  RepeatLayout(const ClipTable& clips, const RepeatTables& tables);
  [[nodiscard]] const WindowPlace& window(std::size_t w, bool is_predicted) const {
    return (is_predicted ? predicted : plain).windows[w];
  }
  [[nodiscard]] std::size_t group_of(std::size_t w) const { return group_of_[w]; }

 private:
  std::vector<std::size_t> group_of_;
};

// The windows of a group that are coded together.
struct GroupPart {
  std::vector<std::size_t> windows;
  std::vector<CoefficientBlock> blocks;  // without values
  std::vector<std::size_t> offsets;      // into the values of the part
  std::size_t size = 0;
};
[[nodiscard]] GroupPart group_part(const RepeatLayout& layout, const RepeatTables& tables, std::size_t group,
                                   bool is_predicted);

// The values of the windows of a group as decoded, in quantiser steps.
struct RepeatGroup {
  std::array<std::vector<double>, 2> values;                // plain, predicted
  std::vector<std::pair<std::size_t, std::size_t>> places;  // by window of the group: offset, size
};

// From decoded values to pose vectors and clips.
class RepeatDecoder {
 public:
  using Groups = std::function<std::shared_ptr<const RepeatGroup>(std::size_t group)>;
  // All must outlive it.
  RepeatDecoder(const ClipTable& clips, const RepeatTables& tables, const RepeatLayout& layout, Groups groups,
                std::string source);

  // The vectors of a window, [dimension][points]. Throws Error{bad_input} when a prediction rests on another.
  [[nodiscard]] std::vector<double> window_vectors(std::size_t w) const;
  // What the window is predicted to be.
  [[nodiscard]] std::vector<double> predicted_vectors(std::size_t w) const;
  // Where its windows meet.
  [[nodiscard]] ClipSeams seams(std::size_t clip) const;
  // A whole clip, before its contacts are held to and seams eased, and after.
  [[nodiscard]] Clip decode_without_contacts(std::size_t clip) const;
  [[nodiscard]] Clip decode(std::size_t clip) const;

 private:
  [[nodiscard]] std::vector<double> plain_part(std::size_t w) const;

  const ClipTable& clips_;
  const RepeatTables& tables_;
  const RepeatLayout& layout_;
  Groups groups_;
  std::string source_;
  WindowSynthesis synthesis_;
};

}  // namespace kinespace
