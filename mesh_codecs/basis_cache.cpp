#include "kinespace/mesh_codecs/basis_cache.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/storage/library.h"

namespace kinespace {
namespace {

constexpr const char* artifact_kind = "mesh basis";
constexpr std::uint32_t version = 1;
constexpr std::size_t most_bytes = std::size_t{900} << 20;  // SQLite's own limit of a blob is 1 GB

std::string hash_of(const Points& key, std::span<const Triangle> triangles) {
  const auto numbers = std::as_bytes(std::span(key.data(), static_cast<std::size_t>(key.size())));
  ByteWriter all;
  all.put(static_cast<std::uint64_t>(key.rows()));
  all.put_bytes(numbers);
  all.put_bytes(std::as_bytes(triangles));
  return content_hash(all.bytes());
}

std::size_t packed_size(int vertices, int functions, std::size_t anchors) {
  return 4 * sizeof(std::uint32_t) + anchors * sizeof(std::int32_t) +
         static_cast<std::size_t>(vertices) * static_cast<std::size_t>(functions) * sizeof(double) +
         sizeof(std::uint64_t);
}

}  // namespace

struct BasisCache::Wanted {
  std::string key;
  int vertices = 0, functions = 0;
  std::optional<std::uint64_t> checksum;  // of the functions, where it is known beforehand
};

Bytes pack_mesh_basis(const SmoothBasis& basis) {
  ByteWriter out;
  out.put(version);
  out.put(static_cast<std::uint32_t>(basis.functions.rows()));
  out.put(static_cast<std::uint32_t>(basis.functions.cols()));
  out.put(static_cast<std::uint32_t>(basis.anchors.size()));
  out.put_array(std::span<const std::int32_t>(basis.anchors));
  out.put_array(std::span(basis.functions.data(), static_cast<std::size_t>(basis.functions.size())));
  out.put(checksum64(out.bytes()));
  return std::move(out).take();
}

SmoothBasis unpack_mesh_basis(std::span<const std::byte> bytes, int vertices, int functions,
                              const std::string& source) {
  ByteReader in(bytes, source);
  const auto found = in.get<std::uint32_t>();
  const auto rows = in.get<std::uint32_t>(), columns = in.get<std::uint32_t>(), anchors = in.get<std::uint32_t>();
  if (found != version || rows != static_cast<std::uint32_t>(vertices) ||
      columns != static_cast<std::uint32_t>(functions) || anchors > columns ||
      bytes.size() != packed_size(vertices, functions, anchors)) {
    in.fail(fmt::format("version {}, {} functions on {} vertices", found, columns, rows),
            fmt::format("version {}, {} functions on {} vertices, whole", version, functions, vertices));
  }
  SmoothBasis out;
  out.anchors = in.get_array<std::int32_t>(anchors);
  out.functions.resize(vertices, functions);
  const auto numbers = in.take(static_cast<std::size_t>(out.functions.size()) * sizeof(double));
  std::memcpy(out.functions.data(), numbers.data(), numbers.size());
  if (in.get<std::uint64_t>() != checksum64(bytes.first(bytes.size() - sizeof(std::uint64_t)))) {
    in.fail("another checksum", "that of the numbers (damaged)");
  }
  const bool placed = std::ranges::all_of(out.anchors, [&](std::int32_t a) { return a >= 0 && a < vertices; });
  // Unit vectors, or these over roots of areas. Frames of larger numbers might not be finite.
  constexpr double largest = 1e6;
  if (!placed || !(out.functions.array().abs() <= largest).all()) {
    in.fail("numbers that no basis has", "finite ones, anchors on the mesh");
  }
  return out;
}

BasisCache::BasisCache(std::filesystem::path library, Warn warn)
    : library_(std::move(library)), warn_(warn ? std::move(warn) : [](const std::string&) {}) {}

bool BasisCache::find(const Wanted& wanted, SmoothBasis& out) {
  if (!std::filesystem::exists(library_)) return false;
  const std::string name = library_.string();
  const auto stored = Library::open_read_only(library_).artifact(artifact_kind, wanted.key);
  if (!stored) return false;
  try {
    out = unpack_mesh_basis(*stored, wanted.vertices, wanted.functions, name);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::bad_input) throw;
    warn_(fmt::format("a basis kept in {} is damaged and is computed anew: {}", name, error.what()));
    return false;
  }
  if (wanted.checksum && basis_checksum(out.functions) != *wanted.checksum) {
    warn_(fmt::format("a basis kept in {} is not the one the stream was made with and is computed anew", name));
    return false;
  }
  ++found_;
  return true;
}

void BasisCache::keep(const Wanted& wanted, const SmoothBasis& basis) {
  if (packed_size(wanted.vertices, wanted.functions, basis.anchors.size()) > most_bytes) {
    warn_(fmt::format("{} functions on {} vertices are too many to be kept in a library", wanted.functions,
                      wanted.vertices));
    return;
  }
  try {
    Library library = std::filesystem::exists(library_) ? Library::open(library_) : Library::create(library_);
    library.put_artifact(artifact_kind, wanted.key, pack_mesh_basis(basis));
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::bad_input) throw;
    // Read-only, full, in use or just made by another process: the work goes on without.
    warn_(fmt::format("the basis cannot be kept: {}", error.what()));
  }
}

SmoothBasis BasisCache::smooth(const Points& key, std::span<const Triangle> triangles, int functions) {
  const Wanted wanted{.key = fmt::format("smooth {} {}", functions, hash_of(key, triangles)),
                      .vertices = static_cast<int>(key.rows()),
                      .functions = functions,
                      .checksum = {}};
  SmoothBasis out;
  if (find(wanted, out)) return out;
  out = smooth_basis(key, triangles, {.functions = functions});
  ++computed_;
  keep(wanted, out);
  return out;
}

Eigen::MatrixXd BasisCache::harmonics(const Points& key, std::span<const Triangle> triangles,
                                      const HarmonicsOptions& options, std::uint64_t checksum) {
  const Wanted wanted{
      .key = fmt::format("harmonics {} {} {:016x}", options.functions, hash_of(key, triangles), checksum),
      .vertices = static_cast<int>(key.rows()),
      .functions = options.functions,
      .checksum = checksum};
  SmoothBasis out;
  if (find(wanted, out)) return std::move(out.functions);
  out.functions = manifold_harmonics(key, triangles, options).functions;
  ++computed_;
  if (basis_checksum(out.functions) == checksum) keep(wanted, out);
  return std::move(out.functions);
}

}  // namespace kinespace
