#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/json_output.h"
#include "cli/option_checks.h"
#include "cli/stream_file.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/printable.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {
namespace {

namespace fs = std::filesystem;

struct DecodeOptions {
  fs::path stream;
  fs::path output;
  std::optional<std::string> clip;
  std::optional<std::string> joint;
  bool preview = false;
  std::optional<double> from_s;
  std::optional<double> to_s;
  std::optional<fs::path> basis;  // a library
  int level = -1;
  std::string format = ".bvh";
  bool json = false;
};

// The frames of a clip from a time to another, both included.
std::pair<int, int> frame_range(const ClipSummary& clip, const DecodeOptions& options) {
  const double last = clip.frames - 1;
  const double from = std::round(options.from_s.value_or(0) * clip.rate_hz);
  const double to = options.to_s ? std::round(*options.to_s * clip.rate_hz) : last;
  if (from > to || from > last) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("{} s to {} s", from / clip.rate_hz, to / clip.rate_hz),
                 .expected = fmt::format("a part of 0 s to {} s of clip {}", last / clip.rate_hz, clip.name)});
  }
  const int first = static_cast<int>(from);
  return {first, static_cast<int>(std::min(to, last)) - first + 1};
}

Clip decode_joint(const StreamReader& reader, std::size_t clip, const DecodeOptions& options, int first, int count) {
  const int joint = reader.skeleton(clip).find(*options.joint);
  if (joint >= 0) return reader.decode_joint(clip, joint, first, count);
  throw Error(ErrorKind::usage, {.file = options.stream.string(),
                                 .found = fmt::format("no joint named {}", *options.joint),
                                 .expected = "one of the clip's skeleton"});
}

std::vector<Clip> decode_clips(const StreamReader& reader, const DecodeOptions& options) {
  std::vector<std::size_t> wanted;
  if (options.clip) {
    wanted.push_back(reader.find(*options.clip));
  } else if (!options.from_s && !options.to_s && !options.joint && !options.preview) {
    return reader.decode_all(options.level);
  }
  for (std::size_t c = 0; !options.clip && c < reader.clips().size(); ++c) wanted.push_back(c);
  std::vector<Clip> out;
  for (const std::size_t c : wanted) {
    Session::check_stop();
    if (options.preview) {
      out.push_back(reader.decode_preview(c));
      continue;
    }
    const auto [first, count] = frame_range(reader.clips()[c], options);
    out.push_back(options.joint ? decode_joint(reader, c, options, first, count)
                                : reader.decode(c, first, count, options.level));
  }
  return out;
}

// Names for the clips' files below a folder, each once. A clip "b/walk" goes into a folder b; the name of a file is not
// also that of a folder.
class FileNames {
 public:
  explicit FileNames(std::string ending) : ending_(std::move(ending)) {}

  fs::path make(const std::string& clip) {
    std::string plain = file_path_below(clip.empty() ? "clip" : clip);
    // Where a file stands that would have to be a folder, no number behind the name helps.
    if (needs_folder_at_file(plain)) plain = file_name_part(plain);
    std::string name = plain;
    for (int n = 2; !take(name + ending_); ++n) name = fmt::format("{} ({})", plain, n);
    return name + ending_;
  }

 private:
  static std::vector<std::string> folders_above(const std::string& file) {
    std::vector<std::string> out;
    for (fs::path folder = fs::path(file).parent_path(); !folder.empty(); folder = folder.parent_path()) {
      out.push_back(folder.string());
    }
    return out;
  }

  [[nodiscard]] bool needs_folder_at_file(const std::string& file) const {
    return std::ranges::any_of(folders_above(file), [&](const std::string& folder) { return files_.contains(folder); });
  }

  bool take(const std::string& file) {
    if (folders_.contains(file) || files_.contains(file)) return false;
    const std::vector<std::string> above = folders_above(file);
    files_.insert(file);
    folders_.insert(above.begin(), above.end());
    return true;
  }

  std::string ending_;
  std::set<std::string> files_;
  std::set<std::string> folders_;
};

// OUT is a file for a single clip with an ending that can be written, else a folder.
std::vector<fs::path> output_files(const std::vector<Clip>& clips, const DecodeOptions& options) {
  const FileFormat* format = find_format(options.output);
  if (format == nullptr || format->write == nullptr) {
    std::vector<fs::path> out;
    FileNames names(options.format);
    for (const Clip& clip : clips) out.push_back(options.output / names.make(clip.name));
    return out;
  }
  if (clips.size() != 1) {
    throw Error(ErrorKind::usage, {.file = options.output.string(),
                                   .found = fmt::format("one file for {} clips", clips.size()),
                                   .expected = "a folder, or --clip NAME"});
  }
  return {options.output};
}

void run_decode(const DecodeOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const StreamFile stream(options.stream, options.basis);
  const StreamReader& reader = stream.reader();
  const std::vector<Clip> clips = decode_clips(reader, options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<fs::path> files = output_files(clips, options);
  double frames = 0;
  std::set<fs::path> folders;
  for (std::size_t c = 0; c < clips.size(); ++c) {
    Session::check_stop();
    if (files[c] != options.output && folders.insert(files[c].parent_path()).second) {
      fs::create_directories(files[c].parent_path());
      remove_leftovers(files[c].parent_path());
    }
    write_clip(files[c], clips[c]);
    frames += clips[c].frames;
  }
  const Json result{{"output", options.output.string()},           {"clips", clips.size()},
                    {"frames", static_cast<std::int64_t>(frames)}, {"levels", reader.levels()},
                    {"complete", reader.stream().complete()},      {"decode_frames_per_s", frames / seconds}};
  options.json ? print_json(result) : print_fields(result);
}

}  // namespace

void add_decode(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("decode", "Clips out of a stream, all or one or a part of one");
  const auto options = std::make_shared<DecodeOptions>();
  command->add_option("IN", options->stream, "The stream (.ksm), whole or its beginning")->required();
  command
      ->add_option("-o,--output", options->output,
                   "A folder, or for one clip a file: " + listed(clip_endings_written()))
      ->required();
  command->add_option("--clip", options->clip, "Only the clip of that name");
  command->add_option("--from", options->from_s, "From this time on, in seconds")->check(number_from_zero());
  command->add_option("--to", options->to_s, "Up to this time, in seconds")->check(number_from_zero());
  command->add_option("--basis", options->basis, "The library that the stream was encoded with, if it was with one");
  command->add_option("--level", options->level, "Only so many levels of detail")->check(number_from_zero());
  command->add_option("--joint", options->joint, "Only that joint, without the others' bytes (streams of qbc)");
  command->add_flag("--preview", options->preview, "Only the frames that need no decoding (streams of qbc)")
      ->excludes("--joint")
      ->excludes("--from")
      ->excludes("--to");
  command->add_option("--format", options->format, "Ending of the files in a folder")
      ->check(CLI::IsMember(clip_endings_written()));
  command->add_flag("--json", options->json, "Print what was decoded as one JSON object");
  session.files.reads(command, {"IN", "--basis"});
  session.files.writes(command, {"--output"});
  command->callback([options] { run_decode(*options); });
}

}  // namespace kinespace::cli
