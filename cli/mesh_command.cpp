// `kinespace mesh`: streams of animated meshes.
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/json_output.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/mesh/mesh_error.h"
#include "kinespace/mesh/mesh_files.h"
#include "kinespace/mesh/mesh_report.h"
#include "kinespace/mesh/picture.h"
#include "kinespace/mesh_codecs/basis_cache.h"
#include "kinespace/mesh_codecs/mesh_codec.h"
#include "kinespace/motion/file_formats.h"

namespace kinespace::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

bool is_stream_file(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  const FileContent file(path);
  return is_mesh_stream(file.bytes());
}

// An open stream, its smooth functions from a library where one was named.
class OpenStream {
 public:
  OpenStream(std::span<const std::byte> bytes, const fs::path& shown, const std::optional<fs::path>& library,
             Session& session) {
    if (library) cache_.emplace(*library, [&session](const std::string& text) { session.note(text); });
    reader_ = open_mesh_stream(bytes, shown.string(), cache_ ? &*cache_ : nullptr);
  }
  [[nodiscard]] const MeshStreamReader& operator*() const { return *reader_; }
  [[nodiscard]] const MeshStreamReader* operator->() const { return reader_.get(); }
  // Whether the functions came out of the library, all of them.
  [[nodiscard]] bool basis_from_library() const { return cache_ && cache_->found() > 0 && cache_->computed() == 0; }

 private:
  std::optional<BasisCache> cache_;
  std::unique_ptr<MeshStreamReader> reader_;
};

void add_library(CLI::App& command, std::optional<fs::path>& library) {
  command.add_option(
      "--library", library,
      "Keep the stream's smooth functions in this library (made if there is none), or take them from it");
}

void add_max_memory(CLI::App& command, std::optional<double>& megabytes) {
  command
      .add_option("--max-memory", megabytes,
                  "Let one glTF file take so many MB of memory (64 times its size and 268 MB)")
      ->check(CLI::Range(1.0, 1e9));
}

void add_animation(CLI::App& command, std::string& animation) {
  command.add_option("--animation", animation,
                     "Of a glTF file with several animations this one, by its name or its number from 1");
}

MeshReadOptions reading(const std::optional<double>& megabytes, Session& session, const std::string& animation = {}) {
  MeshReadOptions out;
  out.animation = animation;
  out.note = [&session](const std::string& what) { session.note(what); };
  if (megabytes) out.most_bytes = static_cast<std::uint64_t>(*megabytes * 1e6);
  out.progress = session.progress();
  return out;
}

// For what comes before the first byte is written: a signal then ends the program, however long a step takes. With a
// library, which is written to at any time, it is only marked.
void stop_at_once_unless(const std::optional<fs::path>& library) {
  if (library) {
    catch_stop_signals();
  } else {
    stop_at_once();
  }
  Session::check_stop();
}

// A sequence of files, or of a stream.
MeshSequence read_any(const fs::path& path, const std::optional<fs::path>& library, const MeshReadOptions& options,
                      Session& session) {
  if (!is_stream_file(path)) return read_mesh_sequence(path, options);
  const FileContent file(path);
  return OpenStream(file.bytes(), path, library, session)->decode_all(options.progress);
}

// Null where the stream has none: a measure that its sequence leaves open.
Json number_of(const Bitstream& stream, const char* key) {
  if (stream.find_option(key) == nullptr) return nullptr;
  return stream.number_option(key, 0, std::numeric_limits<double>::max());
}

// The keys that encode and info share.
Json stream_fields(const MeshStreamReader& reader) {
  const MeshSequence& layout = reader.layout();
  const auto bytes = static_cast<std::int64_t>(reader.stream().size());
  return {{"vertices", layout.vertices},
          {"triangles", layout.triangles.size()},
          {"frames", layout.frames},
          {"bytes", bytes},
          {"bpvf", bits_per_vertex_and_frame(bytes, layout)},
          {"bpvf_without_connectivity", bits_per_vertex_and_frame(bytes - reader.connectivity_bytes(), layout)},
          {"kg", number_of(reader.stream(), "kg")},
          {"kg_time", number_of(reader.stream(), "kg_time")},
          {"lr", number_of(reader.stream(), "lr")}};
}

