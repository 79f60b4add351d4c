// A text that tells how often it is gone over.
//
// It lies in pages that cannot be read. Touching one raises SIGSEGV, whose handler opens the part around it, closes the
// one that was opened longest ago, and counts. What reads the text once, front to back, opens each part once; what goes
// back over it opens more.
#pragma once

#include <cstddef>
#include <string_view>

namespace kinespace::test {

class WatchedText {
 public:
  // One at a time.
  explicit WatchedText(std::string_view text);
  ~WatchedText();
  WatchedText(const WatchedText&) = delete;
  WatchedText& operator=(const WatchedText&) = delete;

  [[nodiscard]] std::string_view text() const { return {begin_, size_}; }
  [[nodiscard]] std::size_t parts() const;
  [[nodiscard]] std::size_t opened() const;

 private:
  char* begin_;
  std::size_t size_;
};

}  // namespace kinespace::test
