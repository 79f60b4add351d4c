// The host side of dtw_groups.cl: one work-group a pair.

#include "kinespace/base/parallel.h"
#include "kinespace/kernels/detail/dtw_opencl.h"

namespace kinespace::dtw_detail {
namespace {

constexpr std::size_t kSide = 64;  // items of a group

// As dtw_groups.cl has it.
struct Job {
  cl_ulong border = 0;
  cl_ulong steps = 0;
  cl_int query_row = 0;
  cl_int target_row = 0;
  cl_int n = 0;
  cl_int m = 0;
  cl_int band = 0;
  cl_int unused = 0;
};

std::uint64_t words_of_row(int m) {
  return (static_cast<std::uint64_t>(m) + 15) / 16;
}

Job job_of(const DeviceTask& task, const DevicePair& pair) {
  return {.query_row = task.query_clips.first_row[pair.query],
          .target_row = task.packed_targets().first_row[pair.target],
          .n = task.queries.rows(pair.query),
          .m = task.targets.rows(pair.target),
          .band = static_cast<cl_int>(task.region(pair).band)};
}

void run(DeviceTask& task, cl::Kernel& kernel, std::span<const DevicePair> pairs, std::span<const Job> jobs,
         std::uint64_t border_pairs, std::uint64_t step_words, std::span<DtwMatch> matches) {
  std::vector<float> costs(jobs.size());
  const auto cost_buffer = task.device.scratch(costs.size() * sizeof(float));
  const auto borders = task.device.scratch(border_pairs * 2 * sizeof(float));
  const auto step_buffer = task.device.scratch(task.options.want_path ? step_words * sizeof(cl_uint) : 1);
  const auto job_buffer = task.device.input(jobs);
  set_arguments(kernel, task.query_values, task.target_values, cl_int{task.queries.dims},
                cl_int{task.query_clips.stride}, job_buffer, cl_int{task.options.band_fraction > 0},
                cl_int{task.options.squared}, cl_int{task.transposed}, borders, step_buffer, cost_buffer);
  task.device.launch(KernelFamily::dtw, task.queue, kernel, cl::NDRange(jobs.size() * kSide), cl::NDRange(kSide));
  task.queue.enqueueReadBuffer(cost_buffer, CL_TRUE, 0, costs.size() * sizeof(float), costs.data());
  for (std::size_t p = 0; p < pairs.size(); ++p) matches[pairs[p].match].cost = costs[p];
  if (!task.options.want_path) return;

  auto* steps = static_cast<cl_uint*>(
      task.queue.enqueueMapBuffer(step_buffer, CL_TRUE, CL_MAP_READ, 0, step_words * sizeof(cl_uint)));
  parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t p) {
    auto& match = matches[pairs[p].match];
    if (!match.found()) return;
    const cl_uint* own = steps + jobs[p].steps;
    const auto words = words_of_row(jobs[p].m);
    match.path = task.path(pairs[p], [&](int i, int j) {
      return (own[static_cast<std::uint64_t>(i) * words + static_cast<std::uint64_t>(j / 16)] >> (2 * (j % 16))) & 3U;
    });
  });
  task.queue.enqueueUnmapMemObject(step_buffer, steps);
  task.queue.finish();
}

}  // namespace

void match_in_groups(DeviceTask& task, std::span<DtwMatch> matches, std::vector<std::size_t>& left_over) {
  auto kernel = task.kernel(opencl_source::dtw_groups, "dtw_groups");
  const auto most_words =
      task.options.want_path ? task.step_bytes() / sizeof(cl_uint) : std::numeric_limits<std::uint64_t>::max();
  const auto most_borders = task.scratch_bytes() / (2 * sizeof(float));
  std::vector<DevicePair> batch;
  std::vector<Job> jobs;
  std::uint64_t words = 0;
  std::uint64_t borders = 0;
  const auto flush = [&] {
    if (!batch.empty()) run(task, kernel, batch, jobs, borders, words, matches);
    batch.clear();
    jobs.clear();
    words = 0;
    borders = 0;
  };
  for (const auto& pair : task.pairs) {
    Job job = job_of(task, pair);
    const auto own_words = static_cast<std::uint64_t>(job.n) * words_of_row(job.m);
    const auto own_border = static_cast<std::uint64_t>(job.m);
    if (own_words > most_words || own_border > most_borders) {
      left_over.push_back(pair.match);
      continue;
    }
    if (words + own_words > most_words || borders + own_border > most_borders) flush();
    job.steps = words;
    job.border = borders;
    words += own_words;
    borders += own_border;
    batch.push_back(pair);
    jobs.push_back(job);
  }
  flush();
}

}  // namespace kinespace::dtw_detail
