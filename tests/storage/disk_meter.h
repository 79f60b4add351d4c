// What this process reads from files and changes on the disk, counted at the calls that do it; and a death by SIGKILL
// at any of the changes. Counts pread, pwrite, fdatasync, unlink and rename, which is how SQLite and libraries get
// there.
#pragma once

#include <cstdint>

namespace kinespace::test {

class DiskMeter {
 public:
  DiskMeter();  // counts from here on
  [[nodiscard]] std::int64_t bytes_read() const;
  [[nodiscard]] std::int64_t changes() const;

 private:
  std::int64_t start_read_;
  std::int64_t start_changes_;
};

// From here on the process is killed when it is about to make its n-th change, n >= 1.
void die_at_change(std::int64_t n);

}  // namespace kinespace::test
