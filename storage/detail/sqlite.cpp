#include "kinespace/storage/detail/sqlite.h"

#include <unordered_map>
#include <utility>
#include <vector>

#include <sqlite3.h>

namespace kinespace::sqlite {

struct Connection {
  sqlite3* handle = nullptr;
  std::string shown;
  std::unordered_map<std::string, std::vector<sqlite3_stmt*>> idle;
};

namespace {

constexpr const char* damaged_remedy = "build the library again from its clips, or take a copy";

[[noreturn]] void fail(const Connection& connection, int code) {
  const std::string reason = sqlite3_errstr(code);
  ErrorDetails details{.file = connection.shown};
  // What SQLite reports when a file ends too early is the file's fault, not the disk's.
  if (code == SQLITE_IOERR_SHORT_READ) code = SQLITE_CORRUPT;
  switch (code & 0xff) {
    case SQLITE_NOTADB:
      details.found = "not a kinespace library";
      details.remedy = "give a file that `kinespace build` wrote";
      throw Error(ErrorKind::bad_input, std::move(details));
    case SQLITE_FULL:
    case SQLITE_IOERR:
      details.found = "cannot read or write: " + reason;
      details.remedy = "free some space or choose another place; what was there before is unchanged";
      throw Error(ErrorKind::machine, std::move(details));
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      details.found = "cannot open for this use: " + reason;
      details.remedy = "check that the folder exists and that it and the file are yours to write";
      throw Error(ErrorKind::machine, std::move(details));
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      details.found = "in use by another process";
      details.remedy = "wait until that one has ended";
      throw Error(ErrorKind::machine, std::move(details));
    case SQLITE_NOMEM:
    case SQLITE_TOOBIG:
      details.found = reason;
      details.remedy = "cut the clips into shorter ones";
      throw Error(ErrorKind::machine, std::move(details));
    case SQLITE_CONSTRAINT:
      details.found = std::string("a row that does not fit the library: ") + sqlite3_errmsg(connection.handle);
      throw Error(ErrorKind::usage, std::move(details));
    default:
      details.found = "a damaged library: " + reason;
      details.remedy = damaged_remedy;
      throw Error(ErrorKind::bad_input, std::move(details));
  }
}

void check(const Connection& connection, int code) {
  if (code != SQLITE_OK) fail(connection, code);
}

int flags_of(Mode mode) {
  constexpr int common = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  switch (mode) {
    case Mode::read_only:
      return common | SQLITE_OPEN_READONLY;
    case Mode::read_write:
      return common | SQLITE_OPEN_READWRITE;
    case Mode::create:
      break;
  }
  return common | SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
}

// A library comes from elsewhere: nothing in it may run, and damaged pages are looked for.
constexpr const char* hardening =
    "PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON; PRAGMA foreign_keys=ON; PRAGMA mmap_size=0;"
    "PRAGMA cache_size=-16384";

// A statement for a pass over whole rows of whatever type.
struct Prepared {
  Prepared(const Connection& connection, const std::string& sql) {
    check(connection, sqlite3_prepare_v2(connection.handle, sql.c_str(), -1, &statement, nullptr));
  }
  ~Prepared() { sqlite3_finalize(statement); }
  Prepared(const Prepared&) = delete;
  Prepared& operator=(const Prepared&) = delete;

