#include "kinespace/mesh_codecs/mesh_codec.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "kinespace/base/error.h"
#include "kinespace/mesh_codecs/detail/draco_frames.h"
#include "kinespace/mesh_codecs/detail/paper_harmonics.h"
#include "kinespace/mesh_codecs/detail/trajectory_pca.h"
#include "kinespace/mesh_codecs/harmonics_stream.h"
#include "kinespace/mesh_codecs/mesh_layout.h"

namespace kinespace {
namespace {

constexpr std::string_view kind_prefix = "mesh-codec:";
constexpr std::array<std::string_view, 3> names{"mesh-harmonics", "mesh-pca", "mesh-draco"};

[[noreturn]] void out_of_range(const char* field, double value, std::string range) {
  throw Error(ErrorKind::usage,
              {.found = fmt::format("MeshCodecOptions::{} = {}", field, value), .expected = std::move(range)});
}

}  // namespace

void MeshCodecOptions::validate(const MeshSequence& mesh) const {
  if (kg && !(*kg >= 0.001 && *kg <= 50)) out_of_range("kg", *kg, "0.001 to 50 percent");
  if (bytes && *bytes <= 0) out_of_range("bytes", static_cast<double>(*bytes), "more than 0");
  if (kg && bytes) throw Error(ErrorKind::usage, {.found = "2 targets", .expected = "one of kg and bytes"});
  if (bases < 0 || bases > mesh.vertices)
    out_of_range("bases", bases, fmt::format("0 to {} (vertices)", mesh.vertices));
  if (clusters < 0 || clusters > mesh.frames) {
    out_of_range("clusters", clusters, fmt::format("0 to {} (frames)", mesh.frames));
  }
  if (clusters > 1 && profile != MeshProfile::paper) {
    out_of_range("clusters", clusters, "1 with the standard profile, which has one key-frame");
  }
  if (coarse_vertices != 0 && profile == MeshProfile::paper) {
    out_of_range("coarse_vertices", coarse_vertices, "0 with profile paper");
  }
  if (coarse_vertices != 0 && coarse_vertices < 4) out_of_range("coarse_vertices", coarse_vertices, "0, or 4 and more");
}

MeshSequence MeshStreamReader::decode(int first, int count, const Progress& progress) const {
  MeshSequence out = layout();
  if (first < 0 || count < 1 || first > out.frames - count) {
    throw Error(ErrorKind::usage, {.file = stream().source(),
                                   .found = fmt::format("frames {} to {}", first, first + count - 1),
                                   .expected = fmt::format("0 to {}", out.frames - 1)});
  }
  out.frames = count;
  out.positions.resize(static_cast<std::size_t>(count) * out.frame_size());
  constexpr int together = 16;
  for (int from = 0; from < count; from += together) {
    progress.check_stop();
    progress.at("frames", static_cast<double>(from) / count);
    tbb::parallel_for(from, std::min(from + together, count), [&](int f) { set_frame(out, f, frame(first + f)); });
  }
  return out;
}

std::span<const std::string_view> mesh_codecs() {
  return names;
}

Bytes encode_mesh(std::string_view codec, const MeshSequence& mesh, const MeshCodecOptions& options) {
  require_valid(mesh, mesh.name);
  options.validate(mesh);
  require_encodable(mesh);
  if (codec == names[0]) {
    return options.profile == MeshProfile::paper ? encode_paper_harmonics(mesh, options)
                                                 : encode_harmonics(mesh, options);
  }
  const bool harmonics_only = options.profile != MeshProfile::standard || options.bases > 0 || options.clusters > 0 ||
                              options.coarse_vertices > 0;
  if (harmonics_only && std::find(names.begin(), names.end(), codec) != names.end()) {
    throw Error(ErrorKind::usage, {.found = fmt::format("profile, bases, clusters or coarse vertices for {}", codec),
                                   .expected = "these with mesh-harmonics only"});
  }
  if (codec == names[1]) return encode_trajectory_pca(mesh, options);
  if (codec == names[2]) return encode_draco_frames(mesh, options);
  throw Error(ErrorKind::usage,
              {.found = fmt::format("mesh codec {}", codec), .expected = fmt::format("{}", fmt::join(names, ", "))});
}

bool is_mesh_stream(std::span<const std::byte> bytes) {
  return Bitstream::has_magic(bytes) && Bitstream::parse_prefix(bytes, "").kind().starts_with(kind_prefix);
}

std::unique_ptr<MeshStreamReader> open_mesh_stream(std::span<const std::byte> bytes, std::string source,
                                                   BasisCache* cache) {
  Bitstream stream = Bitstream::parse(bytes, std::move(source));
  const std::string& kind = stream.kind();
  const std::string_view codec =
      kind.starts_with(kind_prefix) ? std::string_view(kind).substr(kind_prefix.size()) : std::string_view();
  const std::string* profile = stream.find_option("profile");
  if (codec == names[0]) {
    return profile != nullptr && *profile == "paper" ? open_paper_harmonics(std::move(stream), cache)
                                                     : open_harmonics(std::move(stream), cache);
  }
  if (codec == names[1]) return open_trajectory_pca(std::move(stream));
  if (codec == names[2]) return open_draco_frames(std::move(stream));
  throw Error(ErrorKind::bad_input, {.file = stream.source(),
                                     .found = "a stream of kind " + kind,
                                     .expected = "a stream of a mesh sequence by a codec that this build knows"});
}

double bits_per_vertex_and_frame(std::int64_t bytes, const MeshSequence& layout) {
  return 8.0 * static_cast<double>(bytes) / (static_cast<double>(layout.vertices) * layout.frames);
}

}  // namespace kinespace
