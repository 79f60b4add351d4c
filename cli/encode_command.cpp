#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "cli/bad_files.h"
#include "cli/commands.h"
#include "cli/json_output.h"
#include "cli/output.h"
#include "cli/stage_log.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/codecs/pose_space/library_basis.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {
namespace {

namespace fs = std::filesystem;

struct EncodeOptions {
  std::vector<fs::path> inputs;
  fs::path output;
  std::string codec = "motion-space";
  CodecTarget target;
  std::optional<fs::path> basis;      // a library
  std::vector<std::string> settings;  // NAME=VALUE
  std::string profile;                // of codec rma: paper or default
  std::optional<double> variance;     // of codecs rma and clip-pca, percent
  bool skip_bad = false;
  bool json = false;
};

// Files as they are named, and of folders all motion files in them, by name.
std::vector<fs::path> input_files(const std::vector<fs::path>& inputs) {
  std::vector<fs::path> out;
  for (const fs::path& input : inputs) {
    if (!fs::is_directory(input)) {
      out.push_back(input);
      continue;
    }
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(input)) {
      if (entry.is_regular_file() && is_motion_file(entry.path())) files.push_back(entry.path());
    }
    if (files.empty()) {
      throw Error(ErrorKind::bad_input, {.file = input.string(),
                                         .found = "no motion files",
                                         .expected = fmt::format("a folder of {} files", listed(clip_endings_read()))});
    }
    std::ranges::sort(files);
    out.insert(out.end(), files.begin(), files.end());
  }
  return out;
}

std::vector<Clip> read_all(const std::vector<fs::path>& files, BadFiles& bad, Session& session,
                           const Progress& progress) {
  std::vector<Clip> out;
  const std::vector<std::string> by_folder = clip_names(files);
  std::map<std::string, int> names;
  for (std::size_t i = 0; i < files.size(); ++i) {
    progress.at("reading", static_cast<double>(i) / static_cast<double>(files.size()));
    Session::check_stop();
    const auto note = [&](const std::string& what) { session.note(what); };
    std::vector<Clip> clips;
    bad.guard(files[i], [&] { clips = kinespace::read_clips(files[i], {.note = note}); });
    for (Clip& clip : clips) {
      clip.name = by_folder[i] + clip.name.substr(std::min(clip.name.size(), files[i].stem().string().size()));
      // Two clips of one name could not be told apart when decoding: the same file, named twice.
      const int seen = ++names[clip.name];
      if (seen > 1) clip.name += fmt::format(" ({})", seen);
      out.push_back(std::move(clip));
    }
  }
  if (out.empty()) require_no_bad_files(bad.files());
  return out;
}

// The settings with --profile and --variance among them.
std::map<std::string, double, std::less<>> all_settings(const EncodeOptions& options) {
  const Codec& codec = find_codec(options.codec);
  std::map<std::string, double, std::less<>> out;
  const auto set = [&](const std::string& name, std::string_view value) {
    out[name] = find_setting(codec, name).parse(value);
  };
  for (const std::string& setting : options.settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos) {
      throw Error(ErrorKind::usage,
                  {.found = "--set " + setting, .expected = "NAME=VALUE, as in --set step=2 or --set repeats=off"});
    }
    set(setting.substr(0, equals), std::string_view(setting).substr(equals + 1));
  }
  if (!options.profile.empty()) set("profile", options.profile);
  if (options.variance) set("variance", fmt::format("{}", *options.variance));
  return out;
}

