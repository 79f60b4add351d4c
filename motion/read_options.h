// How a motion file is to be read, where it leaves a choice.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace kinespace {

// Of a file that holds several clips.
enum class ClipsWanted : std::uint8_t {
  one,  // the one that is chosen, else the first
  all,  // in the file's order; the one that is chosen, where one is
};

struct ClipReadOptions {
  std::optional<std::filesystem::path> companion;  // the .asf of an .amc; else found beside it
  std::string animation;                           // one of several in the file, by its name or its number from 1
  bool strict = false;  // what is mended otherwise, with a note, is an error: a frame count that is wrong, say
  std::optional<double> rate_hz;  // instead of the file's own, frames a second; > 0
  // Told which frames the file has not, first and last, both included: the frame before stands there.
  std::function<void(int first, int last)> lost;
  // Told what the reader chose or passed over, a sentence a call. Empty: nobody listens.
  std::function<void(const std::string& what)> note;
};

}  // namespace kinespace
