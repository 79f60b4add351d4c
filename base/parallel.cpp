#include "kinespace/base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

namespace kinespace {

void throw_if_cancelled() {
  if (tbb::is_current_task_group_canceling()) throw LoopCancelled{};
}

void parallel_internal::run(std::int64_t first, std::int64_t last, const void* body,
                            void (*steps)(const void* body, std::int64_t begin, std::int64_t end)) {
  tbb::parallel_for(tbb::blocked_range<std::int64_t>(first, last),
                    [&](const tbb::blocked_range<std::int64_t>& part) { steps(body, part.begin(), part.end()); });
  throw_if_cancelled();
}

}  // namespace kinespace