void run_encode(const EncodeOptions& options, Session& session) {
  StageLog stages{Compute()};  // no codec has kernels
  const Progress progress = stages.watch(session.progress());
  BadFiles bad;
  const std::vector<Clip> clips = read_all(input_files(options.inputs), bad, session, progress);
  std::optional<PoseSpaceBasis> basis;
  if (options.basis) {
    stages.begin("basis");
    basis = library_basis(*options.basis, clips.front().skeleton.tree_hash(), progress);
  }
  const CodecOptions codec_options{.target = options.target,
                                   .basis = basis ? &*basis : nullptr,
                                   .settings = all_settings(options),
                                   .progress = progress};
  stages.begin("encode");
  const auto start = std::chrono::steady_clock::now();
  const Bytes stream = encode(options.codec, clips, codec_options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  session.finish_progress();
  stages.begin("write");
  write_file_atomically(options.output, stream);

  double frames = 0;
  double raw = 0;
  for (const Clip& clip : clips) {
    frames += clip.frames;
    raw += raw_bytes(clip);
  }
  const MeasuredError error = Bitstream::parse(stream, options.output.string()).error();
  const auto bytes = static_cast<double>(stream.size());
  Json result{{"codec", options.codec},
              {"output", options.output.string()},
              {"clips", clips.size()},
              {"bad_files", to_json(bad)},
              {"frames", static_cast<std::int64_t>(frames)},
              {"bytes", stream.size()},
              {"bytes_per_frame", bytes / frames},
              {"ratio", raw / bytes},
              {"mean_joint_error_cm", error.mean_joint_error_cm},
              {"max_joint_error_cm", error.max_joint_error_cm},
              {"shell_error_cm", error.shell_error_cm},
              {"encode_frames_per_s", frames / seconds}};
  if (!options.json) print_fields(result);
  stages.finish(result, session);
  if (options.json) print_json(result);
  bad.tell(options.skip_bad, session);
}

void print_settings() {
  for (const Codec* codec : all_codecs()) {
    for (const CodecSetting& setting : codec->settings()) {
      print("{:<13} {:<21} {} ({}; {})\n", codec->name(), setting.name, setting.meaning, setting.text(setting.initial),
            setting.range());
    }
  }
}

std::vector<std::string> codec_names() {
  std::vector<std::string> out;
  for (const Codec* codec : all_codecs()) out.emplace_back(codec->name());
  return out;
}

}  // namespace

void add_encode(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("encode", "Compress clips of one skeleton into a stream");
  const auto options = std::make_shared<EncodeOptions>();
  command->add_option("IN", options->inputs, fmt::format("Clips ({}) or folders of them", listed(clip_endings_read())))
      ->required();
  command->add_option("-o,--output", options->output, "The stream to write (.ksm)")->required();
  command->add_option("--codec", options->codec, "How")->check(CLI::IsMember(codec_names()));
  CLI::Option_group* target = command->add_option_group("target", "At most one");
  target->add_option("--error", options->target.mean_error_cm, "Mean joint error to keep to, in cm");
  target->add_option("--max-error", options->target.max_error_cm, "Largest joint error of any frame, in cm");
  target->add_option("--bytes", options->target.bytes, "Size to keep to");
  target->require_option(0, 1);
  command->add_option("--basis", options->basis,
                      "A library whose tables the stream may leave out: small streams of single clips, which decode "
                      "takes the library for too (motion-space)");
  command
      ->add_option("--profile", options->profile, "Of codec rma: the paper's rules, or what goes beyond them (default)")
      ->check(CLI::IsMember({"default", "paper"}));
  command->add_option("--variance", options->variance,
                      "Percent of variance that the axes keep, without a target: rma --profile paper, clip-pca");
  command->add_option("--set", options->settings, "A setting of the codec, NAME=VALUE; --settings lists them")
      ->allow_extra_args(false);
  command
      ->add_flag_callback(
          "--settings",
          [] {
            print_settings();
            throw CLI::Success();
          },
          "List what the codecs can be set by: meaning (value when not set; range)")
      ->trigger_on_parse();
  add_skip_bad(command, options->skip_bad);
  command->add_flag("--json", options->json, "Print what was written as one JSON object");
  session.files.reads(command, {"IN", "--basis"});
  session.files.writes(command, {"--output"}, FileKind::stream);
  command->callback([options, &session] { run_encode(*options, session); });
}

}  // namespace kinespace::cli
