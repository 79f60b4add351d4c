#include "kinespace/gltf/document.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "kinespace/base/error.h"
#include "kinespace/gltf/detail/buffers.h"
#include "kinespace/gltf/detail/fields.h"
#include "kinespace/gltf/detail/json_shape.h"
#include "kinespace/gltf/detail/packed_view.h"

namespace kinespace::gltf {
namespace {

constexpr std::string_view draco = "KHR_draco_mesh_compression", meshopt = "EXT_meshopt_compression";

[[noreturn]] void fail(const std::string& file, std::string found, std::string expected, std::string remedy = {}) {
  throw Error(ErrorKind::bad_input,
              {.file = file, .found = std::move(found), .expected = std::move(expected), .remedy = std::move(remedy)});
}

// The two parts of a .glb file (glTF 2.0, chapter 4), or a .gltf file's text alone.
struct Parts {
  std::string_view json;
  std::optional<std::string_view> binary;
};

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  static_assert(std::endian::native == std::endian::little);
  std::uint32_t out = 0;
  std::memcpy(&out, bytes.data() + at, sizeof out);
  return out;
}

// The chunk at the front of `left`, which it is cut from.
std::string_view cut_chunk(std::string_view& left, std::uint32_t type, const std::string& file) {
  constexpr std::size_t header = 8;
  if (left.size() < header || word_at(left, 0) > left.size() - header) {
    fail(file, "a part beyond the end of the file", "a whole file (cut short)");
  }
  if (word_at(left, 4) != type) fail(file, "parts of another kind", "JSON, then the buffer");
  const std::string_view out = left.substr(header, word_at(left, 0));
  left.remove_prefix(header + out.size());
  return out;
}

Parts parts_of(std::string_view bytes, const std::string& file) {
  if (bytes.substr(0, 4) != "glTF") return {bytes, {}};
  constexpr std::size_t header = 12;
  constexpr std::uint32_t json_chunk = 0x4e4f534a, binary_chunk = 0x004e4942;
  if (bytes.size() < header || word_at(bytes, 8) > bytes.size() || word_at(bytes, 8) < header) {
    fail(file, fmt::format("{} bytes", bytes.size()), "as many as its header says (cut short)");
  }
  if (word_at(bytes, 4) != 2) fail(file, fmt::format("glTF version {}", word_at(bytes, 4)), "version 2");
  std::string_view left = bytes.substr(header, word_at(bytes, 8) - header);
  Parts out{cut_chunk(left, json_chunk, file), {}};
  if (left.size() >= 8) out.binary = cut_chunk(left, binary_chunk, file);
  return out;
}

Json parsed(std::string_view text, const std::string& file, Budget& budget, const Progress& progress) {
  budget.take("objects", 1, json_tree_bytes(text, file));
  std::uint32_t events = 0;
  const auto keep = [&](int, Json::parse_event_t event, Json& value) {
    if (++events % 4096 == 0) progress.check_stop();
    return event != Json::parse_event_t::key || value != "extras";
  };
  try {
    return Json::parse(text.begin(), text.end(), keep);
  } catch (const Json::exception& error) {
    std::string_view what = error.what();
    what.remove_prefix(std::min(what.find("] ") + 2, what.size()));  // the library's own number
    fail(file, fmt::format("what is not JSON: {}", what), "a glTF 2.0 file");
  }
}

class DocumentReader {
 public:
  DocumentReader(const Json& root, const std::filesystem::path& file, Budget& budget, const Progress& progress,
                 Content wanted)
      : file_(file.string()),
        root_(root, file_, "file"),
        budget_(budget),
        progress_(progress),
        wanted_(wanted),
        source_(file, budget) {}