void print_result(const Json& result, bool json) {
  json ? print_json(result) : print_fields(result);
}

struct MeshEncodeOptions {
  fs::path input;
  fs::path output;
  std::string codec = "mesh-harmonics";
  std::string profile = "standard";
  MeshCodecOptions codec_options;
  std::optional<double> rate_hz;
  std::string animation;
  std::optional<double> max_memory;
  std::optional<fs::path> library;
  bool json = false;
};

void run_encode(MeshEncodeOptions& options, Session& session) {
  stop_at_once_unless({});
  MeshReadOptions read = reading(options.max_memory, session, options.animation);
  read.rate_hz = options.rate_hz;
  const MeshSequence mesh = read_mesh_sequence(options.input, read);
  options.codec_options.profile = options.profile == "paper" ? MeshProfile::paper : MeshProfile::standard;
  options.codec_options.progress = session.progress();
  const auto start = Clock::now();
  const Bytes stream = encode_mesh(options.codec, mesh, options.codec_options);
  const double seconds = seconds_since(start);
  session.finish_progress();
  Session::check_stop();
  // Opened before it is written: what cannot be read is not left behind.
  stop_at_once_unless(options.library);
  Json result{{"codec", options.codec}, {"output", options.output.string()}};
  result.update(stream_fields(*OpenStream(stream, options.output, options.library, session)));
  catch_stop_signals();
  write_file_atomically(options.output, std::span<const std::byte>(stream));
  result["encode_s"] = seconds;
  print_result(result, options.json);
}

struct MeshDecodeOptions {
  fs::path stream;
  fs::path output;
  std::optional<int> from, to;
  std::optional<fs::path> library;
  bool json = false;
};

MeshFormat format_of(const fs::path& output, const std::string& format) {
  const FileFormat* known = find_format(output);
  const bool gltf = known != nullptr && (known->kind == FileKind::glb || known->kind == FileKind::json);
  if (gltf) return MeshFormat::gltf;
  if (format == "obj") return MeshFormat::obj;
  if (format == "ply") return MeshFormat::ply;
  return MeshFormat::numpy;
}

void run_decode(const MeshDecodeOptions& options, const std::string& format, Session& session) {
  stop_at_once_unless(options.library);
  const FileContent file(options.stream);
  const auto start = Clock::now();
  const OpenStream reader(file.bytes(), options.stream, options.library, session);
  const double opened = seconds_since(start);
  const int first = options.from.value_or(0);
  const int last = options.to.value_or(reader->layout().frames - 1);
  const Progress progress = session.progress();
  const auto decoding = Clock::now();
  const MeshSequence mesh = reader->decode(first, last - first + 1, progress);
  const double seconds = seconds_since(decoding);
  catch_stop_signals();
  write_mesh_sequence(options.output, mesh, format_of(options.output, format), progress);
  session.finish_progress();
  print_result({{"output", options.output.string()},
                {"vertices", mesh.vertices},
                {"triangles", mesh.triangles.size()},
                {"frames", mesh.frames},
                {"open_s", opened},
                {"basis_s", reader->basis_seconds()},
                {"basis_from_library", reader.basis_from_library()},
                {"decode_frames_per_s", mesh.frames / seconds}},
               options.json);
}

struct MeshCompareOptions {
  fs::path reference, other;
  std::optional<fs::path> picture;
  std::optional<int> frame;
  std::optional<double> max_memory;
  std::optional<fs::path> library;
  bool json = false;
};

// The frame with the largest error.
int worst_frame(const MeshSequence& a, const MeshSequence& b) {
  int worst = 0;
  double most = -1;
  for (int f = 0; f < a.frames; ++f) {
    double sum = 0;
    for (const double e : vertex_errors(a, b, f)) sum += e * e;
    if (sum > most) {
      most = sum;
      worst = f;
    }
  }
  return worst;
}

