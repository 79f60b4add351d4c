#include "kinespace/kernels/detail/opencl.h"

#include <algorithm>

namespace kinespace {
namespace {

constexpr const char* kNoPlatform = "no OpenCL platform found; install pocl-opencl-icd (the processor is used instead)";
constexpr const char* kNoDevice =
    "no OpenCL device with a compiler found; install pocl-opencl-icd or the driver of your GPU (the processor is used "
    "instead)";
constexpr cl_int kPlatformNotFoundKhr = -1001;  // what the ICD loader says when it has no driver

bool is_usable(const cl::Device& device) {
  return device.getInfo<CL_DEVICE_AVAILABLE>() != 0 && device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>() != 0;
}

std::vector<cl::Device> devices_of(const cl::Platform& platform) {
  std::vector<cl::Device> devices;
  try {
    platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
  } catch (const cl::Error& error) {
    if (error.err() != CL_DEVICE_NOT_FOUND) throw;
  }
  std::erase_if(devices, [](const cl::Device& device) { return !is_usable(device); });
  return devices;
}

std::vector<cl::Platform> platforms() {
  std::vector<cl::Platform> found;
  try {
    cl::Platform::get(&found);
  } catch (const cl::Error& error) {
    if (error.err() != kPlatformNotFoundKhr) throw;
  }
  return found;
}

std::string type_name(cl_device_type type) {
  if ((type & CL_DEVICE_TYPE_GPU) != 0) return "gpu";
  if ((type & CL_DEVICE_TYPE_CPU) != 0) return "cpu";
  return (type & CL_DEVICE_TYPE_ACCELERATOR) != 0 ? "accelerator" : "other";
}

}  // namespace

std::vector<cl::Device> find_opencl_devices(std::string& reason) {
  return opencl_call("listing the devices", [&] {
    std::vector<cl::Device> devices;
    const auto found = platforms();
    for (const auto& platform : found) {
      const auto more = devices_of(platform);
      devices.insert(devices.end(), more.begin(), more.end());
    }
    reason = found.empty() ? kNoPlatform : devices.empty() ? kNoDevice : "";
    return devices;
  });
}

DeviceInfo describe_opencl_device(const cl::Device& device) {
  return opencl_call("asking for a device's properties", [&] {
    const cl::Platform platform(device.getInfo<CL_DEVICE_PLATFORM>());
    return DeviceInfo{.name = device.getInfo<CL_DEVICE_NAME>(),
                      .platform = platform.getInfo<CL_PLATFORM_NAME>(),
                      .type = type_name(device.getInfo<CL_DEVICE_TYPE>()),
                      .compute_units = static_cast<int>(device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>()),
                      .memory_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>(),
                      .fp64 = device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0,
                      .driver_version = device.getInfo<CL_DRIVER_VERSION>()};
  });
}

OpenClDevice::OpenClDevice(cl::Device device) : device_(std::move(device)), info_(describe_opencl_device(device_)) {
  opencl_call("opening a device", [&] {
    context_ = cl::Context(device_);
    largest_buffer_ = device_.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  });
}

cl::Kernel OpenClDevice::kernel(const char* source, const std::string& options, const char* name) {
  const std::lock_guard lock(building_);
  auto& program = programs_[{source, options}];
  return opencl_call(name, [&]() -> cl::Kernel {
    if (program() == nullptr) {
      cl::Program fresh(context_, std::string(source));
      try {
        fresh.build(device_, ("-cl-std=CL1.2 " + options).c_str());
      } catch (const cl::BuildError& error) {
        const auto log = error.getBuildLog().empty() ? std::string() : error.getBuildLog().front().second;
        throw Error(ErrorKind::machine, {.found = std::string("the OpenCL compiler rejects ") + name + ": " + log,
                                         .expected = "an OpenCL 1.2 compiler",
                                         .remedy = "choose --device cpu"});
      }
      program = fresh;
    }
    return {program, name};
  });
}

void OpenClDevice::launch(KernelFamily family, const cl::CommandQueue& queue, const cl::Kernel& kernel,
                          const cl::NDRange& global, const cl::NDRange& local) {
  queue.enqueueNDRangeKernel(kernel, cl::NullRange, global, local);
  const auto index = std::find(kernel_families.begin(), kernel_families.end(), family) - kernel_families.begin();
  launches_[static_cast<std::size_t>(index)].fetch_add(1, std::memory_order_relaxed);
}

void OpenClDevice::fetch(const cl::CommandQueue& queue, const cl::Buffer& from, void* to, std::size_t bytes) const {
  if (!is_processor()) {
    queue.enqueueReadBuffer(from, CL_TRUE, 0, bytes, to);
    return;
  }
  // The driver may have used memory of its own: mapping brings the results to the caller's.
  void* mapped = queue.enqueueMapBuffer(from, CL_TRUE, CL_MAP_READ, 0, bytes);
  queue.enqueueUnmapMemObject(from, mapped);
  queue.finish();
}

}  // namespace kinespace
