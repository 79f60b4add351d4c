// The error that a piece of work ends with.
#pragma once

#include <functional>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"

namespace kinespace::test {

// A failure where there is none.
inline Error error_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {ErrorKind::usage, {}};
}

}  // namespace kinespace::test
