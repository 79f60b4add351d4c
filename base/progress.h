// How long work tells how far it is and learns that it should stop. Both are optional: a default Progress is silent.
#pragma once

#include <functional>
#include <string_view>

namespace kinespace {

struct Progress {
  // Called from the thread that does the work, with the stage's name and its done fraction in [0, 1].
  std::function<void(std::string_view stage, double done)> report;
  // Asked between units of work; true makes the work stop early and throw Interrupted.
  std::function<bool()> stop_requested;

  void at(std::string_view stage, double done) const {
    if (report) report(stage, done);
  }
  void check_stop() const;
};

// Thrown when Progress::stop_requested said so. Nothing half-written is left behind.
struct Interrupted {};

inline void Progress::check_stop() const {
  if (stop_requested && stop_requested()) throw Interrupted{};
}

}  // namespace kinespace
