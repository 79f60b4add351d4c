#include "kinespace/storage/detail/library_schema.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "kinespace/storage/detail/library_version.h"

namespace kinespace::schema {
namespace {

// Rows of clips are kept small and their blobs apart, each kind in a table of its own: listing reads only the rows, and
// a pass over one kind of blob reads only those, in the order they lie in.
constexpr std::array library_tables = {
    Table{"metadata", "CREATE TABLE metadata(key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT, WITHOUT ROWID"},
    Table{"skeletons",
          "CREATE TABLE skeletons(id INTEGER PRIMARY KEY, name TEXT NOT NULL, tree_hash TEXT NOT NULL, "
          "content_hash TEXT NOT NULL UNIQUE, blob BLOB NOT NULL) STRICT"},
    Table{"spaces",
          "CREATE TABLE spaces(id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, tree_hash TEXT NOT NULL, "
          "blob BLOB NOT NULL) STRICT"},
    Table{"clips",
          "CREATE TABLE clips(id INTEGER PRIMARY KEY, space_id INTEGER NOT NULL REFERENCES spaces(id), "
          "skeleton_id INTEGER NOT NULL REFERENCES skeletons(id), name TEXT NOT NULL UNIQUE, source TEXT NOT NULL, "
          "source_hash TEXT NOT NULL, rate_hz REAL NOT NULL, frames INTEGER NOT NULL) STRICT"},
    Table{"clip_labels",
          "CREATE TABLE clip_labels(clip_id INTEGER NOT NULL REFERENCES clips(id) ON DELETE CASCADE, "
          "position INTEGER NOT NULL, label TEXT NOT NULL, PRIMARY KEY(clip_id, position)) STRICT, WITHOUT ROWID"},
    Table{"clip_vectors",
          "CREATE TABLE clip_vectors(clip_id INTEGER PRIMARY KEY REFERENCES clips(id) ON DELETE CASCADE, "
          "blob BLOB NOT NULL) STRICT"},
    Table{"clip_warps",
          "CREATE TABLE clip_warps(clip_id INTEGER PRIMARY KEY REFERENCES clips(id) ON DELETE CASCADE, "
          "blob BLOB NOT NULL) STRICT"},
    Table{"clip_sides",
          "CREATE TABLE clip_sides(clip_id INTEGER PRIMARY KEY REFERENCES clips(id) ON DELETE CASCADE, "
          "blob BLOB NOT NULL) STRICT"},
    // float32, little-endian; checksum: XXH3-64 of the blob, as a signed number
    Table{"clip_retrieval",
          "CREATE TABLE clip_retrieval(clip_id INTEGER PRIMARY KEY REFERENCES clips(id) ON DELETE CASCADE, "
          "checksum INTEGER NOT NULL, vector BLOB NOT NULL) STRICT"},
    Table{"artifacts",
          "CREATE TABLE artifacts(kind TEXT NOT NULL, key TEXT NOT NULL, blob BLOB NOT NULL, "
          "PRIMARY KEY(kind, key)) STRICT"},
};

constexpr std::array keep_tables = {
    Table{"build", "CREATE TABLE build(fingerprint TEXT NOT NULL) STRICT"},
    Table{"imports",
          "CREATE TABLE imports(id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, checksum INTEGER NOT NULL, "
          "blob BLOB NOT NULL) STRICT"},
};

constexpr std::string_view sqlite_magic{"SQLite format 3\0", 16};
constexpr std::size_t header_bytes = 100;

// Fields of the header of a database file (https://www.sqlite.org/fileformat.html), big-endian.
constexpr std::size_t page_size_at = 16;
constexpr std::size_t write_version_at = 18;
constexpr std::size_t change_counter_at = 24;
constexpr std::size_t page_count_at = 28;
constexpr std::size_t application_id_at = 68;
constexpr std::size_t version_valid_for_at = 92;

std::uint32_t big_endian(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (const std::byte byte : bytes.subspan(at, size)) value = value << 8 | static_cast<std::uint32_t>(byte);
  return value;
}

void check_mark(sqlite::Database& database, const Format& format) {
  const std::int64_t id = database.number("PRAGMA application_id");
  if (id == keep().application_id && id != format.application_id) {
    database.damaged("an unfinished build, not a library");
  }
  if (id != format.application_id) {
    throw Error(ErrorKind::bad_input, {.file = database.shown(),
                                       .found = database.file_size() == 0 ? "an empty file" : "not a kinespace library",
                                       .remedy = "give a file that `kinespace build` wrote"});
  }
  const std::int64_t version = database.number("PRAGMA user_version");
  if (version > format.version) {
    throw Error(ErrorKind::bad_input,
                {.file = database.shown(),
                 .found = "made by a newer kinespace (library version " + std::to_string(version) + ")",
                 .remedy = "this one reads up to " + std::to_string(format.version)});
  }
  if (version < 1) database.damaged("a damaged library: version " + std::to_string(version));
}

void check_size(sqlite::Database& database) {
  std::array<std::byte, header_bytes> start{};
  database.read_start(start);
  const bool write_ahead = start[write_version_at] == std::byte{2};  // part of the file may be in its -wal
  const bool knows_size = big_endian(start, change_counter_at, 4) == big_endian(start, version_valid_for_at, 4);
  if (write_ahead || !knows_size) return;
  const std::uint32_t page = big_endian(start, page_size_at, 2);
  const std::uint64_t expected =
      static_cast<std::uint64_t>(page == 1 ? 65536 : page) * big_endian(start, page_count_at, 4);
  if (database.file_size() != expected) {
    database.damaged("a library that was cut short or damaged: " + std::to_string(database.file_size()) + " of its " +
                     std::to_string(expected) + " bytes");
  }
}

// Whatever else a file holds works on every row that is written: an index of a few bytes made a library of 150 KB one
// of 600 MB. So there is nothing beside the tables and the indices that SQLite makes for their keys itself, which have
// no text of their own.
[[noreturn]] void refuse_foreign(const sqlite::Database& database, const std::string& type, const std::string& name) {
  throw Error(ErrorKind::bad_input,
              {.file = database.shown(),
               .found = "a library with something in it that kinespace did not make: " + type + " '" + name + "'",
               .expected = "the tables of a library and nothing else",
               .remedy = "drop it with the program that made it, or build the library again from its clips"});
}

void check_tables(sqlite::Database& database, const Format& format) {
  std::size_t found = 0;
  sqlite::Statement query = database.prepare("SELECT type, name, tbl_name, coalesce(sql, '') FROM sqlite_schema");
  while (query.step()) {
    const std::string type = query.text(0);
    const std::string name = query.text(1);
    const std::string sql = query.text(3);
    const auto table = std::ranges::find(format.tables, name, &Table::name);
    if (table != format.tables.end()) {
      if (type != "table" || sql != table->sql) database.damaged("a damaged library: table " + name);
      ++found;
      continue;
    }
    const bool of_a_key = type == "index" && sql.empty() && name.starts_with("sqlite_autoindex_") &&
                          std::ranges::find(format.tables, query.text(2), &Table::name) != format.tables.end();
    if (!of_a_key) refuse_foreign(database, type, name);
  }
  if (found != format.tables.size()) database.damaged("a damaged library: tables are missing");
}

}  // namespace

const Format& library() {
  static constexpr Format format{0x4b53504c, static_cast<std::int32_t>(LibraryVersion::newest), library_tables};
  return format;
}

const Format& keep() {
  static constexpr Format format{0x4b53504b, 1, keep_tables};
  return format;
}

void make(sqlite::Database& database, const Format& format) {
  std::string sql = "BEGIN;";
  for (const Table& table : format.tables) sql += std::string(table.sql) + ";";
  sql += "PRAGMA application_id=" + std::to_string(format.application_id) + ";";
  sql += "PRAGMA user_version=" + std::to_string(format.version) + ";COMMIT";
  database.execute(sql.c_str());
}

void copy_rows(sqlite::Database& from, sqlite::Database& to, const Format& format) {
  from.execute("BEGIN");  // all tables as they were at one time
  // In the order of the tables: what is referred to comes before what refers to it.
  for (const Table& table : format.tables) to.copy_rows(from, std::string(table.name));
  from.execute("COMMIT");
}

void check(sqlite::Database& database, const Format& format) {
  // In one read transaction, so that nobody changes the file between the parts.
  database.execute("BEGIN");
  static_cast<void>(database.number("SELECT count(*) FROM sqlite_schema"));
  check_mark(database, format);
  check_size(database);
  check_tables(database, format);
  database.execute("COMMIT");
}

bool is_marked(std::span<const std::byte> start, const Format& format) {
  return start.size() >= header_bytes && may_be_database(start) &&
         big_endian(start, application_id_at, 4) == static_cast<std::uint32_t>(format.application_id);
}

bool may_be_database(std::span<const std::byte> start) {
  const std::size_t size = std::min(start.size(), sqlite_magic.size());
  return std::ranges::equal(start.first(size), std::as_bytes(std::span(sqlite_magic)).first(size));
}

}  // namespace kinespace::schema
