#include "kinespace/storage/library.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <string>
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

namespace {

using sqlite::Database;
using sqlite::Statement;

constexpr const char* clip_columns = "SELECT id, space_id, skeleton_id, name, source, source_hash, rate_hz, frames ";

const char* table_of(ClipBlob which) {
  switch (which) {
    case ClipBlob::vectors:
      return "clip_vectors";
    case ClipBlob::warps:
      return "clip_warps";
    case ClipBlob::side:
      break;
  }
  return "clip_sides";
}

[[noreturn]] void no_clip(const Database& database, std::int64_t id) {
  throw Error(ErrorKind::bad_input, {.file = database.shown(), .found = "no clip with the id " + std::to_string(id)});
}

void validate(const ClipRow& row) {
  const auto refuse = [&row](std::string found, std::string expected) {
    throw Error(ErrorKind::usage, {.file = row.source, .found = std::move(found), .expected = std::move(expected)});
  };
  if (row.name.empty()) refuse("a clip without a name", "a name");
  if (!(row.rate_hz > 0) || !std::isfinite(row.rate_hz)) refuse("rate_hz = " + std::to_string(row.rate_hz), "above 0");
  if (row.frames < 1) refuse("frames = " + std::to_string(row.frames), "at least 1");
}

ClipRow clip_of(const Database& database, Statement& query) {
  ClipRow row{.id = query.integer(0),
              .space_id = query.integer(1),
              .skeleton_id = query.integer(2),
              .name = query.text(3),
              .source = query.text(4),
              .source_hash = query.text(5),
              .rate_hz = query.real(6),
              .frames = query.integer(7),
              .labels = {}};
  if (!(row.rate_hz > 0) || !std::isfinite(row.rate_hz) || row.frames < 1) {
    database.damaged("a damaged library: the rate or the frames of clip " + row.name);
  }
  return row;
}

std::optional<ClipRow> one_clip(Database& database, Statement& query) {
  if (!query.step()) return std::nullopt;
  ClipRow row = clip_of(database, query);
  Statement labels = database.prepare("SELECT label FROM clip_labels WHERE clip_id = ? ORDER BY position");
  labels.bind(1, row.id);
  while (labels.step()) row.labels.push_back(labels.text(0));
  return row;
}

std::vector<float> floats_of(const Database& database, Statement& query, int checksum_column, int vector_column) {
  const auto raw = query.blob(vector_column);
  if (raw.size() % sizeof(float) != 0 ||
      checksum64(raw) != static_cast<std::uint64_t>(query.integer(checksum_column))) {
    database.damaged("a damaged library: a retrieval vector's checksum differs");
  }
  std::vector<float> values(raw.size() / sizeof(float));
  if (!raw.empty()) std::memcpy(values.data(), raw.data(), raw.size());
  return values;
}

void put_blobs(Database& database, std::int64_t id, const ClipBlobs& blobs) {
  const auto put = [&](ClipBlob which, const Bytes& blob) {
    database.prepare(std::string("INSERT OR REPLACE INTO ") + table_of(which) + "(clip_id, blob) VALUES(?, ?)")
        .bind(1, id)
        .bind(2, blob)
        .run();
  };
  put(ClipBlob::vectors, blobs.vectors);
  put(ClipBlob::warps, blobs.warps);
  put(ClipBlob::side, blobs.side);
  const auto raw = std::as_bytes(std::span(blobs.retrieval));
  database.prepare("INSERT OR REPLACE INTO clip_retrieval(clip_id, checksum, vector) VALUES(?, ?, ?)")
      .bind(1, id)
      .bind(2, static_cast<std::int64_t>(checksum64(raw)))
      .bind(3, raw)
      .run();
}

}  // namespace

std::int64_t Library::add_clip(const ClipRow& row, const ClipBlobs& blobs) {
  validate(row);
  if (const std::optional<ClipRow> taken = find_clip(row.name)) {
    throw Error(ErrorKind::bad_input, {.file = row.source,
                                       .found = "a second clip named '" + row.name + "'",
                                       .expected = "names that differ (the first is from " + taken->source + ")",
                                       .remedy = "rename one of the files"});
  }
  Transaction together(*this);
  database_
      ->prepare(
          "INSERT INTO clips(space_id, skeleton_id, name, source, source_hash, rate_hz, frames) "
          "VALUES(?, ?, ?, ?, ?, ?, ?)")
      .bind(1, row.space_id)
      .bind(2, row.skeleton_id)
      .bind(3, row.name)
      .bind(4, row.source)
      .bind(5, row.source_hash)
      .bind(6, row.rate_hz)
      .bind(7, row.frames)
      .run();
  const std::int64_t id = database_->last_inserted_id();
  std::int64_t position = 0;
  for (const std::string& label : row.labels) {
    database_->prepare("INSERT INTO clip_labels(clip_id, position, label) VALUES(?, ?, ?)")
        .bind(1, id)
        .bind(2, position++)
        .bind(3, label)
        .run();
  }
  put_blobs(*database_, id, blobs);
  together.commit();
  return id;
}

