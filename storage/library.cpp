#include "kinespace/storage/library.h"

#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/storage/detail/library_schema.h"
#include "kinespace/storage/detail/sqlite.h"

namespace kinespace {
namespace {

using sqlite::Database;
using sqlite::Mode;
using sqlite::Statement;

Bytes copy(std::span<const std::byte> bytes) {
  return {bytes.begin(), bytes.end()};
}

[[noreturn]] void missing(const Database& database, std::string found) {
  throw Error(ErrorKind::bad_input, {.file = database.shown(), .found = std::move(found)});
}

void require_file(const std::filesystem::path& path) {
  std::error_code code;
  const std::filesystem::file_status status = std::filesystem::status(path, code);
  if (std::filesystem::is_regular_file(status)) return;
  const bool exists = std::filesystem::exists(status);
  throw Error(ErrorKind::bad_input, {.file = path.string(),
                                     .found = std::filesystem::is_directory(status) ? "a folder"
                                              : exists                              ? "not a regular file"
                                                                                    : "no such file",
                                     .expected = "a library",
                                     .remedy = "check the path; `kinespace build` makes a library"});
}

// A writer that was killed leaves a journal; SQLite undoes it as soon as somebody who may write opens the file.
void settle_journal(const std::filesystem::path& path) {
  std::error_code ignored;
  const std::filesystem::path journal = path.string() + "-journal";
  if (!std::filesystem::exists(journal, ignored)) return;
  Database database(path, Mode::read_write, path.string());
  static_cast<void>(database.number("SELECT count(*) FROM sqlite_schema"));
}

std::unique_ptr<Database> open_checked(const std::filesystem::path& path, Mode mode) {
  require_file(path);
  if (mode == Mode::read_only) settle_journal(path);
  auto database = std::make_unique<Database>(path, mode, path.string());
  schema::check(*database, schema::library());
  return database;
}

std::string unreadable(std::string_view key, const std::string& text, const char* expected) {
  return "a damaged library: \"" + text.substr(0, 40) + "\" as the " + expected + " '" + std::string(key) + "'";
}

// All of `text` as a number; nullopt when it is none.
template <class Number>
std::optional<Number> whole_number(const std::string& text) {
  const char* const end = text.data() + text.size();
  Number value{};
  const auto [at, code] = std::from_chars(text.data(), end, value);
  if (code != std::errc() || at != end) return std::nullopt;
  return value;
}

SkeletonRow skeleton_of(Statement& query) {
  return {.id = query.integer(0), .name = query.text(1), .tree_hash = query.text(2), .blob = copy(query.blob(3))};
}

}  // namespace

Library::Library(std::filesystem::path path, std::unique_ptr<Database> database)
    : path_(std::move(path)), database_(std::move(database)) {}
Library::~Library() = default;
Library::Library(Library&& other) noexcept = default;
Library& Library::operator=(Library&& other) noexcept = default;

Library Library::create(const std::filesystem::path& path) {
  if (std::filesystem::exists(path)) {
    throw Error(ErrorKind::usage, {.file = path.string(), .found = "exists already", .remedy = "give another name"});
  }
  auto database = std::make_unique<Database>(path, Mode::create, path.string());
  schema::make(*database, schema::library());
  return {path, std::move(database)};
}

Library Library::open(const std::filesystem::path& path) {
  return {path, open_checked(path, Mode::read_write)};
}

Library Library::open_read_only(const std::filesystem::path& path) {
  return {path, open_checked(path, Mode::read_only)};
}

bool Library::looks_like_library(std::span<const std::byte> start) {
  return schema::is_marked(start, schema::library());
}

void Library::set_metadata(std::string_view key, std::string_view value) {
  database_->prepare("INSERT OR REPLACE INTO metadata(key, value) VALUES(?, ?)").bind(1, key).bind(2, value).run();
}

std::optional<std::string> Library::metadata(std::string_view key) const {
  Statement query = database_->prepare("SELECT value FROM metadata WHERE key = ?");
  if (!query.bind(1, key).step()) return std::nullopt;
  return query.text(0);
}

std::optional<double> Library::metadata_number(std::string_view key) const {
  const auto text = metadata(key);
  if (!text) return std::nullopt;
  const auto value = whole_number<double>(*text);
  if (!value || !std::isfinite(*value)) database_->damaged(unreadable(key, *text, "number"));
  return value;
}

std::optional<std::int64_t> Library::metadata_count(std::string_view key) const {
  const auto text = metadata(key);
  if (!text) return std::nullopt;
  const auto value = whole_number<std::int32_t>(*text);
  if (!value || *value < 0) database_->damaged(unreadable(key, *text, "count"));
  return value;
}

std::vector<std::pair<std::string, std::string>> Library::all_metadata() const {
  std::vector<std::pair<std::string, std::string>> rows;
  Statement query = database_->prepare("SELECT key, value FROM metadata ORDER BY key");
  while (query.step()) rows.emplace_back(query.text(0), query.text(1));
  return rows;
}

std::int64_t Library::add_skeleton(const SkeletonRow& row) {
  const std::string hash = row.tree_hash + content_hash(row.blob);
  Statement query = database_->prepare("SELECT id FROM skeletons WHERE content_hash = ?");
  if (query.bind(1, hash).step()) return query.integer(0);
  database_->prepare("INSERT INTO skeletons(name, tree_hash, content_hash, blob) VALUES(?, ?, ?, ?)")
      .bind(1, row.name)
      .bind(2, row.tree_hash)
      .bind(3, hash)
      .bind(4, row.blob)
      .run();
  return database_->last_inserted_id();
}

SkeletonRow Library::skeleton(std::int64_t id) const {
  Statement query = database_->prepare("SELECT id, name, tree_hash, blob FROM skeletons WHERE id = ?");
  if (!query.bind(1, id).step()) missing(*database_, "no skeleton with the id " + std::to_string(id));
  return skeleton_of(query);
}

std::vector<SkeletonRow> Library::skeletons() const {
  std::vector<SkeletonRow> rows;
  Statement query = database_->prepare("SELECT id, name, tree_hash, blob FROM skeletons ORDER BY id");
  while (query.step()) rows.push_back(skeleton_of(query));
  return rows;
}

std::int64_t Library::put_space(const SpaceRow& row) {
  Statement insert = database_->prepare(
      "INSERT INTO spaces(name, tree_hash, blob) VALUES(?, ?, ?) ON CONFLICT(name) DO UPDATE SET "
      "tree_hash = excluded.tree_hash, blob = excluded.blob RETURNING id");
  insert.bind(1, row.name).bind(2, row.tree_hash).bind(3, row.blob).step();
  const std::int64_t id = insert.integer(0);
  insert.run();
  return id;
}

SpaceRow Library::space(std::int64_t id) const {
  Statement query = database_->prepare("SELECT id, name, tree_hash, blob FROM spaces WHERE id = ?");
  if (!query.bind(1, id).step()) missing(*database_, "no motion space with the id " + std::to_string(id));
  return {.id = query.integer(0), .name = query.text(1), .tree_hash = query.text(2), .blob = copy(query.blob(3))};
}

std::vector<SpaceRow> Library::spaces() const {
  std::vector<SpaceRow> rows;
  Statement query = database_->prepare("SELECT id, name, tree_hash FROM spaces ORDER BY id");
  while (query.step()) {
    rows.push_back({.id = query.integer(0), .name = query.text(1), .tree_hash = query.text(2), .blob = {}});
  }
  return rows;
}

void Library::put_artifact(std::string_view kind, std::string_view key, std::span<const std::byte> blob) {
  database_->prepare("INSERT OR REPLACE INTO artifacts(kind, key, blob) VALUES(?, ?, ?)")
      .bind(1, kind)
      .bind(2, key)
      .bind(3, blob)
      .run();
}

std::optional<Bytes> Library::artifact(std::string_view kind, std::string_view key) const {
  Statement query = database_->prepare("SELECT blob FROM artifacts WHERE kind = ? AND key = ?");
  if (!query.bind(1, kind).bind(2, key).step()) return std::nullopt;
  return copy(query.blob(0));
}

std::vector<std::string> Library::artifact_keys(std::string_view kind) const {
  std::vector<std::string> keys;
  Statement query = database_->prepare("SELECT key FROM artifacts WHERE kind = ? ORDER BY key");
  query.bind(1, kind);
  while (query.step()) keys.push_back(query.text(0));
  return keys;
}

void Library::remove_artifact(std::string_view kind, std::string_view key) {
  database_->prepare("DELETE FROM artifacts WHERE kind = ? AND key = ?").bind(1, kind).bind(2, key).run();
}

LibraryTotals Library::totals() const {
  const auto bytes = [this](const char* sql) { return database_->number(sql); };
  LibraryTotals totals;
  totals.skeletons = bytes("SELECT count(*) FROM skeletons");
  totals.spaces = bytes("SELECT count(*) FROM spaces");
  for (const ClipRow& clip : clips()) {
    ++totals.clips;
    totals.frames += clip.frames;
    totals.seconds += static_cast<double>(clip.frames) / clip.rate_hz;
  }
  // SQLite knows the length of a blob without reading it.
  totals.space_bytes = bytes("SELECT coalesce(sum(length(blob)), 0) FROM spaces");
  totals.vector_bytes = bytes("SELECT coalesce(sum(length(blob)), 0) FROM clip_vectors");
  totals.warp_bytes = bytes("SELECT coalesce(sum(length(blob)), 0) FROM clip_warps");
  totals.side_bytes = bytes("SELECT coalesce(sum(length(blob)), 0) FROM clip_sides");
  totals.retrieval_bytes = bytes("SELECT coalesce(sum(length(vector)), 0) FROM clip_retrieval");
  totals.artifact_bytes = bytes("SELECT coalesce(sum(length(blob)), 0) FROM artifacts");
  totals.file_bytes = static_cast<std::int64_t>(database_->file_size());
  return totals;
}

void Library::check() const {
  Statement query = database_->prepare("PRAGMA integrity_check(1)");
  if (!query.step()) database_->damaged("a damaged library");
  if (const std::string verdict = query.text(0); verdict != "ok") database_->damaged("a damaged library: " + verdict);
  for (const SpaceRow& space : spaces()) static_cast<void>(retrieval_matrix(space.id));
}

Transaction::Transaction(Library& library)
    : database_(*library.database_), outermost_(!database_.in_transaction()), open_(true) {
  database_.execute(outermost_ ? "BEGIN IMMEDIATE" : "SAVEPOINT part");
}

Transaction::~Transaction() {
  if (!open_ || !database_.in_transaction()) return;
  try {
    database_.execute(outermost_ ? "ROLLBACK" : "ROLLBACK TO part; RELEASE part");
  } catch (const Error&) {
    // The journal stays, and SQLite undoes it when the file is opened next.
  }
}

void Transaction::commit() {
  if (!database_.in_transaction()) {
    throw Error(ErrorKind::machine, {.file = database_.shown(),
                                     .found = "an error before took back what was to be committed",
                                     .remedy = "free some space and try again"});
  }
  database_.execute(outermost_ ? "COMMIT" : "RELEASE part");
  open_ = false;
}

}  // namespace kinespace
