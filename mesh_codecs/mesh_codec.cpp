#include "kinespace/mesh_codecs/mesh_codec.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/mesh_codecs/detail/draco_frames.h"
#include "kinespace/mesh_codecs/detail/paper_harmonics.h"
#include "kinespace/mesh_codecs/detail/trajectory_pca.h"
#include "kinespace/mesh_codecs/harmonics_stream.h"
#include "kinespace/mesh_codecs/mesh_layout.h"
#include "kinespace/storage/payload_version.h"

namespace kinespace {
namespace {

constexpr std::string_view kind_prefix = "mesh-codec:";

// A codec: how it encodes, how its streams are opened. The one with two profiles writes and opens either.
struct MeshCodecRow {
  std::string_view name;
  Bytes (*encode)(const MeshSequence& mesh, const MeshCodecOptions& options) = nullptr;
  std::unique_ptr<MeshStreamReader> (*open)(Bitstream stream, BasisCache* cache) = nullptr;
  bool takes_bases = false;  // profile, bases, clusters, coarse vertices
  std::span<const PayloadVersion> versions = first_payload;
};

Bytes encode_either_harmonics(const MeshSequence& mesh, const MeshCodecOptions& options) {
  return options.profile == MeshProfile::paper ? encode_paper_harmonics(mesh, options)
                                               : encode_harmonics(mesh, options);
}

std::unique_ptr<MeshStreamReader> open_either_harmonics(Bitstream stream, BasisCache* cache) {
  const std::string* profile = stream.find_option("profile");
  return profile != nullptr && *profile == "paper" ? open_paper_harmonics(std::move(stream), cache)
                                                   : open_harmonics(std::move(stream), cache);
}

constexpr std::array rows{
    MeshCodecRow{"mesh-harmonics", encode_either_harmonics, open_either_harmonics, true},
    MeshCodecRow{"mesh-pca", encode_trajectory_pca,
                 [](Bitstream stream, BasisCache*) { return open_trajectory_pca(std::move(stream)); }},
    MeshCodecRow{"mesh-draco", encode_draco_frames,
                 [](Bitstream stream, BasisCache*) { return open_draco_frames(std::move(stream)); }},
};
constexpr auto names = [] {
  std::array<std::string_view, rows.size()> out;
  for (std::size_t i = 0; i < rows.size(); ++i) out[i] = rows[i].name;
  return out;
}();

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
    parallel_for(from, std::min(from + together, count), [&](int f) { set_frame(out, f, frame(first + f)); });
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
  const auto row = std::ranges::find(rows, codec, &MeshCodecRow::name);
  if (row == rows.end()) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("mesh codec {}", codec), .expected = fmt::format("{}", fmt::join(names, ", "))});
  }
  const bool with_bases = options.profile != MeshProfile::standard || options.bases > 0 || options.clusters > 0 ||
                          options.coarse_vertices > 0;
  if (with_bases && !row->takes_bases) {
    throw Error(ErrorKind::usage, {.found = fmt::format("profile, bases, clusters or coarse vertices for {}", codec),
                                   .expected = "these with mesh-harmonics only"});
  }
  return row->encode(mesh, options);
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
  const auto row = std::ranges::find(rows, codec, &MeshCodecRow::name);
  if (row != rows.end()) {
    static_cast<void>(payload_version(stream, row->versions));
    return row->open(std::move(stream), cache);
  }
  throw Error(ErrorKind::bad_input, {.file = stream.source(),
                                     .found = "a stream of kind " + kind,
                                     .expected = "a stream of a mesh sequence by a codec that this build knows"});
}

double bits_per_vertex_and_frame(std::int64_t bytes, const MeshSequence& layout) {
  return 8.0 * static_cast<double>(bytes) / (static_cast<double>(layout.vertices) * layout.frames);
}

}  // namespace kinespace
