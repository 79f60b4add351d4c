#include "kinespace/storage/library_build.h"

#include <array>
#include <chrono>
#include <fstream>
#include <mutex>
#include <utility>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/storage/detail/build_files.h"
#include "kinespace/storage/detail/library_schema.h"
#include "kinespace/storage/detail/sqlite.h"

namespace kinespace {
namespace {

using sqlite::Database;
using sqlite::Mode;
using sqlite::Statement;
using Clock = std::chrono::steady_clock;

constexpr auto longest_uncommitted = std::chrono::milliseconds(500);

std::filesystem::path beside(const std::filesystem::path& target, const char* ending) {
  return target.string() + ending;
}

// A mistyped output must not cost anybody a file of another sort; a damaged library may be built again.
void require_replaceable(const std::filesystem::path& target) {
  std::error_code code;
  const std::filesystem::file_status status = std::filesystem::status(target, code);
  if (!std::filesystem::exists(status)) return;
  std::array<char, 16> start{};
  std::ifstream in(target, std::ios::binary);
  const bool regular = std::filesystem::is_regular_file(status);
  if (regular) in.read(start.data(), start.size());
  const auto read = std::span(start).first(static_cast<std::size_t>(in.gcount()));
  if (regular && schema::may_be_database(std::as_bytes(read))) return;
  throw Error(ErrorKind::usage, {.file = target.string(),
                                 .found = regular ? "a file that is no library" : "not a regular file",
                                 .expected = "a library to replace, or no file",
                                 .remedy = "give another output name"});
}

// A kill harms the keep nothing even when it is never flushed; after a power cut the check on opening and the checksum
// of each import find what is not whole. Flushing every batch cost more than importing it.
std::unique_ptr<Database> open_unflushed(const std::filesystem::path& path, const std::string& shown) {
  auto database = std::make_unique<Database>(path, Mode::read_write, shown);
  database->execute("PRAGMA synchronous=OFF");
  return database;
}

// What an earlier build left, when it is sound and of the same fingerprint.
std::unique_ptr<Database> open_sound_keep(const std::filesystem::path& path, const std::string& shown,
                                          const std::string& fingerprint) {
  try {
    auto database = open_unflushed(path, shown);
    schema::check(*database, schema::keep());
    if (Statement query = database->prepare("SELECT fingerprint FROM build");
        !query.step() || query.text(0) != fingerprint) {
      return nullptr;
    }
    if (Statement verdict = database->prepare("PRAGMA integrity_check(1)");
        !verdict.step() || verdict.text(0) != "ok") {
      return nullptr;
    }
    return database;
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::bad_input) throw;
    return nullptr;  // damaged, or none yet
  }
}

void require_equal_retrieval(Database& database) {
  Statement query = database.prepare(
      "SELECT s.name FROM clip_retrieval r JOIN clips c ON c.id = r.clip_id JOIN spaces s ON s.id = c.space_id "
      "GROUP BY s.id HAVING min(length(r.vector)) <> max(length(r.vector))");
  if (!query.step()) return;
  throw Error(ErrorKind::usage, {.file = database.shown(),
                                 .found = "retrieval vectors of different lengths in space '" + query.text(0) + "'",
                                 .expected = "one length"});
}

// A process that was killed while it wrote into the old library in place left its journal; SQLite would take it for
// that of the new file and play it back into it. So it is played back into the old one first.
void settle_old_journals(const std::filesystem::path& target, const std::string& shown) {
  const auto is_there = [&target](const char* ending) {
    std::error_code ignored;
    return std::filesystem::exists(beside(target, ending), ignored);
  };
  const bool unsettled = is_there("-journal") || is_there("-wal");
  if (unsettled && std::filesystem::exists(target)) {
    try {
      Database old(target, Mode::read_write, shown);
      old.execute("PRAGMA journal_mode=DELETE; BEGIN IMMEDIATE; COMMIT");
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::bad_input) throw;  // in use: its journal is alive
    }
  }
  std::error_code ignored;
  for (const char* ending : {"-journal", "-wal", "-shm"}) std::filesystem::remove(beside(target, ending), ignored);
}

}  // namespace

void LibraryBuildOptions::validate() const {
  const auto refuse = [](std::string found, std::string expected) {
    throw Error(ErrorKind::usage, {.file = {}, .found = std::move(found), .expected = std::move(expected)});
  };
  if (fingerprint.empty()) refuse("an empty fingerprint", "a text that changes with the importer's options");
  if (imports_per_commit < 1 || imports_per_commit > 100000) {
    refuse("imports_per_commit = " + std::to_string(imports_per_commit), "1 to 100000");
  }
}

struct LibraryBuild::State {
  State(const std::filesystem::path& path, const LibraryBuildOptions& build_options)
      : options(build_options),
        target(std::filesystem::weakly_canonical(std::filesystem::absolute(path))),
        shown(path.string()),
        lock(beside(target, ".partial"), path) {}

  void open_keep();
  void commit_keep();
  void start_rows();
  void drop_rows();

  LibraryBuildOptions options;
  std::filesystem::path target;  // behind all links
  std::string shown;             // as the user wrote it
  build_files::LockedFile lock;  // outlives the keep's connection

