// A header of the user's program, named as one of ours.
#pragma once

#include "base/error.h"

namespace user {
using Clip = Error;
}  // namespace user
