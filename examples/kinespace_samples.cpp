// kinespace-samples DIR: writes the sample motions as BVH files, each with a JSON file of its labels and contacts.
#include <filesystem>
#include <iostream>
#include <new>

#include <CLI/CLI.hpp>

#include "examples/sample_files.h"
#include "examples/sample_motions.h"
#include "kinespace/base/error.h"

namespace {

void write_all(const std::filesystem::path& folder, const kinespace::LibraryOptions& options) {
  const auto motions = kinespace::sample_library(options);
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) {
    throw kinespace::Error(kinespace::ErrorKind::machine, {.file = folder.string(),
                                                           .line = 0,
                                                           .found = failed.message(),
                                                           .expected = "a folder that can be made",
                                                           .remedy = "name another folder"});
  }
  for (const auto& motion : motions) kinespace::write_sample(folder, motion);
  std::cout << motions.size() << " clips in " << folder.string() << '\n';
}

int fail(const char* message, kinespace::ErrorKind kind) {
  std::cerr << "kinespace-samples: " << message << '\n';
  return static_cast<int>(kind);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Writes labelled sample motions: DIR/NAME.bvh, and DIR/NAME.json with labels and foot contacts.");
  std::filesystem::path folder;
  kinespace::LibraryOptions options;
  app.add_option("DIR", folder, "folder to write to; made when it is missing")->required();
  app.add_option("--seed", options.seed, "draws the variation")->capture_default_str();
  app.add_option("--takes", options.takes, "takes of each of the 24 motions, 1 to 1000")->capture_default_str();
  app.add_option("--rate", options.rate_hz, "frames per second, 10 to 1000")->capture_default_str();
  app.add_option("--height", options.height_cm, "of the body in cm, 100 to 220")->capture_default_str();
  try {
    app.parse(argc, argv);
    write_all(folder, options);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(kinespace::ErrorKind::usage);
  } catch (const kinespace::Error& error) {
    return fail(error.what(), error.kind());
  } catch (const std::bad_alloc&) {
    return fail("no memory left", kinespace::ErrorKind::machine);
  }
}
