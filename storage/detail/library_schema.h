// The tables of a library file and of the keep of an unfinished build, and the check that a file has them.
// Internal to storage/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "kinespace/storage/detail/sqlite.h"

namespace kinespace::schema {

struct Table {
  std::string_view name;
  std::string_view sql;  // as SQLite keeps it, so that a file can be held to it to the letter
};

// A kind of database file of ours.
struct Format {
  std::int32_t application_id;
  std::int32_t version;
  std::span<const Table> tables;
};

// The file that users have (LIB.kspace), and what a build keeps beside it until it is done (LIB.kspace.partial).
[[nodiscard]] const Format& library();
[[nodiscard]] const Format& keep();

// Makes the tables in an empty database.
void make(sqlite::Database& database, const Format& format);

// Copies the rows of every table, keys and all, from a database that was checked into one that was just made: nothing
// of the old file but its rows comes along. One row is in memory at a time. Throws Error{bad_input} for rows that the
// tables do not take, as only a damaged file has them.
void copy_rows(sqlite::Database& from, sqlite::Database& to, const Format& format);

// Throws Error{bad_input} when the file is of another application, newer or cut short, or when it has anything but our
// tables and the indices that SQLite makes for their keys: no other table, index, view or trigger, whoever added it.
void check(sqlite::Database& database, const Format& format);

// Whether a file that starts so is marked as of that format.
[[nodiscard]] bool is_marked(std::span<const std::byte> start, const Format& format);
// Whether it may have been any SQLite database before it was cut.
[[nodiscard]] bool may_be_database(std::span<const std::byte> start);

}  // namespace kinespace::schema
