// A header of the user's program, named as one of ours.
#pragma once

namespace user {
struct Error {
  int code = 0;
};
}  // namespace user
