#include "kinespace/base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#ifdef KINESPACE_TELL_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>
#endif

namespace kinespace {
namespace {

// oneTBB hands steps over to other threads, and what they made back, inside a library that ThreadSanitizer cannot see
// into: tells it of both.
class SeenByThreadSanitizer {
 public:
#ifdef KINESPACE_TELL_THREAD_SANITIZER
  SeenByThreadSanitizer() {
    __tsan_release(&given_);
  }
  void begin_steps() {
    __tsan_acquire(&given_);
  }
  void end_steps() {
    __tsan_release(&made_);
  }
  void end_loop() {
    __tsan_acquire(&made_);
  }

 private:
  char given_ = 0;
  char made_ = 0;
#else
  void begin_steps() {}
  void end_steps() {}
  void end_loop() {}
#endif
};

}  // namespace

void parallel_internal::run(std::int64_t first, std::int64_t last, const void* body,
                            void (*steps)(const void* body, std::int64_t begin, std::int64_t end)) {
  SeenByThreadSanitizer seen;
  tbb::parallel_for(tbb::blocked_range<std::int64_t>(first, last), [&](const tbb::blocked_range<std::int64_t>& part) {
    seen.begin_steps();
    steps(body, part.begin(), part.end());
    seen.end_steps();
  });
  seen.end_loop();
  if (tbb::is_current_task_group_canceling()) throw LoopCancelled{};
}

}  // namespace kinespace