  Document read(std::optional<std::string_view> binary) && {
    check_version();
    check_extensions();
    read_list("buffers", out_.buffers, [&](const Fields& from, auto& to) { read_buffer(from, binary, to); });
    read_list("bufferViews", out_.views, [&](const Fields& from, auto& to) { read_view(from, to); });
    unpack_views();
    read_list("accessors", out_.accessors, [&](const Fields& from, auto& to) { read_accessor(from, to); });
    if (wanted_ == Content::shapes) {
      read_list("meshes", out_.meshes, [&](const Fields& from, auto& to) { read_mesh(from, to); });
    }
    read_list("nodes", out_.nodes, [&](const Fields& from, auto& to) { read_node(from, to); });
    read_list("skins", out_.skins, [&](const Fields& from, auto& to) { read_skin(from, to); });
    read_list("animations", out_.animations, [&](const Fields& from, auto& to) { read_animation(from, to); });
    read_list("scenes", out_.scenes, [&](const Fields& from, auto& to) { read_scene(from, to); });
    out_.scene = root_.index("scene");
    return std::move(out_);
  }

 private:
  template <typename T, typename Read>
  void read_list(std::string_view name, std::vector<T>& out, Read read) {
    read_list(root_, name, name, out, read);
  }
  template <typename T, typename Read>
  void read_list(const Fields& from, std::string_view key, std::string_view name, std::vector<T>& out, Read read) {
    const Json::array_t& list = from.list(key);
    budget_.take(name, list.size(), sizeof(T));
    out.reserve(list.size());
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (i % 1024 == 0) progress_.check_stop();
      read(Fields(list[i], file_, name, i), out.emplace_back());
    }
  }

  void check_version() const {
    const Json* const asset = root_.find("asset");
    const std::string_view version = asset == nullptr ? "" : Fields(*asset, file_, "asset").text("version");
    if (version != "2" && !version.starts_with("2.")) {
      fail(file_, version.empty() ? "no version" : fmt::format("glTF version {}", version.substr(0, 20)),
           "glTF 2.0, with its version under \"asset\"", "save it as glTF 2.0");
    }
  }

  void check_extensions() const {
    for (const Json& name : root_.list("extensionsRequired")) {
      if (!name.is_string()) root_.fail("extensionsRequired", name.type_name(), "names");
      const std::string& extension = name.get_ref<const std::string&>();
      if (is_readable_extension(extension, wanted_)) continue;
      fail(file_, fmt::format("a file that requires {}", extension.substr(0, 80)),
           "plain glTF 2.0, with KHR_mesh_quantization, EXT_meshopt_compression or extensions of materials, textures "
           "and lights at most",
           extension == draco ? "save it without compression" : "save it without this extension");
    }
  }

  void read_buffer(const Fields& from, std::optional<std::string_view> binary, std::vector<unsigned char>& out) {
    const std::uint64_t length = from.need_count("byteLength");
    const std::string_view uri = from.text("uri");
    if (from.find("uri") != nullptr) {
      out = source_.read(std::string(uri), length);
      return;
    }
    if (is_fallback(from)) return;
    const bool first = out_.buffers.size() == 1;
    if (!first || !binary) from.fail("uri", "nothing", "where the buffer is");
    if (binary->size() < length) {
      from.fail("byteLength", fmt::format("{}", length), fmt::format("at most the {} bytes there", binary->size()),
                "the file may be cut short");
    }
    budget_.take("buffers", 1, length);
    out.assign(binary->begin(), binary->begin() + static_cast<std::ptrdiff_t>(length));
  }

  // The object of EXT_meshopt_compression; null where it is missing.
  static const Json* packing_of(const Fields& from) {
    const Json* const extensions = from.find("extensions");
    if (extensions == nullptr || !extensions->is_object()) return nullptr;
    const auto found = extensions->find(meshopt);
    return found == extensions->end() ? nullptr : &*found;
  }

  // A buffer that stands for what is packed elsewhere, and has no bytes of its own.
  bool is_fallback(const Fields& from) const {
    const Json* const packing = packing_of(from);
    return packing != nullptr && Fields(*packing, file_, "buffers.extensions").flag("fallback");
  }

  void read_view(const Fields& from, BufferView& out) {
    out = {.buffer = from.need_index("buffer"),
           .offset = from.count("byteOffset", 0),
           .length = from.need_count("byteLength"),
           .stride = from.count("byteStride", 0)};
    const Json* const packing = packing_of(from);
    if (packing == nullptr) return;
    const Fields packed(*packing, file_, "bufferViews.extensions");
    packed_.push_back({.view = out_.views.size() - 1,
                       .buffer = packed.need_index("buffer"),
                       .offset = packed.count("byteOffset", 0),
                       .length = packed.need_count("byteLength"),
                       .stride = packed.need_count("byteStride"),
                       .count = packed.need_count("count"),
                       .mode = std::string(packed.text("mode")),
                       .filter = std::string(packed.text("filter"))});
  }

