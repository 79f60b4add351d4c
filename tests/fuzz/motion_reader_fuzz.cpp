// A libFuzzer target for one reader of motion files or libraries, KINESPACE_FUZZ_READER: bvh, asf, amc, gltf_clip or
// library.
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

#include <unistd.h>

#include "examples/sample_motions.h"
#include "kinespace/base/bytes.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/library/library_view.h"
#include "kinespace/motion/amc.h"
#include "kinespace/motion/asf.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/gltf.h"
#include "kinespace/motion/read.h"

namespace kinespace::fuzz {
namespace {

constexpr std::string_view reader = KINESPACE_FUZZ_READER;

Clip sample_clip() {
  return slice(make_walk().clip, 0, 12);
}

// Where a library under test lies: its reader wants a file.
const std::filesystem::path& scratch() {
  static const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("kinespace-fuzz-" + std::to_string(::getpid()));
  return path;
}

std::string sample_library_bytes() {
  const std::filesystem::path clip = scratch().string() + ".bvh", library = scratch().string() + ".kspace";
  write_clip(clip, slice(make_walk().clip, 0, 60));
  static_cast<void>(build_library({clip}, library, {}));
  const FileContent content(library);
  std::string out(content.text());
  std::filesystem::remove(clip);
  std::filesystem::remove(library);
  return out;
}

const std::string& good() {
  static const std::string text = [] {
    if (reader == "bvh") return format_bvh(sample_clip());
    if (reader == "asf") return format_amc(sample_clip()).asf;
    if (reader == "amc") return format_amc(sample_clip()).amc;
    if (reader == "gltf_clip") return format_gltf(sample_clip(), GltfForm::binary);
    return sample_library_bytes();
  }();
  return text;
}

const Asf& skeleton() {
  static const Asf asf = parse_asf(format_amc(sample_clip()).asf, "good.asf");
  return asf;
}

void read_library(std::string_view bytes) {
  {
    std::ofstream out(scratch(), std::ios::binary | std::ios::trunc);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  LibraryView view(scratch());
  for (const ClipRow& row : view.library().clips()) static_cast<void>(view.clip(row, 5));
}

void read(std::string_view text) {
  if (reader == "bvh") {
    static_cast<void>(parse_bvh(text, "fuzzed.bvh"));
  } else if (reader == "asf") {
    static_cast<void>(parse_asf(text, "fuzzed.asf"));
  } else if (reader == "amc") {
    static_cast<void>(parse_amc(text, skeleton(), "fuzzed.amc"));
  } else if (reader == "gltf_clip") {
    static_cast<void>(parse_gltf(text, "fuzzed.glb", {}, ClipsWanted::all));
  } else {
    read_library(text);
  }
}

}  // namespace
}  // namespace kinespace::fuzz

// Before any input is timed.
extern "C" int LLVMFuzzerInitialize(int* /*count*/, char*** /*arguments*/) {
  static_cast<void>(kinespace::fuzz::good());
  static_cast<void>(kinespace::fuzz::skeleton());
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    kinespace::fuzz::read({reinterpret_cast<const char*>(data), size});
  } catch (const kinespace::Error&) {
    // What a reader owes hostile bytes.
  }
  return 0;
}

// Starts from a good file: mutations of it go deeper than noise.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most,
                                               unsigned /*seed*/) {
  const std::string& good = kinespace::fuzz::good();
  if (size > 1 || most < good.size()) return LLVMFuzzerMutate(data, size, most);
  for (std::size_t i = 0; i < good.size(); ++i) data[i] = static_cast<std::uint8_t>(good[i]);
  return good.size();
}
