// OpenCL in tests: no device is a failure in CI and a visible skip elsewhere.
#pragma once

#include <gtest/gtest.h>

#include "kinespace/kernels/device.h"
#include "tests/support/data.h"

#define KINESPACE_REQUIRE_OPENCL()                                                         \
  if (const auto list = ::kinespace::list_opencl_devices(); list.devices.empty()) {        \
    if (::kinespace::test::data_required()) FAIL() << "no OpenCL device: " << list.reason; \
    GTEST_SKIP() << list.reason;                                                           \
  }                                                                                        \
  static_assert(true)
