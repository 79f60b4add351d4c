#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/json_output.h"
#include "cli/output.h"
#include "kinespace/kernels/calibration.h"
#include "kinespace/kernels/device.h"

namespace kinespace::cli {
namespace {

// The value of --device that chooses the OpenCL device at that place of the list.
std::string choice(std::size_t index) {
  return fmt::format("opencl:{}", index);
}

const char* precision(const DeviceInfo& device) {
  return device.fp64 ? "single and double" : "single";
}

constexpr double giga = 1e9;

// In milliards of operations, null where the device never pays.
Json to_json(const DeviceCalibration& calibration) {
  Json kernels = Json::array();
  for (const KernelSpeed& speed : calibration.kernels) {
    const double from = speed.from_flops();
    kernels.push_back({{"kernel", name_of(speed.family)},
                       {"processor_gflops", speed.processor_rate / giga},
                       {"device_gflops", speed.device_rate / giga},
                       {"startup_s", speed.startup_s},
                       {"from_gflop", std::isfinite(from) ? Json(from / giga) : Json()}});
  }
  return kernels;
}

Json to_json(const DeviceList& list, unsigned threads, const std::vector<DeviceCalibration>& known) {
  Json devices = Json::array();
  devices.push_back(
      {{"choice", "cpu"}, {"name", "plain C++"}, {"type", "cpu"}, {"compute_units", threads}, {"fp64", true}});
  for (const DeviceInfo& device : list.devices) {
    const DeviceCalibration* measured = find_calibration(known, device);
    devices.push_back({{"choice", choice(devices.size() - 1)},
                       {"name", device.name},
                       {"platform", device.platform},
                       {"type", device.type},
                       {"compute_units", device.compute_units},
                       {"memory_bytes", device.memory_bytes},
                       {"fp64", device.fp64},
                       {"driver_version", device.driver_version},
                       {"calibration", measured != nullptr ? to_json(*measured) : Json()}});
  }
  return {{"devices", devices}, {"no_opencl_because", list.reason.empty() ? Json() : Json(list.reason)}};
}

void print_calibration(const DeviceCalibration& calibration) {
  for (const KernelSpeed& speed : calibration.kernels) {
    const double from = speed.from_flops();
    const std::string when = std::isfinite(from) ? fmt::format("here from {:.3g} Gflop a call on", from / giga)
                                                 : std::string("faster on the processor");
    print("{:<10} {:<18} {:7.1f} Gflop/s, the processor {:7.1f}: {}\n", "", name_of(speed.family),
          speed.device_rate / giga, speed.processor_rate / giga, when);
  }
}

void print_table(const DeviceList& list, unsigned threads, const std::vector<DeviceCalibration>& known) {
  print("{:<10} plain C++ on the processor, {} threads; single and double precision\n", "cpu", threads);
  constexpr double gibibyte = 1024.0 * 1024.0 * 1024.0;
  for (std::size_t i = 0; i < list.devices.size(); ++i) {
    const DeviceInfo& device = list.devices[i];
    print("{:<10} {} ({}, {}), {} compute units, {:.1f} GiB; {} precision\n", choice(i), device.name, device.type,
          device.platform, device.compute_units, static_cast<double>(device.memory_bytes) / gibibyte,
          precision(device));
    if (const DeviceCalibration* measured = find_calibration(known, device)) print_calibration(*measured);
  }
  if (list.devices.empty()) print("No OpenCL device: {}\n", list.reason);
}

// Measures every device and keeps what was found.
void calibrate_all(const DeviceList& list, Session& session) {
  if (list.devices.empty()) {
    session.note("there is no OpenCL device to measure");
    return;
  }
  require_calibration_folder();
  for (std::size_t i = 0; i < list.devices.size(); ++i) keep_calibration(calibrate(choice(i), session.progress()));
  session.finish_progress();
  session.note("measured, and kept in " + calibration_file().string());
}

struct DevicesOptions {
  bool calibrate = false;
  bool json = false;
};

void run_devices(const DevicesOptions& options, Session& session) {
  const DeviceList list = list_opencl_devices();
  if (options.calibrate) calibrate_all(list, session);
  const KnownCalibrations known = read_calibrations();
  if (!known.damage.empty()) session.note(known.damage);
  const unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  if (options.json) {
    print_json(to_json(list, threads, known.devices));
  } else {
    print_table(list, threads, known.devices);
  }
}

}  // namespace

void add_devices(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("devices", "What computes, and with what precision");
  const auto options = std::make_shared<DevicesOptions>();
  command->add_flag("--calibrate", options->calibrate,
                    "Measure which kernels are faster on the OpenCL devices (seconds), for --device auto to go by");
  command->add_flag("--json", options->json, "Print the devices as one JSON object");
  command->callback([options, &session] { run_devices(*options, session); });
}

}  // namespace kinespace::cli