  sqlite3_stmt* statement = nullptr;
};

sqlite3_file* file_of(const Connection& connection) {
  sqlite3_file* file = nullptr;
  check(connection, sqlite3_file_control(connection.handle, "main", SQLITE_FCNTL_FILE_POINTER, &file));
  return file;
}

}  // namespace

Statement::Statement(Connection& connection, std::string sql) : connection_(connection), sql_(std::move(sql)) {
  std::vector<sqlite3_stmt*>& idle = connection_.idle[sql_];
  if (idle.empty()) {
    check(sqlite3_prepare_v2(connection_.handle, sql_.data(), static_cast<int>(sql_.size()), &statement_, nullptr));
    idle.reserve(4);
  } else {
    statement_ = idle.back();
    idle.pop_back();
  }
}

Statement::~Statement() {
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
  std::vector<sqlite3_stmt*>& idle = connection_.idle.find(sql_)->second;
  if (idle.size() < idle.capacity()) {
    idle.push_back(statement_);
  } else {
    sqlite3_finalize(statement_);
  }
}

void Statement::check(int code) {
  sqlite::check(connection_, code);
}

Statement& Statement::bind(int index, std::int64_t value) {
  check(sqlite3_bind_int64(statement_, index, value));
  return *this;
}

Statement& Statement::bind(int index, double value) {
  check(sqlite3_bind_double(statement_, index, value));
  return *this;
}

// A null pointer would bind NULL: empty values get an address of their own.
Statement& Statement::bind(int index, std::string_view text) {
  const char* data = text.empty() ? "" : text.data();
  check(sqlite3_bind_text64(statement_, index, data, text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind(int index, std::span<const std::byte> blob) {
  const void* data = blob.empty() ? static_cast<const void*>("") : blob.data();
  check(sqlite3_bind_blob64(statement_, index, data, blob.size(), SQLITE_STATIC));
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  // A value that is read and too big was never written so.
  const bool impossible = code == SQLITE_TOOBIG && sqlite3_stmt_readonly(statement_) != 0;
  fail(connection_, impossible ? SQLITE_CORRUPT : code);
}

void Statement::run() {
  while (step()) {
  }
}

void Statement::require_type(int column, int type) {
  if (sqlite3_column_type(statement_, column) == type) return;
  throw Error(ErrorKind::bad_input, {.file = connection_.shown,
                                     .found = std::string("a damaged library: column ") +
                                              sqlite3_column_name(statement_, column) + " has another type",
                                     .remedy = damaged_remedy});
}

std::int64_t Statement::integer(int column) {
  require_type(column, SQLITE_INTEGER);
  return sqlite3_column_int64(statement_, column);
}

double Statement::real(int column) {
  require_type(column, SQLITE_FLOAT);
  return sqlite3_column_double(statement_, column);
}

std::string Statement::text(int column) {
  require_type(column, SQLITE_TEXT);
  const unsigned char* data = sqlite3_column_text(statement_, column);
  if (data == nullptr) fail(connection_, SQLITE_NOMEM);
  return {reinterpret_cast<const char*>(data), static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

std::span<const std::byte> Statement::blob(int column) {
  require_type(column, SQLITE_BLOB);
  // Asked for first: a null pointer is an empty blob, or one that could not be read.
  const void* data = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  if (data == nullptr && size != 0) fail(connection_, sqlite3_errcode(connection_.handle));
  return {static_cast<const std::byte*>(data), static_cast<std::size_t>(size)};
}

Database::Database(const std::filesystem::path& path, Mode mode, std::string shown)
    : connection_(std::make_unique<Connection>()) {
  connection_->shown = std::move(shown);
  // An absolute path is never taken for a URI or for one of SQLite's special names.
  const std::string name = std::filesystem::absolute(path).string();
  const int code = sqlite3_open_v2(name.c_str(), &connection_->handle, flags_of(mode), nullptr);
  try {
    check(*connection_, code);
    sqlite3_busy_timeout(connection_->handle, 2000);
    check(*connection_, sqlite3_db_config(connection_->handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr));
    execute(hardening);
  } catch (const Error&) {
    sqlite3_close(connection_->handle);
    throw;
  }
}

Database::~Database() {
  for (const auto& [sql, statements] : connection_->idle) {
    for (sqlite3_stmt* statement : statements) sqlite3_finalize(statement);
  }
  sqlite3_close(connection_->handle);
}

void Database::execute(const char* sql) {
  check(*connection_, sqlite3_exec(connection_->handle, sql, nullptr, nullptr, nullptr));
}

Statement Database::prepare(std::string sql) {
  return {*connection_, std::move(sql)};
}

std::int64_t Database::number(const char* sql) {
  Statement query = prepare(sql);
  if (!query.step()) damaged("a damaged library");
  return query.integer(0);
}

std::int64_t Database::last_inserted_id() const {
  return sqlite3_last_insert_rowid(connection_->handle);
}

bool Database::in_transaction() const {
  return sqlite3_get_autocommit(connection_->handle) == 0;
}

std::uint64_t Database::file_size() const {
  sqlite3_file* file = file_of(*connection_);
  sqlite3_int64 size = 0;
  check(*connection_, file->pMethods->xFileSize(file, &size));
  return static_cast<std::uint64_t>(size);
}

void Database::read_start(std::span<std::byte> out) const {
  sqlite3_file* file = file_of(*connection_);
  check(*connection_, file->pMethods->xRead(file, out.data(), static_cast<int>(out.size()), 0));
}

void Database::copy_rows(const Database& other, const std::string& table) {
  const Prepared read(*other.connection_, "SELECT * FROM " + table);
  const int columns = sqlite3_column_count(read.statement);
  std::string places = "?";
  for (int i = 1; i < columns; ++i) places += ", ?";
  const Prepared write(*connection_, "INSERT INTO " + table + " VALUES(" + places + ")");
  for (;;) {
    const int got = sqlite3_step(read.statement);
    if (got == SQLITE_DONE) return;
    if (got != SQLITE_ROW) fail(*other.connection_, got);
    for (int i = 0; i < columns; ++i) {
      check(*connection_, sqlite3_bind_value(write.statement, i + 1, sqlite3_column_value(read.statement, i)));
    }
    const int put = sqlite3_step(write.statement);
    if ((put & 0xff) == SQLITE_CONSTRAINT) other.damaged("a damaged library: a row of " + table + " that cannot be");
    if (put != SQLITE_DONE) fail(*connection_, put);
    sqlite3_reset(write.statement);
  }
}

const std::string& Database::shown() const {
  return connection_->shown;
}

void Database::damaged(std::string found) const {
  throw Error(ErrorKind::bad_input, {.file = connection_->shown, .found = std::move(found), .remedy = damaged_remedy});
}

}  // namespace kinespace::sqlite
