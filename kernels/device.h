// What computes: the processor, or an OpenCL 1.2 device (a GPU, or the processor again through PoCL).
//
// A Compute is handed to every kernel. It is cheap to copy (copies share their state) and may be used from several
// threads. Opening "auto" touches no OpenCL library; the first kernel call of a size that profits does. Programs are
// built once per device and build options and kept in the Compute; nothing is cached on the disk (PoCL keeps its own
// cache, where a build takes about 0.02 s instead of 0.5 s).
//
// "No device" is a returned state: an empty list with a reason, and for "auto" the processor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace kinespace {

struct DeviceInfo {
  std::string name;
  std::string platform;
  std::string type;  // "cpu", "gpu", "accelerator" or "other"
  int compute_units = 0;
  std::uint64_t memory_bytes = 0;
  bool fp64 = false;           // double precision in kernels
  std::string driver_version;  // as the driver says it
};

struct DeviceList {
  std::vector<DeviceInfo> devices;  // in the order of "opencl:N"
  std::string reason;               // why there is none, and what to do; empty when there is one
};

// The OpenCL devices of this machine that can compile and run kernels.
[[nodiscard]] DeviceList list_opencl_devices();
[[nodiscard]] std::vector<DeviceInfo> list_devices();

// The shapes that a kernel has: `lanes` interleaves 16 problems in float16 values, one work-item a group, for
// processors; `groups` uses many scalar work-items with local memory, for GPUs. Both run everywhere.
enum class KernelVariant { by_device, lanes, groups };

// The kernels, for the sizes at which "auto" goes to OpenCL.
enum class KernelFamily { keyframe_distances, dtw, covariance, projection, local_linear };

class OpenClDevice;  // kernels/detail/opencl.h, internal

class Compute {
 public:
  // The processor.
  Compute();

  // "auto": what is measured faster for the size of each call; "cpu"; "opencl": the best OpenCL device (a GPU before a
  // processor); "opencl:N": device N of list_devices(). Throws Error{usage} for another choice and Error{machine} when
  // a device is named that is not there.
  [[nodiscard]] static Compute open(const std::string& choice = "auto");

  [[nodiscard]] const std::string& choice() const;

  // One line: what runs the kernels and with what precision. Under "auto" it names the OpenCL device once one was used.
  [[nodiscard]] std::string describe() const;

  // The same device with another kernel shape; for tests and benches.
  [[nodiscard]] Compute with_variant(KernelVariant variant) const;

  // The same device as if it had no double precision; for tests.
  [[nodiscard]] Compute without_double() const;

  // The device for one call with that many floating-point operations, or nullptr: compute on the processor. Opens the
  // device when that is still to be done.
  [[nodiscard]] OpenClDevice* device_for(KernelFamily family, double flops) const;

  // True when this device should run the `lanes` shape.
  [[nodiscard]] bool uses_lanes(const OpenClDevice& device) const;

  // True when kernels with a double form should run it.
  [[nodiscard]] bool uses_double(const OpenClDevice& device) const;

 private:
  struct State;
  explicit Compute(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
  KernelVariant variant_ = KernelVariant::by_device;
  bool may_use_double_ = true;
};

// Makes the BLAS library compute on the calling thread only; parallel work is divided by this library, over blocks
// whose bounds do not depend on the number of threads, so that neither do the results. Called by every kernel that uses
// BLAS; the setting is OpenBLAS's own, for the whole process.
void use_single_threaded_blas();

}  // namespace kinespace
