// How fast the kernels are on this machine, here and on its OpenCL device: what "auto" goes by.
//
// Every family is timed on both sides with a small and a large call (the best of three). The time of a call is taken to
// be a start and a rate,
//
//   t(f) = overhead + f / rate          f: floating-point operations,
//
// and the device pays from the f on at which it is done first, its start-up (opening it, loading the program that the
// driver compiled before) counted with every call, so that one call alone is never slower for it:
//
//   from = (device overhead + start-up - processor overhead) / (1 / processor rate - 1 / device rate)
//
// and never where its rate is not at least a tenth above the processor's. A calibration is of one device with one driver
// beside one number of threads, and is kept in a file of the user's cache.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/kernels/device.h"

namespace kinespace {

struct KernelSpeed {
  KernelFamily family = KernelFamily::dtw;
  double processor_rate = 0;        // floating-point operations per second, > 0
  double processor_overhead_s = 0;  // of a call, >= 0
  double device_rate = 0;
  double device_overhead_s = 0;
  double startup_s = 0;  // before the first call, >= 0

  // Operations of a call from which on the device pays; infinity: never.
  [[nodiscard]] double from_flops() const;
};

struct DeviceCalibration {
  std::string device;  // DeviceInfo::name
  std::string platform;
  std::string driver_version;
  int threads = 0;  // of the processor
  std::vector<KernelSpeed> kernels;

  // Infinity for a family that was not measured.
  [[nodiscard]] double from_flops(KernelFamily family) const;
};

// Measures the device that `choice` names ("opencl": the best); takes seconds. Throws Error{machine} when it is not
// there, Error{usage} for "auto" and "cpu".
[[nodiscard]] DeviceCalibration calibrate(const std::string& choice = "opencl", const Progress& progress = {});

// That of this device as it is now beside this processor, nullptr: none.
[[nodiscard]] const DeviceCalibration* find_calibration(const std::vector<DeviceCalibration>& known,
                                                        const DeviceInfo& device);

// $XDG_CACHE_HOME/kinespace/devices.json, or that of ~/.cache; empty when neither variable names a folder.
[[nodiscard]] std::filesystem::path calibration_file();

struct KnownCalibrations {
  std::vector<DeviceCalibration> devices;
  std::string damage;  // why the file was ignored; empty when it was not, or is not there
};
// Never throws for what is in the file: what cannot be read as it was written is as if it were not there.
[[nodiscard]] KnownCalibrations read_calibrations(const std::filesystem::path& file = calibration_file());

// Makes the folder of the file; throws Error{machine} when that cannot be done or a folder is in the file's place.
void require_calibration_folder(const std::filesystem::path& file = calibration_file());

// Puts it into the file, in place of an older one of the same device; makes the folder. Throws Error{machine} when that
// cannot be done.
void keep_calibration(const DeviceCalibration& calibration, const std::filesystem::path& file = calibration_file());

// Compute::open, with "auto" by what the user's cache knows.
[[nodiscard]] Compute open_calibrated(const std::string& choice = "auto");

}  // namespace kinespace
