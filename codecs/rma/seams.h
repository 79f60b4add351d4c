// Steps taken out where clips of an approximated motion meet (lin2011, section 5.5; arikan 2006): both sides come to
// the middle, in place and in speed.
//
// At a seam between frames b - 1 and b both sides are followed to the moment between them; they miss each other by a
// gap g and their speeds by v. With tau the distance from there in frames and u = tau / reach below 1,
//
//   left    x + g/2 (1 - u)^2 (1 + 2 u) - v/2 tau (1 - u)^2
//   right   x - g/2 (1 - u)^2 (1 + 2 u) - v/2 tau (1 - u)^2
//
// which is smooth and touches nothing beyond `reach`. A side of a single frame has no speed of its own: it takes the
// other's.
#pragma once

#include <functional>
#include <span>
#include <vector>

namespace kinespace {

class SeamSmoother {
 public:
  // A frame as it is without smoothing.
  using Raw = std::function<void(int frame, std::span<double> out)>;

  // Frames are vectors of `dimensions` numbers. `seams`: the first frames of later clips, ascending, within (0,
  // frames); `reach`: in frames; between two seams it is at most half of the way. `breaks`: ascending; first frames
  // that are not to go on from those before them, which nothing reaches across.
  SeamSmoother(int dimensions, int frames, std::span<const int> seams, double reach, Raw raw,
               std::span<const int> breaks = {});

  // Whether apply would change it.
  [[nodiscard]] bool touches(int frame) const;
  // Adds the correction of a frame to `values`. Frames must come in rising order.
  void apply(int frame, std::span<double> values);

 private:
  struct Seam {
    int frame = 0;
    double left = 0;  // reach
    double right = 0;
    bool one_left = false;  // of a single frame
    bool one_right = false;
  };
  void load(const Seam& seam);

  std::vector<Seam> seams_;
  Raw raw_;
  std::size_t next_ = 0;  // the first seam that still reaches
  std::size_t loaded_;
  std::vector<double> gap_;
  std::vector<double> slope_;
  std::vector<double> left_;
  std::vector<double> right_;
  std::vector<double> beyond_;
};

}  // namespace kinespace
