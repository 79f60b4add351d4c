#include "kinespace/mesh_codecs/detail/draco_surface.h"

#include <utility>

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>

#include "kinespace/base/error.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

constexpr std::size_t header_bytes = 11;  // "DRACO", version, type, method, flags

int add_attribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, int width, int points,
                  const std::int32_t* values) {
  draco::GeometryAttribute attribute;
  attribute.Init(type, nullptr, static_cast<std::int8_t>(width), draco::DT_INT32, false,
                 static_cast<std::int64_t>(width) * 4, 0);
  const int id = mesh.AddAttribute(attribute, true, static_cast<std::uint32_t>(points));
  for (int p = 0; p < points; ++p) {
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(p)),
                                          values + static_cast<std::ptrdiff_t>(p) * width);
  }
  return id;
}

// The counts that Draco's header claims, before Draco makes room for them.
void check_counts(std::span<const std::byte> bytes, int most_points, std::int64_t most_triangles,
                  const std::string& source) {
  ByteReader in(bytes, source);
  const auto header = in.take(header_bytes);
  const bool edgebreaker = static_cast<std::uint8_t>(header[8]) == 1;
  static_cast<void>(in.get<std::uint8_t>());  // how the traversal was coded
  const std::uint64_t points = get_varint(in);
  const std::uint64_t triangles = get_varint(in);
  if (!edgebreaker || points > static_cast<std::uint64_t>(most_points) ||
      triangles > static_cast<std::uint64_t>(most_triangles)) {
    in.fail(std::to_string(points) + " points and " + std::to_string(triangles) + " triangles in a Draco part",
            "what the header says (damaged)");
  }
}

std::vector<std::int32_t> attribute_values(const draco::Mesh& mesh, int id, int width) {
  const draco::PointAttribute* attribute = mesh.attribute(id);
  std::vector<std::int32_t> out(static_cast<std::size_t>(mesh.num_points()) * static_cast<std::size_t>(width));
  if (attribute == nullptr || attribute->num_components() != width || attribute->data_type() != draco::DT_INT32) {
    return {};
  }
  for (std::uint32_t p = 0; p < mesh.num_points(); ++p) {
    const draco::AttributeValueIndex at = attribute->mapped_index(draco::PointIndex(p));
    if (at.value() >= attribute->size()) return {};
    attribute->GetValue(at, out.data() + static_cast<std::size_t>(p) * static_cast<std::size_t>(width));
  }
  return out;
}

}  // namespace

std::optional<Bytes> draco_encode(const Surface& surface) {
  if (surface.triangles.empty()) return {};
  draco::Mesh mesh;
  mesh.set_num_points(static_cast<std::uint32_t>(surface.points));
  mesh.SetNumFaces(surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    draco::Mesh::Face face;
    for (int i = 0; i < 3; ++i) {
      face[static_cast<std::size_t>(i)] =
          draco::PointIndex(static_cast<std::uint32_t>(surface.triangles[t][static_cast<std::size_t>(i)]));
    }
    mesh.SetFace(draco::FaceIndex(static_cast<std::uint32_t>(t)), face);
  }
  bool first = true;
  for (const auto& key : surface.keys) {
    add_attribute(mesh, first ? draco::GeometryAttribute::POSITION : draco::GeometryAttribute::GENERIC, 3,
                  surface.points, key.data()->data());
    first = false;
  }
  if (!surface.label.empty()) {
    add_attribute(mesh, draco::GeometryAttribute::GENERIC, 1, surface.points, surface.label.data());
  }
  draco::ExpertEncoder encoder(mesh);
  encoder.SetSpeedOptions(0, 0);
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeToBuffer(&buffer).ok()) return {};
  const auto bytes = std::as_bytes(std::span(buffer.data(), buffer.size()));
  return Bytes(bytes.begin(), bytes.end());
}

Surface draco_decode(std::span<const std::byte> bytes, int most_points, std::int64_t most_triangles, int keys,
                     bool labelled, const std::string& source) {
  check_counts(bytes, most_points, most_triangles, source);
  const auto fail = [&](std::string found) {
    throw Error(ErrorKind::bad_input,
                {.file = source, .found = std::move(found), .expected = "a Draco mesh that is whole (damaged)"});
  };
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) fail("a Draco part that Draco refuses: " + decoded.status().error_msg_string());
  const draco::Mesh& mesh = *decoded.value();
  if (mesh.num_attributes() != keys + (labelled ? 1 : 0) ||
      mesh.num_points() > static_cast<std::uint64_t>(most_points) * 4 ||
      mesh.num_faces() > static_cast<std::uint64_t>(most_triangles)) {
    fail("a Draco part with other contents");
  }
  Surface out;
  out.points = static_cast<int>(mesh.num_points());
  for (std::uint32_t t = 0; t < mesh.num_faces(); ++t) {
    const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(t));
    Triangle triangle{};
    for (std::size_t i = 0; i < 3; ++i) {
      if (face[i].value() >= mesh.num_points()) fail("a Draco part with triangles of points that are not there");
      triangle[i] = static_cast<std::int32_t>(face[i].value());
    }
    out.triangles.push_back(triangle);
  }
  for (int k = 0; k < keys; ++k) {
    const std::vector<std::int32_t> values = attribute_values(mesh, k, 3);
    if (values.size() != static_cast<std::size_t>(out.points) * 3) fail("a Draco part with other attributes");
    std::vector<GridPoint>& key = out.keys.emplace_back(static_cast<std::size_t>(out.points));
    for (std::size_t p = 0; p < key.size(); ++p) key[p] = {values[3 * p], values[3 * p + 1], values[3 * p + 2]};
  }
  if (labelled) out.label = attribute_values(mesh, keys, 1);
  return out;
}

}  // namespace kinespace
