// Libraries for the tests: rows whose every part is known from their number.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include <sys/types.h>

#include "kinespace/base/error.h"
#include "kinespace/storage/library.h"
#include "tests/support/error_of.h"

namespace kinespace::test {

[[nodiscard]] ClipRow sample_row(int number, std::int64_t space, std::int64_t skeleton);
// `blob_bytes` is about the size of the vectors' blob, a bitstream of kind "test"; `dimensions` that of the retrieval
// vector.
[[nodiscard]] ClipBlobs sample_blobs(int number, std::size_t blob_bytes = 300, std::size_t dimensions = 8);

// Adds a skeleton, a space, an artifact, metadata and clips [0, clips).
void fill_sample(Library& library, int clips, std::size_t blob_bytes = 300, std::size_t dimensions = 8);

// Reads everything there is and fails the test where a row is not as fill_sample made it. Returns the number of clips.
int expect_sample(const Library& library);

// Reads everything there is, whatever it says: errors escape.
void read_everything(const Library& library);

// Opens the file and reads everything; an Error of the machine's or of another type than Error fails the test.
// Returns whether nothing was thrown.
bool survives(const std::filesystem::path& path);

// Writes a file anew without flushing it to the disk, as a test that writes thousands must.
void write_unflushed(const std::filesystem::path& path, std::span<const std::byte> bytes);

// Runs `act` in a process of its own and returns its exit status, or 128 + the signal that ended it. The status is that
// of `act`, or the kind of the Error that escaped from it.
int in_child(const std::function<int()>& act);

// A process beside the test that is killed (SIGKILL) at the end of the scope. The constructor returns once it said that
// it is ready.
class Background {
 public:
  explicit Background(const std::function<void(const std::function<void()>& ready)>& act);
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

 private:
  pid_t child_ = -1;
};

}  // namespace kinespace::test
