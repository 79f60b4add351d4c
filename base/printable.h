// Text that came from a file, made fit for a terminal or for a file's name.
//
// Names of clips and joints, labels and paths are whatever bytes a file had. A terminal obeys some of them (ESC, CR,
// BEL, C1 controls), a line feed forges a line of output, marks that turn the direction of writing hide an ending; what
// is not UTF-8 breaks whoever reads on. JSON is another matter: it has escapes, and keeps the true name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace kinespace {

// On one line: each control character (C0, DEL, C1), line or paragraph separator and direction mark becomes a '?', and
// so does each byte that is not part of well-formed UTF-8. Letters of any language stay.
[[nodiscard]] std::string printable(std::string_view text);

// The same, but line feeds stay: for text that was put together from printable names, and whole tables.
[[nodiscard]] std::string printable_lines(std::string_view text);

// The first character of a text that is not empty.
struct CharacterOfText {
  std::uint32_t code = 0;
  std::size_t bytes = 1;     // that it takes, at least 1
  bool well_formed = false;  // as UTF-8; else a single byte
  bool obeyed = false;       // one that printable() replaces
};
[[nodiscard]] CharacterOfText first_character(std::string_view text);

// At most `bytes` of the text, cut between two characters of UTF-8.
[[nodiscard]] std::string_view cut_text(std::string_view text, std::size_t bytes);

// A name as one part of a path: never empty, ".", ".." or hidden, with no separator and no drive letter in front, at
// most 200 bytes; what printable() replaces becomes an underscore.
[[nodiscard]] std::string file_name_part(std::string_view name);

// A name with folders in it ("b/walk") as a relative path that stays below the folder it is put in: the parts between
// slashes, each as file_name_part has it, empty ones left out.
[[nodiscard]] std::string file_path_below(std::string_view name);

}  // namespace kinespace
