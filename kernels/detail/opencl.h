// Internal: an opened OpenCL device with its programs. Include it from kernels/*_opencl.cpp only.
#pragma once

#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_HPP_ENABLE_EXCEPTIONS
#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <CL/opencl.hpp>

#include "kinespace/base/error.h"
#include "kinespace/kernels/device.h"

namespace kinespace {

// The kernel sources, embedded by CMake: kernels/x.cl is opencl_source::x.
namespace opencl_source {
extern const char* const covariance;
extern const char* const dtw_groups;
extern const char* const dtw_lanes;
extern const char* const keyframe_distance;
extern const char* const local_linear;
extern const char* const projection;
}  // namespace opencl_source

// Calls into OpenCL and turns its errors into Error{machine}.
template <typename Call>
decltype(auto) opencl_call(const char* what, Call&& call) {
  try {
    return std::forward<Call>(call)();
  } catch (const cl::Error& error) {
    throw Error(ErrorKind::machine, {.found = std::string("OpenCL error ") + std::to_string(error.err()) + " in " +
                                              error.what() + " (" + what + ")",
                                     .expected = "a working OpenCL device",
                                     .remedy = "choose --device cpu"});
  }
}

class OpenClDevice {
 public:
  explicit OpenClDevice(cl::Device device);

  [[nodiscard]] const cl::Device& device() const { return device_; }
  [[nodiscard]] const DeviceInfo& info() const { return info_; }
  [[nodiscard]] bool is_processor() const { return info_.type == "cpu"; }
  [[nodiscard]] std::uint64_t largest_buffer() const { return largest_buffer_; }

  // A queue for one call; calls from several threads do not wait for each other's.
  [[nodiscard]] cl::CommandQueue queue() const { return {context_, device_}; }

  // A new kernel object of the program, which is built when these options are new. `source` is one of opencl_source.
  [[nodiscard]] cl::Kernel kernel(const char* source, const std::string& options, const char* name);

  // Enqueues a kernel of that family, which is counted. `local` may be cl::NullRange.
  void launch(KernelFamily family, const cl::CommandQueue& queue, const cl::Kernel& kernel, const cl::NDRange& global,
              const cl::NDRange& local = cl::NullRange);
  // How many were, by place in kernel_families.
  [[nodiscard]] std::uint64_t launches(std::size_t family) const {
    return launches_[family].load(std::memory_order_relaxed);
  }

  // Buffers. Processors read the caller's memory in place where the driver allows it; the span must outlive the buffer.
  template <typename T>
  [[nodiscard]] cl::Buffer input(std::span<const T> values) const {
    if (values.empty()) return scratch(sizeof(T));
    const cl_mem_flags placed = is_processor() ? CL_MEM_USE_HOST_PTR : CL_MEM_COPY_HOST_PTR;
    return {context_, CL_MEM_READ_ONLY | placed, values.size_bytes(), const_cast<T*>(values.data())};
  }
  // For results; fetch() waits for the queue and brings them to `to`, the span's memory.
  template <typename T>
  [[nodiscard]] cl::Buffer output(std::span<T> values) const {
    if (!is_processor() || values.empty()) return scratch(values.size_bytes());
    return {context_, CL_MEM_WRITE_ONLY | CL_MEM_USE_HOST_PTR, values.size_bytes(), values.data()};
  }
  void fetch(const cl::CommandQueue& queue, const cl::Buffer& from, void* to, std::size_t bytes) const;
  [[nodiscard]] cl::Buffer scratch(std::size_t bytes) const {
    return {context_, CL_MEM_READ_WRITE, bytes == 0 ? 1 : bytes};
  }

 private:
  cl::Device device_;
  cl::Context context_;
  DeviceInfo info_;
  std::uint64_t largest_buffer_ = 0;
  std::mutex building_;
  std::map<std::pair<const char*, std::string>, cl::Program> programs_;
  std::array<std::atomic<std::uint64_t>, kernel_families.size()> launches_ = {};
};

template <typename... Args>
void set_arguments(cl::Kernel& kernel, const Args&... args) {
  cl_uint at = 0;
  (kernel.setArg(at++, args), ...);
}

// The devices in the order of "opencl:N"; `reason` says why there is none.
[[nodiscard]] std::vector<cl::Device> find_opencl_devices(std::string& reason);
[[nodiscard]] DeviceInfo describe_opencl_device(const cl::Device& device);

}  // namespace kinespace
