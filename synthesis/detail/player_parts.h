// What a Player keeps of a clip, and where in it a time is. Private to this folder.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "kinespace/base/aligned.h"
#include "kinespace/synthesis/player.h"

namespace kinespace {

struct PlayerParts {
  struct Sequence {
    int first = 0;
    int intervals = 0;
    int set = 0;   // of the basis
    int rows = 0;  // of scores: those behind are 0
    int extra_detail = 0;
    bool warped = false;
    bool joined_before = false;  // begins at a cut
    bool joined_after = false;   // ends at one
    float duration_s = 0;
    float steepness = 0;                                  // of Fade::slope
    std::array<float, PlaybackBasis::warp_terms> warp{};  // a_0 = 1, a_1 .. a_5
    Eigen::Vector3d start = Eigen::Vector3d::Zero();      // metres, in the clip's frame
    std::array<float, 3> travel{};                        // metres
    // Into scores: [function][component w x y z][lane], then four of the velocity, as one row: what a pose reads of a
    // sequence is one piece of memory.
    std::size_t scores = 0;
    std::size_t inverse = 0;  // into scores, before them: value and slope of the warp's inverse at 0, 1/64, .., 1
    std::size_t cut = 0;      // into cuts: the correction where it ends, when joined_after
  };
  // How many rows a sequence has at a level of detail.
  [[nodiscard]] int rows_at(const Sequence& sequence, int level) const {
    const int own = std::min(EncodedSequence{.extra_detail = sequence.extra_detail}.level(level), basis->levels());
    return std::min(sequence.rows, basis->rows_at(sequence.set, own));
  }
  struct Place {
    std::size_t sequence = 0;
    double own = 0;  // [0, 1] of the sequence's own time
    int cell = 0;    // of the space's grid
    float b = 0;     // [0, 1] within it
  };

  static constexpr int inverse_cells = 64;

  std::shared_ptr<const PlaybackBasis> basis;
  PlayerOptions options;
  double rate_hz = 0;
  int frames = 0;
  int joints = 0;
  int lanes = 0;                                       // joints, rounded up to whole vectors
  Eigen::Vector3d start_cm = Eigen::Vector3d::Zero();  // of the clip
  float turn_cosine = 1;                               // of half its heading
  float turn_sine = 0;
  std::vector<Sequence> sequences;
  AlignedVector<float> scores;
  AlignedVector<float> cuts;  // [level 0 .. all][values 4 lanes, slopes 4 lanes, slopes of the root's place 4]
  int bucket = 1;             // frames
  std::vector<int> at;        // the sequence at the first frame of each bucket

  PlayerParts(std::shared_ptr<const PlaybackBasis> basis, const EncodedClip& clip, const PlayerOptions& options);
  [[nodiscard]] static const PlayerParts& of(const Player& player) { return *player.parts_; }

  // Floats of the rotations in a row, and of all of it: whole cache lines.
  [[nodiscard]] std::size_t rotation_floats() const { return 4 * static_cast<std::size_t>(lanes); }
  [[nodiscard]] std::size_t score_stride() const { return rotation_floats() + PlaybackBasis::lanes; }
  // A cut's corrections at a level: values, slopes before it, slopes after it.
  [[nodiscard]] std::size_t slope_floats() const { return rotation_floats() + PlaybackBasis::lanes; }
  [[nodiscard]] std::size_t cut_stride() const { return rotation_floats() + 2 * slope_floats(); }
  [[nodiscard]] int level(int functions) const {
    return functions < 0 || functions > basis->levels() ? basis->levels() : functions;
  }
  // How many of the a_j of a sequence's warp count.
  [[nodiscard]] static int warp_terms(const Sequence& sequence) {
    return sequence.warped ? PlaybackBasis::warp_terms : 1;
  }

  [[nodiscard]] double frame_at(double time_s) const;
  [[nodiscard]] Place place_at(double time_s) const;
  [[nodiscard]] Place place_in(std::size_t sequence, double own) const;
  // Metres in the clip's frame to the world's cm; and the root's orientation (w x y z) to the world's.
  [[nodiscard]] Eigen::Vector3f world_place(const Sequence& sequence, const float* from_start) const;
  void turn_root(float* rotation) const;

 private:
  void add_sequence(const EncodedSequence& encoded, double rate_hz, const Eigen::Vector3d& start);
  void add_cuts(std::size_t first, const EncodedRun& run);
  void put_slopes(const Eigen::RowVectorXd& by_curve, float* out) const;
  void index_times();
};

}  // namespace kinespace