  void unpack_views() {
    const std::size_t own = out_.buffers.size();
    for (const PackedView& packed : packed_) {
      progress_.check_stop();
      if (packed.buffer < 0 || static_cast<std::size_t>(packed.buffer) >= own) {
        fail(file_, fmt::format("bufferView {} packed in buffer {}", packed.view, packed.buffer),
             fmt::format("fewer than {}", own));
      }
      auto bytes = unpacked(packed, out_.buffers[static_cast<std::size_t>(packed.buffer)], file_, budget_);
      BufferView& view = out_.views[packed.view];
      const bool attributes = packed.mode == "ATTRIBUTES";
      view = {.buffer = static_cast<int>(out_.buffers.size()),
              .length = bytes.size(),
              .stride = attributes ? packed.stride : view.stride};
      out_.buffers.push_back(std::move(bytes));
    }
  }

  void read_scene(const Fields& from, Scene& out) {
    out.name = from.text("name");
    out.nodes = indices(from, "nodes");
  }

  void read_accessor(const Fields& from, Accessor& out) const {
    constexpr std::pair<std::string_view, int> widths[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                           {"MAT2", 0},   {"MAT3", 0}, {"MAT4", 16}};
    out.view = from.index("bufferView");
    out.component = from.need_index("componentType");
    out.normalized = from.flag("normalized");
    out.offset = from.count("byteOffset", 0);
    out.count = from.need_count("count");
    const std::string_view type = from.text("type");
    const auto* const known =
        std::find_if(std::begin(widths), std::end(widths), [&](const auto& width) { return width.first == type; });
    if (known == std::end(widths)) from.fail("type", std::string(type.substr(0, 20)), "SCALAR, VEC2 to 4 or MAT2 to 4");
    out.width = known->second;
    const Json* const sparse = from.find("sparse");
    if (sparse == nullptr) return;
    const Fields changes(*sparse, file_, "accessors.sparse");
    const Fields indices(changes.need("indices"), file_, "accessors.sparse.indices");
    const Fields values(changes.need("values"), file_, "accessors.sparse.values");
    out.sparse = SparseValues{.count = changes.need_count("count"),
                              .index_view = indices.need_index("bufferView"),
                              .index_component = indices.need_index("componentType"),
                              .index_offset = indices.count("byteOffset", 0),
                              .value_view = values.need_index("bufferView"),
                              .value_offset = values.count("byteOffset", 0)};
  }

  void read_mesh(const Fields& from, Mesh& out) {
    read_list(from, "primitives", "primitives", out.primitives,
              [&](const Fields& primitive, Primitive& to) { read_primitive(primitive, to); });
    out.weights = numbers(from, "weights");
  }

  void read_primitive(const Fields& from, Primitive& out) {
    const Json& attributes = from.need("attributes");
    if (!attributes.is_object()) from.fail("attributes", attributes.type_name(), "an object");
    constexpr std::size_t tree_node = 96;  // bytes of a std::map's, roughly
    budget_.take("attributes", attributes.size(), tree_node);
    for (const auto& [name, accessor] : attributes.items()) out.attributes[name] = from.index_of(accessor, name);
    budget_.take("morph targets", from.list("targets").size(), sizeof(int));
    for (const Json& target : from.list("targets")) {
      out.targets.push_back(Fields(target, file_, "targets", out.targets.size()).index("POSITION"));
    }
    out.indices = from.index("indices");
    if (from.find("mode") != nullptr) out.mode = from.need_index("mode");
    check_compression(from, out);
  }

