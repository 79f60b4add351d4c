#include "cli/device_choice.h"

#include <optional>
#include <utility>

#include "kinespace/base/error.h"
#include "kinespace/kernels/calibration.h"

namespace kinespace::cli {
namespace {

constexpr std::size_t clips_worth_measuring = 1000;

// Measures the device that "auto" would use and keeps that, when it is not known yet.
void measure_unknown_device(std::vector<DeviceCalibration>& known, Session& session) {
  if (list_opencl_devices().devices.empty()) return;
  const std::optional<DeviceInfo> device = Compute::open("opencl").device_info();
  if (!device || find_calibration(known, *device) != nullptr) return;
  session.note("measuring once what is faster on " + device->name + " than by the plain code");
  known.push_back(calibrate("opencl", session.progress()));
  session.finish_progress();
  keep_calibration(known.back());
}

}  // namespace

void add_device_option(CLI::App* command, std::string& choice) {
  command->add_option("--device", choice, "auto, cpu, opencl or opencl:N")->capture_default_str();
}

Compute open_device(const std::string& choice, Session& session, std::size_t clips) {
  if (choice != "auto") return Compute::open(choice);
  KnownCalibrations known = read_calibrations();
  if (!known.damage.empty()) session.note(known.damage);
  if (clips > clips_worth_measuring) {
    try {
      measure_unknown_device(known.devices, session);
    } catch (const Error& error) {  // a driver that fails, a cache that cannot be written
      session.note(error.what());
    }
  }
  return Compute::open(choice, std::move(known.devices));
}

}  // namespace kinespace::cli
