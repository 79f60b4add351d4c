// The library file (LIB.kspace): one SQLite database with skeletons, motion spaces, clips and what was computed for
// them.
//
// Any SQLite tool can read it; storage/detail/library_schema.cpp has the tables. A Library is a movable connection for one
// thread at a time; threads that read at once open one each.
//
// Errors, all of type Error and naming the file:
//   bad_input  no library, one of a newer kinespace, cut short or damaged. Opening checks the header, the size of the
//              file and the tables; damage further in shows when it is read. Never a crash, whatever the bytes.
//   machine    disk full, no rights, in use by another process; what was committed before stays.
//   usage      rows that cannot be: two clips of a name, a clip of a space that is not there, a rate of 0.
//
// Whole libraries are built with LibraryBuild (storage/library_build.h), which replaces the file in one step. Writing
// into a library in place (open) is for small additions; it too is all or nothing, by SQLite's journal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/storage/library_rows.h"

namespace kinespace {

namespace sqlite {
class Database;
}

class Library {
 public:
  // A new, empty library. Throws Error{usage} when there is such a file.
  [[nodiscard]] static Library create(const std::filesystem::path& path);
  // To read and write in place.
  [[nodiscard]] static Library open(const std::filesystem::path& path);
  // To read; the folder need not be writable.
  [[nodiscard]] static Library open_read_only(const std::filesystem::path& path);
  // Whether the file begins like a library (an SQLite database marked as kinespace's). Says nothing about the rest.
  [[nodiscard]] static bool looks_like_library(std::span<const std::byte> start);

  ~Library();
  Library(Library&& other) noexcept;
  Library& operator=(Library&& other) noexcept;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  // Free-form facts about the library; keys are unique, set replaces.
  void set_metadata(std::string_view key, std::string_view value);
  [[nodiscard]] std::optional<std::string> metadata(std::string_view key) const;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> all_metadata() const;  // by key
  // A fact that is a number; nullopt when there is none. Throw Error{bad_input} when it is no number, or no count: a
  // whole number from 0 to 2^31 - 1.
  [[nodiscard]] std::optional<double> metadata_number(std::string_view key) const;
  [[nodiscard]] std::optional<std::int64_t> metadata_count(std::string_view key) const;

  // Returns the id: that of the row that has the same tree and blob already, else a new one. row.id is not looked at.
  std::int64_t add_skeleton(const SkeletonRow& row);
  // Throws Error{bad_input} when there is none.
  [[nodiscard]] SkeletonRow skeleton(std::int64_t id) const;
  [[nodiscard]] std::vector<SkeletonRow> skeletons() const;  // by id

  // Adds a space, or replaces that of the same name, whose id stays. row.id is not looked at. Returns the id.
  std::int64_t put_space(const SpaceRow& row);
  [[nodiscard]] SpaceRow space(std::int64_t id) const;
  [[nodiscard]] std::vector<SpaceRow> spaces() const;  // by id, without their blobs

  // Returns the new id; row.id is not looked at. Throws Error{bad_input} when the name is taken, naming both sources.
  std::int64_t add_clip(const ClipRow& row, const ClipBlobs& blobs);
  // Replaces all blobs of a clip (after its space was computed anew).
  void replace_clip_blobs(std::int64_t id, const ClipBlobs& blobs);
  void remove_clip(std::int64_t id);
  [[nodiscard]] std::vector<ClipRow> clips() const;  // by id
  // By its exact name; nullopt when there is none.
  [[nodiscard]] std::optional<ClipRow> find_clip(std::string_view name) const;
  [[nodiscard]] ClipRow clip(std::int64_t id) const;

  [[nodiscard]] Bytes clip_blob(std::int64_t id, ClipBlob which) const;
  [[nodiscard]] std::vector<float> retrieval_vector(std::int64_t id) const;
  // Calls `visit` for each clip of a space, by id, with bytes that are valid during the call. One pass over the file:
  // the way to read everything.
  void for_each_blob(std::int64_t space_id, ClipBlob which,
                     const std::function<void(std::int64_t id, std::span<const std::byte> blob)>& visit) const;
  [[nodiscard]] RetrievalMatrix retrieval_matrix(std::int64_t space_id) const;

  // What else was computed and is worth keeping: neighbour graphs, contact labels. put replaces.
  void put_artifact(std::string_view kind, std::string_view key, std::span<const std::byte> blob);
  [[nodiscard]] std::optional<Bytes> artifact(std::string_view kind, std::string_view key) const;
  [[nodiscard]] std::vector<std::string> artifact_keys(std::string_view kind) const;  // sorted
  void remove_artifact(std::string_view kind, std::string_view key);

  [[nodiscard]] LibraryTotals totals() const;
  // Reads the whole file and throws Error{bad_input} when SQLite or the checksums of the retrieval vectors find damage.
  void check() const;

 private:
  friend class Transaction;
  friend class LibraryBuild;
  Library(std::filesystem::path path, std::unique_ptr<sqlite::Database> database);

  std::filesystem::path path_;
  std::unique_ptr<sqlite::Database> database_;
};

// Makes what is written during its life all or nothing, and fast: without one each call is written through to the disk
// on its own. Transactions nest; an inner one that was not committed takes back its own part only.
class Transaction {
 public:
  explicit Transaction(Library& library);
  // Takes back what was not committed.
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  void commit();

 private:
  sqlite::Database& database_;
  bool outermost_ = false;
  bool open_ = false;
};

}  // namespace kinespace