void Library::replace_clip_blobs(std::int64_t id, const ClipBlobs& blobs) {
  static_cast<void>(clip(id));
  Transaction together(*this);
  put_blobs(*database_, id, blobs);
  together.commit();
}

void Library::remove_clip(std::int64_t id) {
  static_cast<void>(clip(id));
  database_->prepare("DELETE FROM clips WHERE id = ?").bind(1, id).run();
}

std::vector<ClipRow> Library::clips() const {
  std::vector<ClipRow> rows;
  Statement query = database_->prepare(std::string(clip_columns) + "FROM clips ORDER BY id");
  while (query.step()) rows.push_back(clip_of(*database_, query));
  // Both lists ascend by clip: one pass joins them.
  Statement labels = database_->prepare("SELECT clip_id, label FROM clip_labels ORDER BY clip_id, position");
  std::size_t at = 0;
  while (labels.step()) {
    const std::int64_t id = labels.integer(0);
    while (at < rows.size() && rows[at].id < id) ++at;
    if (at < rows.size() && rows[at].id == id) rows[at].labels.push_back(labels.text(1));
  }
  return rows;
}

std::optional<ClipRow> Library::find_clip(std::string_view name) const {
  Statement query = database_->prepare(std::string(clip_columns) + "FROM clips WHERE name = ?");
  query.bind(1, name);
  return one_clip(*database_, query);
}

ClipRow Library::clip(std::int64_t id) const {
  Statement query = database_->prepare(std::string(clip_columns) + "FROM clips WHERE id = ?");
  query.bind(1, id);
  std::optional<ClipRow> row = one_clip(*database_, query);
  if (!row) no_clip(*database_, id);
  return *std::move(row);
}

Bytes Library::clip_blob(std::int64_t id, ClipBlob which) const {
  Statement query = database_->prepare(std::string("SELECT blob FROM ") + table_of(which) + " WHERE clip_id = ?");
  if (!query.bind(1, id).step()) no_clip(*database_, id);
  const auto blob = query.blob(0);
  return {blob.begin(), blob.end()};
}

std::vector<float> Library::retrieval_vector(std::int64_t id) const {
  Statement query = database_->prepare("SELECT checksum, vector FROM clip_retrieval WHERE clip_id = ?");
  if (!query.bind(1, id).step()) no_clip(*database_, id);
  return floats_of(*database_, query, 0, 1);
}

void Library::for_each_blob(std::int64_t space_id, ClipBlob which,
                            const std::function<void(std::int64_t id, std::span<const std::byte> blob)>& visit) const {
  // CROSS JOIN keeps the blobs in front, so that they are read in the order they lie in.
  Statement query =
      database_->prepare(std::string("SELECT b.clip_id, b.blob FROM ") + table_of(which) +
                         " b CROSS JOIN clips c ON c.id = b.clip_id WHERE c.space_id = ? ORDER BY b.clip_id");
  query.bind(1, space_id);
  while (query.step()) visit(query.integer(0), query.blob(1));
}

RetrievalMatrix Library::retrieval_matrix(std::int64_t space_id) const {
  Statement query = database_->prepare(
      "SELECT r.clip_id, r.checksum, r.vector FROM clip_retrieval r CROSS JOIN clips c ON c.id = r.clip_id "
      "WHERE c.space_id = ? ORDER BY r.clip_id");
  query.bind(1, space_id);
  RetrievalMatrix matrix;
  while (query.step()) {
    const std::vector<float> values = floats_of(*database_, query, 1, 2);
    if (!matrix.clip_ids.empty() && values.size() != matrix.dimensions) {
      database_->damaged("a library whose retrieval vectors differ in length");
    }
    matrix.dimensions = values.size();
    matrix.clip_ids.push_back(query.integer(0));
    matrix.values.insert(matrix.values.end(), values.begin(), values.end());
  }
  return matrix;
}

}  // namespace kinespace