void run_compare(const MeshCompareOptions& options, Session& session) {
  stop_at_once_unless(options.library);
  const MeshReadOptions read = reading(options.max_memory, session);
  const MeshSequence a = read_any(options.reference, options.library, read, session);
  Session::check_stop();
  const MeshSequence b = read_any(options.other, options.library, read, session);
  Session::check_stop();
  session.finish_progress();
  const MeshError error = compare(a, b);
  Json result{{"vertices", error.vertices},
              {"triangles", a.triangles.size()},
              {"frames", error.frames},
              {"bytes", nullptr},
              {"bpvf", nullptr},
              {"bpvf_without_connectivity", nullptr},
              {"kg", error.kg},
              {"kg_time", error.kg_time},
              {"lr", error.lr},
              {"max_vertex_error", error.max_vertex_error},
              {"max_error_over_diagonal", error.max_error_over_diagonal}};
  if (is_stream_file(options.other)) {
    const FileContent file(options.other);
    const OpenStream reader(file.bytes(), options.other, options.library, session);
    const auto bytes = static_cast<std::int64_t>(file.bytes().size());
    result["bytes"] = bytes;
    result["bpvf"] = bits_per_vertex_and_frame(bytes, a);
    result["bpvf_without_connectivity"] = bits_per_vertex_and_frame(bytes - reader->connectivity_bytes(), a);
  }
  if (options.picture) {
    const int frame = options.frame.value_or(worst_frame(a, b));
    const ComparisonPicture drawn = draw_comparison(a, b, frame);
    catch_stop_signals();
    write_png(*options.picture, drawn.picture);
    result["picture"] = options.picture->string();
    result["picture_frame"] = frame;
    result["picture_red"] = drawn.worst;
  }
  print_result(result, options.json);
}

struct MeshInfoOptions {
  fs::path file;
  std::string animation;
  std::optional<double> max_memory;
  bool json = false;
};

Json describe_sequence(const MeshInfoOptions& options, Session& session) {
  const MeshReport found =
      report(read_mesh_sequence(options.file, reading(options.max_memory, session, options.animation)));
  session.finish_progress();
  return {{"kind", "mesh"},
          {"vertices", found.vertices},
          {"triangles", found.triangles},
          {"frames", found.frames},
          {"rate_hz", found.rate_hz},
          {"edges", found.edges},
          {"diagonal", found.diagonal},
          {"components", found.components},
          {"watertight", found.watertight()},
          {"boundary_edges", found.boundary_edges},
          {"boundary_loops", found.boundary_loops},
          {"nonmanifold_edges", found.nonmanifold_edges},
          {"inconsistent_edges", found.inconsistent_edges},
          {"degenerate_triangles", found.degenerate_triangles},
          {"flat_triangles", found.flat_triangles},
          {"duplicate_triangles", found.duplicate_triangles},
          {"isolated_vertices", found.isolated_vertices}};
}

void run_info(const MeshInfoOptions& options, Session& session) {
  stop_at_once_unless({});
  if (!is_stream_file(options.file)) return print_result(describe_sequence(options, session), options.json);
  const FileContent file(options.file);
  const auto reader = open_mesh_stream(file.bytes(), options.file.string());
  const std::string& kind = reader->stream().kind();
  Json result{{"kind", "mesh"}, {"codec", kind.substr(kind.find(':') + 1)}, {"rate_hz", reader->layout().rate_hz}};
  result.update(stream_fields(*reader));
  print_result(result, options.json);
}