  mutable std::mutex mutex;  // of the keep and what follows
  std::unique_ptr<Database> keep;
  std::int64_t resumed = 0;
  int uncommitted = 0;
  Clock::time_point last_commit = Clock::now();

  std::optional<Library> rows;
  bool finished = false;
};

void LibraryBuild::State::open_keep() {
  std::string fingerprint = options.fingerprint;
  if (options.extend) fingerprint += "\nextends " + build_files::identity_of(target);
  keep = open_sound_keep(lock.path(), shown, fingerprint);
  if (!keep) {
    lock.clear();
    keep = open_unflushed(lock.path(), shown);
    schema::make(*keep, schema::keep());
    keep->prepare("INSERT INTO build(fingerprint) VALUES(?)").bind(1, fingerprint).run();
  }
  resumed = keep->number("SELECT count(*) FROM imports");
  keep->execute("BEGIN IMMEDIATE");
}

void LibraryBuild::State::commit_keep() {
  keep->execute("COMMIT");
  keep->execute("BEGIN IMMEDIATE");
  uncommitted = 0;
  last_commit = Clock::now();
}

void LibraryBuild::State::start_rows() {
  drop_rows();
  auto database = std::make_unique<Database>(beside(target, ".new"), Mode::create, shown);
  // Nobody reads this file before it is complete and flushed, and a kill throws it away: no flushes in between.
  database->execute("PRAGMA journal_mode=DELETE; PRAGMA synchronous=OFF");
  schema::make(*database, schema::library());
  database->execute("BEGIN IMMEDIATE");
  if (options.extend) {
    const Library old = Library::open_read_only(target);
    schema::copy_rows(*old.database_, *database, schema::library());
  }
  rows.emplace(Library(target, std::move(database)));
}

void LibraryBuild::State::drop_rows() {
  rows.reset();
  std::error_code ignored;
  std::filesystem::remove(beside(target, ".new"), ignored);
  std::filesystem::remove(build_files::journal_of(beside(target, ".new")), ignored);
}

LibraryBuild::LibraryBuild(const std::filesystem::path& target, const LibraryBuildOptions& options) {
  options.validate();
  require_replaceable(target);
  if (options.extend) static_cast<void>(Library::open_read_only(target));
  state_ = std::make_unique<State>(target, options);
  state_->open_keep();
}

LibraryBuild::~LibraryBuild() {
  if (state_->finished) return;
  state_->drop_rows();
  try {
    const bool empty = state_->keep->number("SELECT count(*) FROM imports") == 0;
    state_->keep->execute("COMMIT");
    state_->keep.reset();
    if (empty) state_->lock.remove();
  } catch (const Error&) {
    // What was committed before is there all the same.
  }
}

const std::filesystem::path& LibraryBuild::target() const noexcept {
  return state_->target;
}

std::int64_t LibraryBuild::resumed_imports() const noexcept {
  return state_->resumed;
}

std::optional<Bytes> LibraryBuild::find_import(std::string_view key) const {
  const std::scoped_lock guard(state_->mutex);
  Statement query = state_->keep->prepare("SELECT checksum, blob FROM imports WHERE key = ?");
  if (!query.bind(1, key).step()) return std::nullopt;
  const auto blob = query.blob(1);
  if (checksum64(blob) != static_cast<std::uint64_t>(query.integer(0))) return std::nullopt;
  return Bytes(blob.begin(), blob.end());
}

std::vector<std::string> LibraryBuild::import_keys() const {
  const std::scoped_lock guard(state_->mutex);
  std::vector<std::string> keys;
  Statement query = state_->keep->prepare("SELECT key FROM imports ORDER BY id");
  while (query.step()) keys.push_back(query.text(0));
  return keys;
}

void LibraryBuild::keep_import(std::string_view key, std::span<const std::byte> blob) {
  const std::scoped_lock guard(state_->mutex);
  state_->keep->prepare("INSERT OR REPLACE INTO imports(key, checksum, blob) VALUES(?, ?, ?)")
      .bind(1, key)
      .bind(2, static_cast<std::int64_t>(checksum64(blob)))
      .bind(3, blob)
      .run();
  const bool full = ++state_->uncommitted >= state_->options.imports_per_commit;
  if (full || Clock::now() - state_->last_commit >= longest_uncommitted) state_->commit_keep();
}

void LibraryBuild::checkpoint() {
  const std::scoped_lock guard(state_->mutex);
  state_->commit_keep();
}

Library& LibraryBuild::library() {
  if (!state_->rows) state_->start_rows();
  return *state_->rows;
}

void LibraryBuild::finish() {
  Database& database = *library().database_;
  require_equal_retrieval(database);
  database.execute("COMMIT");
  // Replaced rows leave holes; an eighth of the file is worth a copy.
  if (database.number("PRAGMA freelist_count") * 8 > database.number("PRAGMA page_count")) database.execute("VACUUM");
  state_->rows.reset();
  settle_old_journals(state_->target, state_->shown);
  build_files::replace(state_->target, beside(state_->target, ".new"));
  state_->finished = true;
  state_->keep.reset();
  state_->lock.remove();
}

}  // namespace kinespace
