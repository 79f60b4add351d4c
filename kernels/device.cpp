#include "kinespace/kernels/device.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>

#include <cblas.h>

#include "kinespace/base/error.h"
#include "kinespace/kernels/calibration.h"
#include "kinespace/kernels/detail/opencl.h"

namespace kinespace {
namespace {

// Where "auto" leaves the processor for a device that was not measured here: floating-point operations of one call.
// Infinity: never.
//
// `processor`: OpenCL devices that are processors, measured with PoCL 3.1 on two AVX-512 cores (GFLOP/s here and there;
// `kinespace bench kernels` prints them on any machine):
//
//   keyframe_distances   94,  76   1000 x 1000 rows of 128: BLAS wins at every size
//   dtw                  49, 165   all pairs of 200 clips: wins from 16 pairs a query on, but the first call costs 0.1
//                                  to 0.2 s for opening the device and its program
//   covariance          125,  43   1 000 000 curves of 128 points: BLAS wins at every size
//   projection           64,  24   100 000 curves of 128 points, 20 functions: BLAS wins at every size
//   local_linear         34,  46   200 x 200 points, which take 2 ms: nothing to win
//
// `gpu`: the others; estimates, from data that cross a bus at 10 GB/s.
struct Threshold {
  KernelFamily family;
  double processor;
  double gpu;
};
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::array kThresholds{
    Threshold{KernelFamily::keyframe_distances, kNever, 1e10}, Threshold{KernelFamily::dtw, 5e9, 5e9},
    Threshold{KernelFamily::covariance, kNever, 1e11},         Threshold{KernelFamily::projection, kNever, 1e11},
    Threshold{KernelFamily::local_linear, kNever, 1e11},
};

const Threshold& threshold_of(KernelFamily family) {
  return *std::find_if(kThresholds.begin(), kThresholds.end(),
                       [&](const Threshold& threshold) { return threshold.family == family; });
}

std::size_t index_of(KernelFamily family) {
  return static_cast<std::size_t>(std::find(kernel_families.begin(), kernel_families.end(), family) -
                                  kernel_families.begin());
}

std::optional<std::size_t> device_number(const std::string& choice) {
  const std::string prefix = "opencl:";
  if (!choice.starts_with(prefix)) return std::nullopt;
  std::size_t number = 0;
  const char* end = choice.data() + choice.size();
  const auto [stop, error] = std::from_chars(choice.data() + prefix.size(), end, number);
  if (error != std::errc() || stop != end) return std::nullopt;
  return number;
}

std::size_t best_of(const std::vector<cl::Device>& devices) {
  const auto gpu = std::find_if(devices.begin(), devices.end(), [](const cl::Device& device) {
    return (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_GPU) != 0;
  });
  return gpu == devices.end() ? 0 : static_cast<std::size_t>(gpu - devices.begin());
}

[[noreturn]] void no_such_device(const std::string& choice, std::size_t count, const std::string& reason) {
  throw Error(ErrorKind::machine, {.found = reason.empty() ? std::to_string(count) + " OpenCL devices" : reason,
                                   .expected = "the device '" + choice + "'",
                                   .remedy = "see `kinespace devices`, or choose auto or cpu"});
}

}  // namespace

struct Compute::State {
  std::string choice = "cpu";
  std::once_flag opening;
  std::unique_ptr<OpenClDevice> device;
  std::string reason;  // why "auto" found no device
  std::atomic<bool> opened = false;
  std::vector<DeviceCalibration> known;            // measured on this machine
  const DeviceCalibration* calibration = nullptr;  // of the device that "auto" opened, if it is among them
  std::array<std::atomic<std::uint64_t>, kernel_families.size()> processor_calls = {};

  // Opens the device that the choice names; throws Error{machine} when it is not there.
  void open_named() {
    const auto devices = find_opencl_devices(reason);
    const std::size_t chosen = device_number(choice).value_or(best_of(devices));
    if (chosen >= devices.size()) no_such_device(choice, devices.size(), reason);
    device = std::make_unique<OpenClDevice>(devices[chosen]);
    opened = true;
  }

  // Opens the best device once, if there is one; a driver that fails is a reason for the processor.
  void open_best() {
    std::call_once(opening, [this] {
      try {
        const auto devices = find_opencl_devices(reason);
        if (!devices.empty()) device = std::make_unique<OpenClDevice>(devices[best_of(devices)]);
        if (device != nullptr) calibration = find_calibration(known, device->info());
      } catch (const Error& error) {
        reason = error.what();
      }
      opened = true;
    });
  }

