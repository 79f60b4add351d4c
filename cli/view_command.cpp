#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/device_choice.h"
#include "cli/json_output.h"
#include "cli/option_checks.h"
#include "cli/view_data.h"
#include "cli/view_page.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"

namespace kinespace::cli {
namespace {

struct ViewCommandOptions {
  std::filesystem::path library;
  std::optional<std::filesystem::path> output;
  double most_megabytes = 30;
  ViewOptions view;
  std::string device = "auto";
  bool json = false;
};

void require_viewer() {
  if (!empty_page().empty()) return;
  throw Error(ErrorKind::machine, {.found = "a kinespace that was built without its viewer",
                                   .expected = "one with the page in it",
                                   .remedy = "install Node 18 or later with npm and build kinespace again; "
                                             "-DKINESPACE_VIEWER=ON says what is missing"});
}

// Beside nothing of the library: in the working folder, by its name.
std::filesystem::path output_of(const ViewCommandOptions& options) {
  return options.output ? *options.output : std::filesystem::path(options.library.stem().string() + ".html");
}

void note_what_is_left_out(const ViewData& data, const ViewCommandOptions& options, Session& session) {
  const std::size_t shown = data.motions.size();
  if (options.view.clips.empty() && shown < data.clips) {
    session.note(
        fmt::format("{} of {} clips play in the page; all are on its map. --max-size takes in more, or name clips",
                    shown, data.clips));
  }
  if (options.view.nearest > 0 && data.with_nearest < shown) {
    session.note(fmt::format("the nearest motions are known of {} clips: more are not looked for", data.with_nearest));
  }
  if (options.view.originals && data.with_original < shown) {
    session.note(fmt::format("the files of {} clips are not there unchanged: their ghost is that of all functions",
                             shown - data.with_original));
  }
}

void run_view(ViewCommandOptions& options, Session& session) {
  require_viewer();
  const std::filesystem::path output = output_of(options);
  require_replaceable(output, FileKind::html);
  constexpr double bytes_per_megabyte = 1e6;
  options.view.most_bytes = static_cast<std::size_t>(options.most_megabytes * bytes_per_megabyte);
  const Compute compute = open_device(options.device, session);
  LibraryView library(options.library);
  const ViewData data = view_data(library, options.view, compute, session.progress());
  session.finish_progress();
  const std::string page = filled_page(empty_page(), data);
  write_file_atomically(output, page);
  note_what_is_left_out(data, options, session);
  const Json result{{"output", output.string()},           {"clips", data.clips},
                    {"shown", data.motions.size()},        {"with_nearest", data.with_nearest},
                    {"with_original", data.with_original}, {"bytes", page.size()}};
  options.json ? print_json(result) : print_fields(result);
}

}  // namespace

void add_view(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("view", "Write a page that shows a library, for any browser");
  const auto options = std::make_shared<ViewCommandOptions>();
  command->add_option("LIB", options->library, "The library")->required();
  command->add_option("CLIP", options->view.clips,
                      "Only these clips play in the page, and the nearest of each; all that fit when none is named");
  command->add_option("-o,--output", options->output, "The page to write; LIB.html in this folder unless given");
  command
      ->add_option("--max-size", options->most_megabytes,
                   "How large the data in the page may be, in MB; clips beyond are left out, evenly")
      ->check(number_above_zero())
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command->add_option("--nearest", options->view.nearest, "How many of the nearest clips of each are shown")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  command->add_flag("--originals", options->view.originals,
                    "Also where joints were in the files that clips came from, as far as they are there unchanged");
  add_device_option(command, options->device);
  command->add_flag("--json", options->json, "Print what was written as one JSON object");
  session.files.reads(command, {"LIB"});
  session.files.writes(command, {"--output"}, FileKind::html);
  command->callback([options, &session] { run_view(*options, session); });
}

}  // namespace kinespace::cli
