#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "kinespace/mesh/detail/mesh_formats.h"
#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& name, const Progress& progress)
      : source_(text, name), progress_(progress), at_(source_.begin()) {}

  MeshFrame read() {
    for (std::size_t line = 0; at_ != source_.end(); ++line) {
      if (line % 65536 == 0) progress_.check_stop();
      skip_blanks();
      const std::string_view word = word_at(at_, source_.end());
      if (word == "v") {
        at_ += 1;
        read_vertex();
      } else if (word == "f") {
        at_ += 1;
        read_face();
      }
      skip_line();
    }
    if (out_.positions.empty()) source_.fail(source_.end(), "no vertices", "lines that begin with v");
    // Faces may come before their vertices.
    const auto vertices = static_cast<std::int64_t>(out_.positions.size() / 3);
    if (highest_ > vertices) {
      source_.fail(highest_at_, fmt::format("vertex {}", highest_), fmt::format("1 to {}", vertices));
    }
    return std::move(out_);
  }

 private:
  void skip_blanks() {
    while (at_ != source_.end() && is_blank(*at_)) ++at_;
  }
  void skip_line() {
    while (at_ != source_.end() && !is_line_end(*at_)) ++at_;
    while (at_ != source_.end() && is_space(*at_)) ++at_;
  }

  void read_vertex() {
    for (int c = 0; c < 3; ++c) {
      skip_blanks();
      double x = 0;
      const char* const end = scan_number(at_, source_.end(), x);
      if (end == nullptr || !(std::abs(x) <= largest_coordinate)) source_.fail_at_word(at_, "a coordinate of a vertex");
      out_.positions.push_back(static_cast<float>(x));
      at_ = end;
    }
    if (out_.positions.size() / 3 > static_cast<std::size_t>(most_vertices)) {
      source_.fail(at_, "too many vertices", fmt::format("at most {}", most_vertices));
    }
  }

  std::int32_t read_index() {
    const auto vertices = static_cast<std::int64_t>(out_.positions.size() / 3);
    const char* const word = at_;
    const bool relative = at_ != source_.end() && *at_ == '-';
    if (relative) ++at_;
    std::int64_t index = 0;
    const char* const digits = at_;
    for (; at_ != source_.end() && is_digit(*at_) && index <= most_vertices; ++at_) index = index * 10 + (*at_ - '0');
    if (at_ == digits) source_.fail_at_word(word, "the number of a vertex");
    if (relative) index = vertices + 1 - index;
    if (index < 1 || index > most_vertices) source_.fail_at_word(word, "the number of a vertex, from 1");
    while (at_ != source_.end() && !is_space(*at_)) ++at_;  // texture and normal
    if (index > highest_) {
      highest_ = index;
      highest_at_ = word;
    }
    return static_cast<std::int32_t>(index - 1);
  }

  void read_face() {
    std::int32_t first = 0, before = 0;
    int corners = 0;
    for (;; ++corners) {
      skip_blanks();
      if (at_ == source_.end() || is_line_end(*at_)) break;
      const std::int32_t v = read_index();
      if (corners == 0) first = v;
      if (corners >= 2) out_.triangles.push_back({first, before, v});
      before = v;
    }
    if (corners < 3) source_.fail(at_, fmt::format("a face with {} vertices", corners), "three or more");
  }

  TextSource source_;
  const Progress& progress_;
  const char* at_;
  MeshFrame out_;
  std::int64_t highest_ = 0;
  const char* highest_at_ = nullptr;
};

}  // namespace

MeshFrame parse_obj(std::string_view text, const std::string& name, const Progress& progress) {
  return ObjReader(text, name, progress).read();
}

std::string format_obj(std::span<const float> positions, std::span<const Triangle> triangles) {
  std::string out;
  for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
    // fmt writes the shortest text that reads back as the same float, whatever the locale.
    fmt::format_to(std::back_inserter(out), "v {} {} {}\n", positions[i], positions[i + 1], positions[i + 2]);
  }
  for (const Triangle& t : triangles) {
    fmt::format_to(std::back_inserter(out), "f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  }
  return out;
}

}  // namespace kinespace