  // The least that any device that might be there would be opened for, so that a small call need not even look.
  [[nodiscard]] double least_threshold(KernelFamily family) const {
    const Threshold& other_machines = threshold_of(family);
    double least = std::min(other_machines.processor, other_machines.gpu);
    for (const DeviceCalibration& measured : known) least = std::min(least, measured.from_flops(family));
    return least;
  }
  // Of the device that is open.
  [[nodiscard]] double threshold(KernelFamily family) const {
    if (calibration != nullptr) return calibration->from_flops(family);
    const Threshold& other_machines = threshold_of(family);
    return device->is_processor() ? other_machines.processor : other_machines.gpu;
  }

  // The device that the choice gives such a call, if any.
  [[nodiscard]] OpenClDevice* chosen(KernelFamily family, double flops) {
    if (choice == "cpu") return nullptr;
    if (choice != "auto") return device.get();
    if (flops < least_threshold(family)) return nullptr;
    open_best();
    return device == nullptr || flops < threshold(family) ? nullptr : device.get();
  }
};

std::string_view name_of(KernelFamily family) {
  constexpr std::array<std::string_view, kernel_families.size()> names{"keyframe_distances", "dtw", "covariance",
                                                                       "projection", "local_linear"};
  return names[index_of(family)];
}

KernelUses since(const KernelUses& before, const KernelUses& now) {
  KernelUses out = now;
  for (std::size_t f = 0; f < out.size(); ++f) {
    out[f].launches -= before[f].launches;
    out[f].processor_calls -= before[f].processor_calls;
  }
  return out;
}

DeviceList list_opencl_devices() {
  DeviceList list;
  for (const auto& device : find_opencl_devices(list.reason)) list.devices.push_back(describe_opencl_device(device));
  return list;
}

std::vector<DeviceInfo> list_devices() {
  return list_opencl_devices().devices;
}

Compute::Compute() : state_(std::make_shared<State>()) {}

Compute::Compute(std::shared_ptr<State> state) : state_(std::move(state)) {}

Compute Compute::open(const std::string& choice) {
  return open(choice, {});
}

Compute Compute::open(const std::string& choice, std::vector<DeviceCalibration> known) {
  const bool named = choice == "opencl" || device_number(choice).has_value();
  if (!named && choice != "auto" && choice != "cpu") {
    throw Error(ErrorKind::usage,
                {.found = "device '" + choice + "'", .expected = "auto, cpu, opencl or opencl:N with N from 0"});
  }
  auto state = std::make_shared<State>();
  state->choice = choice;
  state->known = std::move(known);
  if (named) state->open_named();
  return Compute(std::move(state));
}

const std::string& Compute::choice() const {
  return state_->choice;
}

std::string Compute::describe() const {
  std::string processor =
      "cpu (" + std::to_string(std::max(1U, std::thread::hardware_concurrency())) + " threads, float and double)";
  if (state_->choice == "cpu") return processor;
  if (!state_->opened) return processor + "; OpenCL not needed so far";
  if (state_->device == nullptr) return processor + "; " + state_->reason;
  const auto& info = state_->device->info();
  const std::string device = info.name + " through " + info.platform + " (" + info.type + ", float" +
                             (info.fp64 ? " and double" : ", no double") + ")";
  return state_->choice == "auto" ? processor + "; " + device + " for large kernels" : device;
}

std::optional<DeviceInfo> Compute::device_info() const {
  if (!state_->opened || state_->device == nullptr) return std::nullopt;
  return state_->device->info();
}

Compute Compute::with_variant(KernelVariant variant) const {
  Compute other(*this);
  other.variant_ = variant;
  return other;
}

Compute Compute::without_double() const {
  Compute other(*this);
  other.may_use_double_ = false;
  return other;
}

OpenClDevice* Compute::device_for(KernelFamily family, double flops) const {
  auto* device = state_->chosen(family, flops);
  if (device == nullptr) count_on_processor(family);
  return device;
}

void Compute::count_on_processor(KernelFamily family) const {
  state_->processor_calls[index_of(family)].fetch_add(1, std::memory_order_relaxed);
}

KernelUses Compute::uses() const {
  KernelUses out;
  for (std::size_t f = 0; f < out.size(); ++f) {
    out[f].processor_calls = state_->processor_calls[f].load(std::memory_order_relaxed);
    // A device that is being opened by another thread has launched nothing yet.
    if (state_->opened && state_->device != nullptr) out[f].launches = state_->device->launches(f);
  }
  return out;
}

bool Compute::uses_lanes(const OpenClDevice& device) const {
  return variant_ == KernelVariant::by_device ? device.is_processor() : variant_ == KernelVariant::lanes;
}

bool Compute::uses_double(const OpenClDevice& device) const {
  return may_use_double_ && device.info().fp64;
}

void use_single_threaded_blas() {
  static const bool once = (openblas_set_num_threads(1), true);
  static_cast<void>(once);
}

}  // namespace kinespace
