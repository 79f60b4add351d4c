// Leave to call BLAS or LAPACK, held by a thread while it does.
//
// OpenBLAS takes 128 MiB of address space for every thread that is inside it, keeps it for later calls, and where there
// is none (a limit on address space) tries again without end. So every call asks first: a thread that finds no room
// waits for the room of another, and where there is none at all, that is an error.
#pragma once

namespace kinespace {

class BlasCall {
 public:
  // Throws Error{machine} when there is no room for a single thread.
  BlasCall();
  ~BlasCall();
  BlasCall(const BlasCall&) = delete;
  BlasCall& operator=(const BlasCall&) = delete;
};

}  // namespace kinespace
