// The user's cache of calibrations, as JSON: {"kind": "kinespace devices", "version": 1, "devices": [...]}.
#include <cmath>
#include <cstdlib>
#include <optional>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/kernels/calibration.h"

namespace kinespace {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFileVersion = 1;  // raise it when what is measured, or means, is another
constexpr const char* kFileKind = "kinespace devices";
constexpr std::uintmax_t kMostBytes = 1U << 20;

constexpr std::array kSpeedFields{
    std::pair{"processor_flops_per_s", &KernelSpeed::processor_rate},
    std::pair{"processor_overhead_s", &KernelSpeed::processor_overhead_s},
    std::pair{"device_flops_per_s", &KernelSpeed::device_rate},
    std::pair{"device_overhead_s", &KernelSpeed::device_overhead_s},
    std::pair{"startup_s", &KernelSpeed::startup_s},
};

Json to_json(const DeviceCalibration& calibration) {
  Json kernels = Json::array();
  for (const KernelSpeed& speed : calibration.kernels) {
    Json one{{"kernel", name_of(speed.family)}};
    for (const auto& [name, field] : kSpeedFields) one[name] = speed.*field;
    kernels.push_back(std::move(one));
  }
  return {{"device", calibration.device},
          {"platform", calibration.platform},
          {"driver_version", calibration.driver_version},
          {"threads", calibration.threads},
          {"kernels", std::move(kernels)}};
}

std::optional<std::string> text_of(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? std::optional(found->get<std::string>()) : std::nullopt;
}

std::optional<double> number_of(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  const auto number = found->get<double>();
  return std::isfinite(number) && number >= 0 ? std::optional(number) : std::nullopt;
}

std::optional<KernelSpeed> speed_of(const Json& object) {
  if (!object.is_object()) return std::nullopt;
  const auto name = text_of(object, "kernel");
  const auto family = std::ranges::find_if(kernel_families, [&](KernelFamily one) { return name == name_of(one); });
  if (family == kernel_families.end()) return std::nullopt;
  KernelSpeed out{.family = *family};
  for (const auto& [key, field] : kSpeedFields) {
    const auto number = number_of(object, key);
    if (!number) return std::nullopt;
    out.*field = *number;
  }
  // Operations a second of anything that computes.
  const auto plausible = [](double rate) { return rate > 1e3 && rate < 1e18; };
  return plausible(out.processor_rate) && plausible(out.device_rate) ? std::optional(out) : std::nullopt;
}

std::optional<DeviceCalibration> calibration_of(const Json& object) {
  if (!object.is_object()) return std::nullopt;
  const auto device = text_of(object, "device");
  const auto platform = text_of(object, "platform");
  const auto driver = text_of(object, "driver_version");
  const auto threads = number_of(object, "threads");
  const auto kernels = object.find("kernels");
  if (!device || !platform || !driver || !threads || *threads > 1e6 || kernels == object.end()) return std::nullopt;
  DeviceCalibration out{.device = *device,
                        .platform = *platform,
                        .driver_version = *driver,
                        .threads = static_cast<int>(*threads),
                        .kernels = {}};
  for (const Json& kernel : *kernels) {
    const auto speed = speed_of(kernel);
    if (!speed) return std::nullopt;
    out.kernels.push_back(*speed);
  }
  const bool each = std::ranges::all_of(kernel_families, [&](KernelFamily family) {
    return std::ranges::count(out.kernels, family, &KernelSpeed::family) == 1;
  });
  return each ? std::optional(std::move(out)) : std::nullopt;
}

std::string read_text_of(const fs::path& file) {
  std::error_code none;
  if (fs::file_size(file, none) > kMostBytes || none) return {};
  return std::string(FileContent(file).text());
}

std::optional<std::vector<DeviceCalibration>> devices_of(const std::string& text) {
  const Json root = Json::parse(text, nullptr, false);
  if (!root.is_object() || text_of(root, "kind") != kFileKind || number_of(root, "version") != kFileVersion) {
    return std::nullopt;
  }
  const auto devices = root.find("devices");
  if (devices == root.end() || !devices->is_array()) return std::nullopt;
  std::vector<DeviceCalibration> out;
  for (const Json& device : *devices) {
    auto one = calibration_of(device);
    if (!one) return std::nullopt;
    out.push_back(std::move(*one));
  }
  return out;
}

}  // namespace

fs::path calibration_file() {
  const auto below = [](const char* variable, const char* rest) -> fs::path {
    const char* folder = std::getenv(variable);
    // As the XDG base directory specification has it: what is not absolute is as if it were not set.
    if (folder == nullptr || !fs::path(folder).is_absolute()) return {};
    return fs::path(folder) / rest;
  };
  const fs::path cache = below("XDG_CACHE_HOME", "kinespace/devices.json");
  return cache.empty() ? below("HOME", ".cache/kinespace/devices.json") : cache;
}

KnownCalibrations read_calibrations(const fs::path& file) {
  std::error_code ignored;
  if (file.empty() || !fs::exists(file, ignored)) return {};
  try {
    auto devices = devices_of(read_text_of(file));
    if (devices) return {.devices = std::move(*devices), .damage = {}};
  } catch (const Error& error) {
    return {.devices = {}, .damage = error.what()};
  }
  return {.devices = {},
          .damage = format_error({.file = file.string(),
                                  .found = "no calibration of this version",
                                  .remedy = "it is ignored; `kinespace devices --calibrate` measures again"})};
}

void require_calibration_folder(const fs::path& file) {
  if (file.empty()) {
    throw Error(ErrorKind::machine, {.found = "neither XDG_CACHE_HOME nor HOME names an absolute folder",
                                     .expected = "a folder to keep calibrations in",
                                     .remedy = "set XDG_CACHE_HOME"});
  }
  std::error_code failed;
  fs::create_directories(file.parent_path(), failed);
  if (failed || fs::is_directory(file)) {
    throw Error(ErrorKind::machine, {.file = (failed ? file.parent_path() : file).string(),
                                     .found = failed ? failed.message() : "a folder",
                                     .expected = "a folder to keep the file of calibrations in",
                                     .remedy = "set XDG_CACHE_HOME to one that can be written to"});
  }
}

void keep_calibration(const DeviceCalibration& calibration, const fs::path& file) {
  require_calibration_folder(file);
  KnownCalibrations known = read_calibrations(file);
  std::erase_if(known.devices, [&](const DeviceCalibration& other) {
    return other.device == calibration.device && other.platform == calibration.platform;
  });
  known.devices.push_back(calibration);
  Json devices = Json::array();
  for (const DeviceCalibration& one : known.devices) devices.push_back(to_json(one));
  const Json root{{"kind", kFileKind}, {"version", kFileVersion}, {"devices", std::move(devices)}};
  std::error_code failed;
  // Ours, whatever damage makes it look like.
  if (!known.damage.empty() && fs::is_regular_file(file, failed)) fs::remove(file, failed);
  write_file_atomically(file, root.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace kinespace
