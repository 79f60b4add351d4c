#include "kinespace/mesh_codecs/detail/vertex_order.h"

#include <algorithm>
#include <bit>

#include "kinespace/mesh/connectivity.h"

namespace kinespace {
namespace {

constexpr std::size_t looked_back = 24;  // vertices
constexpr std::size_t most_candidates = 80;

// The free points near the latest vertices, and what both sides know besides.
class Order {
 public:
  Order(int points, std::span<const Triangle> triangles)
      : neighbours_(points, triangles),
        taken_(static_cast<std::size_t>(points)),
        taken_near_(taken_.size()),
        seen_(taken_.size(), -1) {}

  [[nodiscard]] const std::vector<std::int32_t>& candidates() {
    list_.clear();
    const std::size_t back = std::min(latest_.size(), looked_back);
    for (std::size_t i = 0; i < back && list_.size() < most_candidates; ++i) {
      const std::int32_t p = latest_[latest_.size() - 1 - i];
      const std::size_t from = list_.size();
      looked_at_ += static_cast<std::int64_t>(neighbours_.of(p).size());
      for (const std::int32_t q : neighbours_.of(p)) {
        if (taken_[static_cast<std::size_t>(q)] != 0 || seen_[static_cast<std::size_t>(q)] == turn_) continue;
        seen_[static_cast<std::size_t>(q)] = turn_;
        list_.push_back(q);
      }
      // Those with more neighbours taken are likelier.
      std::stable_sort(list_.begin() + static_cast<std::ptrdiff_t>(from), list_.end(),
                       [&](std::int32_t a, std::int32_t b) {
                         return taken_near_[static_cast<std::size_t>(a)] > taken_near_[static_cast<std::size_t>(b)];
                       });
    }
    if (list_.size() > most_candidates) list_.resize(most_candidates);
    ++turn_;
    return list_;
  }
  [[nodiscard]] bool taken(std::int32_t p) const { return taken_[static_cast<std::size_t>(p)] != 0; }
  void take(std::int32_t p) {
    taken_[static_cast<std::size_t>(p)] = 1;
    latest_.push_back(p);
    looked_at_ += static_cast<std::int64_t>(neighbours_.of(p).size());
    for (const std::int32_t q : neighbours_.of(p)) ++taken_near_[static_cast<std::size_t>(q)];
  }
  [[nodiscard]] std::int64_t looked_at() const { return looked_at_; }
  // Where a point that is not among the candidates is expected: beside the latest one.
  [[nodiscard]] std::int32_t expected() const { return latest_.empty() ? 0 : latest_.back(); }
  [[nodiscard]] int context() const { return context_; }
  // Context of the next place, by this one (0: none in the list).
  void note(std::int64_t place) {
    context_ = place == 0 ? 4 : std::min(bit_length(static_cast<std::uint64_t>(place)) - 1, 3);
  }

 private:
  Neighbours neighbours_;
  std::vector<std::uint8_t> taken_;
  std::vector<std::int32_t> taken_near_;  // neighbours of each
  std::vector<std::int32_t> seen_;
  std::vector<std::int32_t> latest_;
  std::vector<std::int32_t> list_;
  std::int32_t turn_ = 0;
  std::int64_t looked_at_ = 0;  // neighbours
  int context_ = 4;
};

constexpr int far_context = 6;

}  // namespace

std::int64_t put_order(IntegerWriter& out, std::span<const std::int32_t> point_of,
                       std::span<const Triangle> triangles) {
  Order order(static_cast<int>(point_of.size()), triangles);
  for (const std::int32_t p : point_of) {
    const auto& list = order.candidates();
    const auto found = std::find(list.begin(), list.end(), p);
    const std::int64_t place = found == list.end() ? 0 : found - list.begin() + 1;
    out.put(place, order.context());
    if (place == 0) out.put(p - order.expected(), far_context);
    order.note(place);
    order.take(p);
  }
  return order.looked_at();
}

std::vector<std::int32_t> get_order(IntegerReader& in, int vertices, std::span<const Triangle> triangles) {
  Order order(vertices, triangles);
  std::vector<std::int32_t> point_of;
  point_of.reserve(static_cast<std::size_t>(vertices));
  for (int v = 0; v < vertices; ++v) {
    const auto& list = order.candidates();
    const std::int64_t place = in.get_between(0, static_cast<std::int64_t>(list.size()), order.context());
    const std::int64_t p =
        place > 0 ? list[static_cast<std::size_t>(place - 1)] : order.expected() + in.get(far_context);
    if (p < 0 || p >= vertices || order.taken(static_cast<std::int32_t>(p))) in.damaged();
    order.note(place);
    order.take(static_cast<std::int32_t>(p));
    point_of.push_back(static_cast<std::int32_t>(p));
  }
  return point_of;
}

}  // namespace kinespace
