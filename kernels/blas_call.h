// Leave to call BLAS or LAPACK, held by a thread while it does.
//
// OpenBLAS takes 128 MiB of address space for every thread that is inside it, keeps it for later calls, and where there
// is none (a limit on address space) tries again without end. So under such a limit one thread at a time is inside, and
// the first asks whether there is room before OpenBLAS does. Without a limit this costs nothing.
#pragma once

#include <mutex>

namespace kinespace {

class BlasCall {
 public:
  // Throws Error{machine} when there is no room.
  BlasCall();

 private:
  std::unique_lock<std::mutex> alone_;  // holds nothing without a limit
};

}  // namespace kinespace
