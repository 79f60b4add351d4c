#include <algorithm>
#include <memory>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/json_output.h"
#include "cli/output.h"
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

Json to_json(const DeviceList& list, unsigned threads) {
  Json devices = Json::array();
  devices.push_back(
      {{"choice", "cpu"}, {"name", "plain C++"}, {"type", "cpu"}, {"compute_units", threads}, {"fp64", true}});
  for (const DeviceInfo& device : list.devices) {
    devices.push_back({{"choice", choice(devices.size() - 1)},
                       {"name", device.name},
                       {"platform", device.platform},
                       {"type", device.type},
                       {"compute_units", device.compute_units},
                       {"memory_bytes", device.memory_bytes},
                       {"fp64", device.fp64},
                       {"driver_version", device.driver_version}});
  }
  return {{"devices", devices}, {"no_opencl_because", list.reason.empty() ? Json() : Json(list.reason)}};
}

void print_table(const DeviceList& list, unsigned threads) {
  print("{:<10} plain C++ on the processor, {} threads; single and double precision\n", "cpu", threads);
  constexpr double gibibyte = 1024.0 * 1024.0 * 1024.0;
  for (std::size_t i = 0; i < list.devices.size(); ++i) {
    const DeviceInfo& device = list.devices[i];
    print("{:<10} {} ({}, {}), {} compute units, {:.1f} GiB; {} precision\n", choice(i), device.name, device.type,
          device.platform, device.compute_units, static_cast<double>(device.memory_bytes) / gibibyte,
          precision(device));
  }
  if (list.devices.empty()) print("No OpenCL device: {}\n", list.reason);
}

void run_devices(bool json) {
  const DeviceList list = list_opencl_devices();
  const unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  if (json) {
    print_json(to_json(list, threads));
  } else {
    print_table(list, threads);
  }
}

}  // namespace

void add_devices(CLI::App& app, Session& /*session*/) {
  CLI::App* command = app.add_subcommand("devices", "What computes, and with what precision");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "Print the devices as one JSON object");
  command->callback([json] { run_devices(*json); });
}

}  // namespace kinespace::cli
