// SQLite as the library file needs it: connections and statements that close themselves, errors that say whose they
// are. Internal to storage/.
//
// Error kinds: a damaged or foreign file is bad_input; a full disk, missing rights, another process at work are
// machine.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "kinespace/base/error.h"

struct sqlite3;
struct sqlite3_stmt;

namespace kinespace::sqlite {

struct Connection;

// A statement, prepared. Goes back to its connection, ready for its next use, at the end of its life; a connection must
// outlive its statements.
class Statement {
 public:
  Statement(Connection& connection, std::string sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  // Parameters count from 1. Text is copied; the bytes of a blob must stay until the statement has run.
  Statement& bind(int index, std::int64_t value);
  Statement& bind(int index, double value);
  Statement& bind(int index, std::string_view text);
  Statement& bind(int index, std::span<const std::byte> blob);

  // Moves to the next row; false behind the last.
  bool step();
  // Runs a statement that returns no rows.
  void run();

  // Columns count from 0. Throw Error{bad_input} when the file has another type there, as only a damaged one does.
  [[nodiscard]] std::int64_t integer(int column);
  [[nodiscard]] double real(int column);
  [[nodiscard]] std::string text(int column);
  // Valid until the next step.
  [[nodiscard]] std::span<const std::byte> blob(int column);

 private:
  void check(int code);
  void require_type(int column, int type);

  Connection& connection_;
  std::string sql_;
  sqlite3_stmt* statement_ = nullptr;
};

enum class Mode { read_only, read_write, create };

class Database {
 public:
  // `create` makes the file when there is none. `shown` is what messages call the file.
  Database(const std::filesystem::path& path, Mode mode, std::string shown);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  // One or several statements without parameters and results.
  void execute(const char* sql);
  [[nodiscard]] Statement prepare(std::string sql);
  // The one number that a query returns.
  [[nodiscard]] std::int64_t number(const char* sql);
  [[nodiscard]] std::int64_t last_inserted_id() const;
  [[nodiscard]] bool in_transaction() const;
  // The first bytes of the file as they lie there, and its size; inside a read transaction nobody changes them.
  [[nodiscard]] std::uint64_t file_size() const;
  void read_start(std::span<std::byte> out) const;

  // Adds all rows of a table of `other` to that of the same name and columns here, one by one. Throws Error{bad_input}
  // about `other` when it has rows that this table does not take.
  void copy_rows(const Database& other, const std::string& table);

  [[nodiscard]] const std::string& shown() const;
  // Throws Error{bad_input}: the file is not what it should be.
  [[noreturn]] void damaged(std::string found) const;

 private:
  std::unique_ptr<Connection> connection_;
};

}  // namespace kinespace::sqlite
