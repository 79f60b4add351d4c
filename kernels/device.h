// What computes: the processor, or an OpenCL 1.2 device (a GPU, or the processor again through PoCL).
//
// A Compute is handed to every kernel. It is cheap to copy (copies share their state) and may be used from several
// threads. Opening "auto" touches no OpenCL library; the first kernel call of a size that profits does. Programs are
// built once per device and build options and kept in the Compute; nothing is cached on the disk (PoCL keeps its own
// cache, where a build takes about 0.02 s instead of 0.5 s).
//
// Under "auto" every call goes where calls of its size are faster: by what was measured on this machine
// (kernels/calibration.h) when that is handed over, else by figures of other machines, under which a processor that
// shows itself as an OpenCL device gets large time warping only.
//
// A Compute counts what its kernels do, so that a program can say what ran where.
//
// "No device" is a returned state: an empty list with a reason, and for "auto" the processor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
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
inline constexpr std::array kernel_families{KernelFamily::keyframe_distances, KernelFamily::dtw,
                                            KernelFamily::covariance, KernelFamily::projection,
                                            KernelFamily::local_linear};
// "keyframe_distances", "dtw" and so on.
[[nodiscard]] std::string_view name_of(KernelFamily family);

// What the kernels of a family did.
struct KernelUse {
  std::uint64_t launches = 0;         // of OpenCL kernels; one call may take several
  std::uint64_t processor_calls = 0;  // calls that were computed by the plain code
};
// By family, in the order of kernel_families.
using KernelUses = std::array<KernelUse, kernel_families.size()>;
// What was added since `before`.
[[nodiscard]] KernelUses since(const KernelUses& before, const KernelUses& now);

class OpenClDevice;        // kernels/detail/opencl.h, internal
struct DeviceCalibration;  // kernels/calibration.h

class Compute {
 public:
  // The processor.
  Compute();

  // "auto": what is measured faster for the size of each call; "cpu"; "opencl": the best OpenCL device (a GPU before a
  // processor); "opencl:N": device N of list_devices(). Throws Error{usage} for another choice and Error{machine} when
  // a device is named that is not there.
  [[nodiscard]] static Compute open(const std::string& choice = "auto");
  // The same; "auto" goes by what was measured of its device, where that is among `known`.
  [[nodiscard]] static Compute open(const std::string& choice, std::vector<DeviceCalibration> known);

  [[nodiscard]] const std::string& choice() const;

  // One line: what runs the kernels and with what precision. Under "auto" it names the OpenCL device once one was used.
  [[nodiscard]] std::string describe() const;

  // The OpenCL device that is open; none on the processor, and under "auto" as long as none was needed.
  [[nodiscard]] std::optional<DeviceInfo> device_info() const;

  // The same device with another kernel shape; for tests and benches.
  [[nodiscard]] Compute with_variant(KernelVariant variant) const;

  // The same device as if it had no double precision; for tests.
  [[nodiscard]] Compute without_double() const;

  // The device for one call with that many floating-point operations, or nullptr: compute on the processor, which is
  // then counted. Opens the device when that is still to be done.
  [[nodiscard]] OpenClDevice* device_for(KernelFamily family, double flops) const;
  // Counts a call that the processor computed though there was a device for it.
  void count_on_processor(KernelFamily family) const;

  // What has run so far through this Compute and its copies.
  [[nodiscard]] KernelUses uses() const;

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
