// What the command says: results on standard output, everything else on standard error.
//
// All of both goes through here, and nothing that a terminal would obey comes out: names from files may hold anything.
// A name that is put into a line goes through printable() (base/printable.h) besides, so that it adds no lines.
//
// Neither ever throws or ends the work. A result that could not be written is found at the end, by finish_output; what
// standard error does not take is lost, and the exit code tells what became of the work.
#pragma once

#include <cstdio>
#include <string_view>

#include <fmt/format.h>

#include "kinespace/base/printable.h"

namespace kinespace::cli {

// Descriptors 0 to 2 that the caller closed are opened on /dev/null, before a file of ours could get one of their
// numbers. What is printed to a closed standard output counts as not written.
void open_standard_descriptors();

// As it is, whatever is in it.
void write_text(std::FILE* stream, std::string_view text) noexcept;

// Line feeds stay.
template <typename... T>
void print(fmt::format_string<T...> format, T&&... values) {
  write_text(stdout, printable_lines(fmt::format(format, std::forward<T>(values)...)));
}

// A line "kinespace: TEXT" on standard error.
void tell(std::string_view text) noexcept;

// Whether everything printed has reached the other side of standard output.
[[nodiscard]] bool finish_output() noexcept;

}  // namespace kinespace::cli