  // Where the extension is used but not required, plain accessors stand in for it - or should.
  void check_compression(const Fields& from, const Primitive& primitive) const {
    const Json* const extensions = from.find("extensions");
    if (extensions == nullptr || !extensions->is_object() || !extensions->contains(draco)) return;
    const auto position = primitive.attributes.find("POSITION");
    const int accessor = position == primitive.attributes.end() ? -1 : position->second;
    const bool plain = accessor >= 0 && static_cast<std::size_t>(accessor) < out_.accessors.size() &&
                       out_.accessors[static_cast<std::size_t>(accessor)].view >= 0;
    if (!plain) from.fail("extensions", "a mesh compressed by Draco", "plain accessors", "save it without compression");
  }

  void read_node(const Fields& from, Node& out) {
    out.name = from.text("name");
    out.mesh = from.index("mesh");
    out.skin = from.index("skin");
    out.children = indices(from, "children");
    std::array<double, 16> matrix{};
    if (from.fill("matrix", matrix)) out.rest.matrix = matrix;
    from.fill("translation", out.rest.translation);
    from.fill("rotation", out.rest.rotation);
    from.fill("scale", out.rest.scale);
    out.rest.weights = numbers(from, "weights");
  }

  void read_skin(const Fields& from, Skin& out) {
    out.joints = indices(from, "joints");
    out.inverse_binds = from.index("inverseBindMatrices");
  }

  void read_animation(const Fields& from, Animation& out) {
    using Interpolation = Animation::Interpolation;
    out.name = from.text("name");
    read_list(from, "samplers", "animation samplers", out.samplers, [&](const Fields& sampler, Animation::Sampler& to) {
      const std::string_view kind = sampler.text("interpolation");
      to = {.input = sampler.need_index("input"),
            .output = sampler.need_index("output"),
            .interpolation = kind == "CUBICSPLINE" ? Interpolation::cubic
                             : kind == "STEP"      ? Interpolation::step
                                                   : Interpolation::linear};
    });
    read_list(from, "channels", "animation channels", out.channels,
              [&](const Fields& channel, Animation::Channel& to) { read_channel(channel, to); });
    // Those of other things than nodes are an extension's.
    std::erase_if(out.channels, [](const Animation::Channel& channel) { return channel.node < 0; });
  }

  void read_channel(const Fields& from, Animation::Channel& out) const {
    using Path = Animation::Path;
    constexpr std::pair<std::string_view, Path> paths[] = {{"translation", Path::translation},
                                                           {"rotation", Path::rotation},
                                                           {"scale", Path::scale},
                                                           {"weights", Path::weights}};
    const Fields target(from.need("target"), file_, "animation channels.target");
    out.sampler = from.need_index("sampler");
    for (const auto& [name, path] : paths) {
      if (target.text("path") != name) continue;
      out.path = path;
      out.node = target.index("node");
    }
  }

  std::vector<int> indices(const Fields& from, std::string_view key) {
    budget_.take(key, from.list(key).size(), sizeof(int));
    return from.indices(key);
  }
  std::vector<double> numbers(const Fields& from, std::string_view key) {
    budget_.take(key, from.list(key).size(), sizeof(double));
    return from.numbers(key);
  }

  std::string file_;
  Fields root_;
  Budget& budget_;
  const Progress& progress_;
  Content wanted_;
  BufferSource source_;
  std::vector<PackedView> packed_;
  Document out_;
};

}  // namespace

bool is_readable_extension(std::string_view name, Content wanted) {
  if (name == meshopt || (wanted == Content::motion && name == draco)) return true;
  constexpr std::string_view beginnings[] = {
      "KHR_materials_", "KHR_texture_",  "KHR_lights_",      "EXT_texture_",   "EXT_lights_",          "KHR_xmp",
      "MSFT_texture_",  "MSFT_packing_", "ADOBE_materials_", "KHR_techniques", "KHR_mesh_quantization"};
  return std::any_of(std::begin(beginnings), std::end(beginnings),
                     [&](std::string_view beginning) { return name.starts_with(beginning); });
}

Document read_document(std::string_view bytes, const std::filesystem::path& file, Budget& budget,
                       const Progress& progress, Content wanted) {
  const Parts parts = parts_of(bytes, file.string());
  const Json root = parsed(parts.json, file.string(), budget, progress);
  return DocumentReader(root, file, budget, progress, wanted).read(parts.binary);
}

}  // namespace kinespace::gltf
