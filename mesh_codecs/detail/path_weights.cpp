#include "kinespace/mesh_codecs/detail/path_weights.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <utility>

#include "kinespace/entropy/integer_coder.h"
#include "kinespace/mesh/connectivity.h"

namespace kinespace {
namespace {

constexpr std::int64_t largest_weight = std::int64_t{1} << 40;

int context(std::int64_t last_miss, std::int64_t miss_before) {
  return std::min(bit_length(static_cast<std::uint64_t>(std::abs(last_miss) + std::abs(miss_before))), 15);
}

// Vertices by a breadth-first walk over each component.
std::vector<std::int32_t> walk_order(const Neighbours& neighbours) {
  std::vector<std::int32_t> out;
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(neighbours.vertices()));
  for (std::int32_t start = 0; start < neighbours.vertices(); ++start) {
    if (std::exchange(seen[static_cast<std::size_t>(start)], std::uint8_t{1}) != 0) continue;
    std::size_t at = out.size();
    out.push_back(start);
    for (; at < out.size(); ++at) {
      for (const std::int32_t v : neighbours.of(out[at])) {
        if (std::exchange(seen[static_cast<std::size_t>(v)], std::uint8_t{1}) == 0) out.push_back(v);
      }
    }
  }
  return out;
}

using Edge = std::array<std::int32_t, 3>;  // low end, high end, the vertex across

}  // namespace

VertexWalk::VertexWalk(int vertices, std::span<const Triangle> triangles) {
  const Neighbours neighbours(vertices, triangles);
  order_ = walk_order(neighbours);
  std::vector<std::int32_t> rank(static_cast<std::size_t>(vertices));
  for (std::size_t i = 0; i < order_.size(); ++i)
    rank[static_cast<std::size_t>(order_[i])] = static_cast<std::int32_t>(i);
  const auto at = [&](std::int32_t v) { return rank[static_cast<std::size_t>(v)]; };

  std::vector<Edge> edges;
  for (const Triangle& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int32_t a = t[(i + 1) % 3], b = t[(i + 2) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), t[i]});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<std::vector<Source>> of(static_cast<std::size_t>(vertices));
  constexpr std::size_t most_across = 8;  // triangles at one edge that are looked at
  for (std::size_t from = 0; from < edges.size();) {
    std::size_t to = from;
    while (to < edges.size() && edges[to][0] == edges[from][0] && edges[to][1] == edges[from][1]) ++to;
    const std::size_t end = std::min(to, from + most_across);
    for (std::size_t i = from; i < end; ++i) {
      for (std::size_t j = from; j < end; ++j) {
        const auto [a, b, v] = edges[i];
        const std::int32_t w = edges[j][2];
        if (v == w || v == a || v == b || at(a) >= at(v) || at(b) >= at(v) || at(w) >= at(v)) continue;
        of[static_cast<std::size_t>(v)].push_back({a, b, w});
      }
    }
    from = to;
  }
  first_.push_back(0);
  for (std::int32_t v = 0; v < vertices; ++v) {
    auto& own = of[static_cast<std::size_t>(v)];
    if (own.empty()) {
      for (const std::int32_t n : neighbours.of(v)) {
        if (at(n) < at(v)) own.push_back({n, -1, -1});
      }
    }
    sources_.insert(sources_.end(), own.begin(), own.end());
    first_.push_back(static_cast<std::int64_t>(sources_.size()));
  }
}

std::int64_t VertexWalk::expected(std::int32_t vertex, std::span<const std::int64_t> values) const {
  const auto v = static_cast<std::size_t>(vertex);
  const std::int64_t count = first_[v + 1] - first_[v];
  if (count == 0) return 0;
  const auto of = [&](std::int32_t n) { return values[static_cast<std::size_t>(n)]; };
  std::int64_t sum = 0;
  for (std::int64_t i = first_[v]; i < first_[v + 1]; ++i) {
    const Source& s = sources_[static_cast<std::size_t>(i)];
    sum += s.minus < 0 ? of(s.plus) : of(s.plus) + of(s.other) - of(s.minus);
  }
  return (2 * sum + (sum < 0 ? -count : count)) / (2 * count);
}

Bytes pack_weights(std::span<const std::int64_t> values, int components, const VertexWalk& walk) {
  IntegerWriter out;
  const std::size_t vertices = walk.order().size();
  for (int r = 0; r < components; ++r) {
    const auto row = values.subspan(static_cast<std::size_t>(r) * vertices, vertices);
    std::int64_t last = 0, before = 0;
    for (const std::int32_t v : walk.order()) {
      const std::int64_t miss = row[static_cast<std::size_t>(v)] - walk.expected(v, row);
      out.put(miss, context(last, before));
      before = last;
      last = miss;
    }
  }
  return std::move(out).finish();
}

std::vector<std::int64_t> unpack_weights(std::span<const std::byte> bytes, int components, int vertices,
                                         const VertexWalk& walk, const std::string& source) {
  IntegerReader in(bytes, source);
  std::vector<std::int64_t> out(static_cast<std::size_t>(components) * static_cast<std::size_t>(vertices));
  for (int r = 0; r < components; ++r) {
    const auto row = std::span(out).subspan(static_cast<std::size_t>(r) * static_cast<std::size_t>(vertices),
                                            static_cast<std::size_t>(vertices));
    std::int64_t last = 0, before = 0;
    for (const std::int32_t v : walk.order()) {
      const std::int64_t miss = in.get(context(last, before));
      const std::int64_t value = walk.expected(v, row) + miss;
      if (value < -largest_weight || value > largest_weight) in.damaged();
      row[static_cast<std::size_t>(v)] = value;
      before = last;
      last = miss;
    }
  }
  in.expect_end();
  return out;
}

}  // namespace kinespace
