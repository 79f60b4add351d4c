#include <array>
#include <filesystem>
#include <memory>
#include <string>

#include "base/file.h"
#include "cli/commands.h"
#include "cli/json_output.h"
#include "motion/read.h"

namespace kinespace::cli {
namespace {

// What `info` can describe. The first row that claims a file describes it; a clip, last, claims every file, so that a
// file of no known kind gets the clip reader's message.
struct Describer {
  bool (*claims)(const std::filesystem::path& file);
  Json (*describe)(const std::filesystem::path& file);
};

// The unit in which a skeleton of this height would be a person's, for files that do not say what they use.
std::string guess_unit(double height) {
  struct Range {
    double low, high;
    const char* unit;
  };
  constexpr std::array ranges{Range{0.5, 2.5, "m"}, Range{20, 95, "inch"}, Range{95, 250, "cm"},
                              Range{500, 2500, "mm"}};
  for (const auto& [low, high, unit] : ranges) {
    if (height >= low && height < high) return unit;
  }
  return "unknown";
}

Json describe_clip(const std::filesystem::path& file) {
  const Clip clip = read_clip(file);
  const double height = clip.skeleton.rest_height();
  return {{"kind", "clip"},
          {"name", clip.name},
          {"frames", clip.frames},
          {"rate_hz", clip.rate_hz},
          {"duration_s", clip.duration_s()},
          {"joints", clip.skeleton.joint_count()},
          {"rotating_joints", clip.skeleton.rotating_joints().size()},
          {"height_cm", height},
          {"unit_guess", guess_unit(height)},
          {"bytes", std::filesystem::file_size(file)}};
}

constexpr std::array describers{
    Describer{[](const std::filesystem::path&) { return true; }, describe_clip},
};

void run_info(const std::filesystem::path& file, bool json) {
  for (const Describer& describer : describers) {
    if (!describer.claims(file)) continue;
    const Json description = describer.describe(file);
    json ? print_json(description) : print_fields(description);
    return;
  }
}

}  // namespace

void add_info(CLI::App& app, Session& /*session*/) {
  struct Options {
    std::filesystem::path file;
    bool json = false;
  };
  CLI::App* command = app.add_subcommand("info", "What is in a file");
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->file, "A clip (.bvh, .amc)")->required();
  command->add_flag("--json", options->json, "Print it as one JSON object");
  command->callback([options] { run_info(options->file, options->json); });
}

}  // namespace kinespace::cli
