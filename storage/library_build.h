// Building a library so that nothing is lost: the old file stays as it is until the new one is complete.
//
// Beside the target LIB.kspace stand while it is built
//
//   LIB.kspace.partial   what was imported so far, committed in batches. It survives a kill, and the next build with
//                        the same fingerprint goes on from there. A power cut may cost it: then it is found to be
//                        damaged and the build starts over. Its lock keeps two builds of one library apart.
//   LIB.kspace.new       the library's rows, once library() was called. Worth nothing after a kill; made anew.
//
// finish() flushes the new file to the disk, renames it over the target and removes the partial one, so a reader sees
// the old library or the new one; a process that has the old one open keeps reading it. Extending copies the old rows
// into a file made anew for the same reason: a transaction in place would have been as safe, but would make readers
// wait, and the target could not stay readable on its own while a journal lies beside it. Rows, not pages, so that
// nothing of a file that came from elsewhere survives but what is read from it.
//
//   LibraryBuild build("moves.kspace", {.fingerprint = options_text});
//   for (file : files) {
//     if (auto known = build.find_import(key)) use(*known);
//     else build.keep_import(key, import(file));
//   }
//   ... analyse ...
//   fill(build.library());
//   build.finish();
//
// Throws Error{machine} when the disk is full, the folder cannot be written or another process builds the same library;
// Error{usage} when the target is a file of another sort, which is never overwritten. A process that limits its files
// (RLIMIT_FSIZE) must ignore SIGXFSZ to get the error instead of the signal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/base/bytes.h"
#include "kinespace/storage/library.h"

namespace kinespace {

struct LibraryBuildOptions {
  // Everything that what is kept depends on: the version of the importer, its options. A partial file with another
  // fingerprint is thrown away. Any text; may not be empty.
  std::string fingerprint;
  // Start from the rows of the library that is there; it must exist and be sound. A partial file is then used only with
  // the very library that it was begun for.
  bool extend = false;
  // Imports are committed after so many, and whenever half a second has passed: what a kill can cost.
  int imports_per_commit = 64;  // 1 to 100000

  // Throws Error{usage}.
  void validate() const;
};

class LibraryBuild {
 public:
  LibraryBuild(const std::filesystem::path& target, const LibraryBuildOptions& options);
  // Without finish(): the target stays as it was, what was imported is kept (or nothing is left, if nothing was).
  ~LibraryBuild();
  LibraryBuild(const LibraryBuild&) = delete;
  LibraryBuild& operator=(const LibraryBuild&) = delete;

  [[nodiscard]] const std::filesystem::path& target() const noexcept;

  // How many imports (keys) a build before this one left.
  [[nodiscard]] std::int64_t resumed_imports() const noexcept;
  // Imports: results of work on one source each, by a key that changes with the source's content (its hash). May be
  // called from several threads. nullopt when there is none, or when what is there is damaged.
  [[nodiscard]] std::optional<Bytes> find_import(std::string_view key) const;
  [[nodiscard]] std::vector<std::string> import_keys() const;  // in the order they were kept
  // Replaces an import of the same key.
  void keep_import(std::string_view key, std::span<const std::byte> blob);
  // Commits what was kept so far.
  void checkpoint();

  // The library's rows: empty, or those of the old library when extending. Already in a transaction.
  [[nodiscard]] Library& library();
  // Puts the library in place. Throws Error{usage} when retrieval vectors of a space differ in length. After an error
  // the build can be resumed; after success this object has nothing left to do.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kinespace