void add_mesh_encode(CLI::App& mesh, Session& session) {
  CLI::App* command = mesh.add_subcommand("encode", "A mesh sequence as a stream (.ksm)");
  const auto options = std::make_shared<MeshEncodeOptions>();
  MeshCodecOptions& codec = options->codec_options;
  command
      ->add_option("IN", options->input,
                   fmt::format("A folder of OBJ, PLY or NumPy files, or a file: {}", listed(mesh_endings())))
      ->required();
  command->add_option("-o,--output", options->output, "The stream to write")->required();
  std::vector<std::string> names(mesh_codecs().begin(), mesh_codecs().end());
  command->add_option("--codec", options->codec, listed(names))->check(CLI::IsMember(names))->capture_default_str();
  command->add_option("--profile", options->profile, "Of mesh-harmonics: standard, or paper (as chen2019 has it)")
      ->check(CLI::IsMember({"standard", "paper"}))
      ->capture_default_str();
  auto* kg = command->add_option("--kg", codec.kg, "Keep the KG error at or below so many percent (0.5)");
  command->add_option("--bytes", codec.bytes, "Keep the whole stream within so many bytes")->excludes(kg);
  command->add_option("--bases", codec.bases, "Smooth functions on the key-frame");
  command->add_option("--clusters", codec.clusters, "Key-frames (profile paper)");
  command->add_option("--multi-resolution", codec.coarse_vertices,
                      "Code about so many vertices (10000, say); the others follow them");
  command->add_option("--rate", options->rate_hz, "Frames a second, where the files do not tell");
  add_animation(*command, options->animation);
  add_max_memory(*command, options->max_memory);
  add_library(*command, options->library);
  command->add_flag("--json", options->json, "Print the figures as one JSON object");
  session.files.reads(command, {"IN"});
  session.files.updates(command, {"--library"});
  session.files.writes(command, {"--output"}, FileKind::stream);
  command->callback([options, &session] { run_encode(*options, session); });
}

void add_mesh_decode(CLI::App& mesh, Session& session) {
  CLI::App* command = mesh.add_subcommand("decode", "Frames out of a stream, all or some");
  const auto options = std::make_shared<MeshDecodeOptions>();
  const auto format = std::make_shared<std::string>("npy");
  command->add_option("IN", options->stream, "The stream (.ksm)")->required();
  command->add_option("-o,--output", options->output, "A folder, or a .glb or .gltf file")->required();
  command->add_option("--format", *format, "Of the folder's files: npy, obj or ply")
      ->check(CLI::IsMember({"npy", "obj", "ply"}))
      ->capture_default_str();
  command->add_option("--from", options->from, "The first frame (0)");
  command->add_option("--to", options->to, "The last frame");
  add_library(*command, options->library);
  command->add_flag("--json", options->json, "Print the figures as one JSON object");
  session.files.reads(command, {"IN"});
  session.files.updates(command, {"--library"});
  session.files.writes(command, {"--output"});
  command->callback([options, format, &session] { run_decode(*options, *format, session); });
}

void add_mesh_compare(CLI::App& mesh, Session& session) {
  CLI::App* command = mesh.add_subcommand("compare", "How far mesh sequence B is from the reference A");
  const auto options = std::make_shared<MeshCompareOptions>();
  command->add_option("A", options->reference, "The reference: files or a stream")->required();
  command->add_option("B", options->other, "The sequence to judge: files or a stream")->required();
  command->add_option("--picture", options->picture, "Draw original, decoded and error (blue to red) to this PNG");
  command->add_option("--frame", options->frame, "The frame to draw; by default the one with the largest error");
  add_max_memory(*command, options->max_memory);
  add_library(*command, options->library);
  command->add_flag("--json", options->json, "Print the measures as one JSON object");
  session.files.reads(command, {"A", "B"});
  session.files.updates(command, {"--library"});
  session.files.writes(command, {"--picture"}, FileKind::png);
  command->callback([options, &session] { run_compare(*options, session); });
}

void add_mesh_info(CLI::App& mesh, Session& session) {
  CLI::App* command = mesh.add_subcommand("info", "What a mesh sequence or a stream of one holds");
  const auto options = std::make_shared<MeshInfoOptions>();
  command->add_option("FILE", options->file, "Files of a sequence, or a stream")->required();
  add_animation(*command, options->animation);
  add_max_memory(*command, options->max_memory);
  command->add_flag("--json", options->json, "Print the result as one JSON object");
  session.files.reads(command, {"FILE"});
  command->callback([options, &session] { run_info(*options, session); });
}

}  // namespace

void add_mesh(CLI::App& app, Session& session) {
  CLI::App* mesh = app.add_subcommand("mesh", "Animated meshes: encode, decode, compare, info");
  mesh->require_subcommand(1);
  add_mesh_encode(*mesh, session);
  add_mesh_decode(*mesh, session);
  add_mesh_compare(*mesh, session);
  add_mesh_info(*mesh, session);
}

}  // namespace kinespace::cli
