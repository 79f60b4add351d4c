#include "kinespace/repeats/repeat_choice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <queue>
#include <tuple>
#include <unordered_set>

#include "kinespace/base/parallel.h"
#include "kinespace/repeats/detail/option_range.h"
#include "kinespace/repeats/detail/path_index.h"
#include "kinespace/repeats/detail/repeat_candidates.h"

namespace kinespace {
namespace {

// Distances that a standard deviation is taken of: at most this many, evenly spread, of a longer interval.
constexpr int samples = 24;

// Candidates that are looked at again before the best of them is taken.
constexpr int looks = 32;

struct Spread {
  double sum = 0, squares = 0;
  int count = 0;
  void add(double value) {
    sum += value;
    squares += value * value;
    ++count;
  }
  [[nodiscard]] double deviation() const {
    if (count == 0) return 0;
    const double mean = sum / count;
    return std::sqrt(std::max(squares / count - mean * mean, 0.0));
  }
};

// Calls use(k) for every index below count, or for `samples` of them.
template <class Use>
void spread_over(int count, const Use& use) {
  const int taken = std::min(count, samples);
  for (int k = 0; k < taken; ++k) use(static_cast<int>((static_cast<std::int64_t>(2 * k + 1) * count) / (2 * taken)));
}

double overhead(const SelfDistance& table, double seconds) {
  return seconds * table.pixel_rate_hz() * table.stride() * table.typical();
}

double path_cost(const SelfDistance& table, const PathSide& part, int pixels, const ChoiceOptions& options) {
  Spread spread;
  spread_over(static_cast<int>(part.size()),
              [&](int k) { spread.add(static_cast<double>(part.points[static_cast<std::size_t>(k)].distance)); });
  return spread.deviation() * pixels * table.stride() + overhead(table, options.repeated_overhead_s);
}

// One stretch that a path offers as a repetition, cut to what is free.
struct Offer {
  PathSide part;
  int first = 0, last = 0;
  double unique_cost = 0, repeated_cost = 0;
  [[nodiscard]] double saving() const { return unique_cost - repeated_cost; }
};

struct Evaluation {
  double gain = 0;
  std::vector<Offer> offers;
};

class Chooser {
 public:
  Chooser(const SelfDistance& table, std::span<const PosturePath> paths, const ChoiceOptions& options)
      : table_(table),
        options_(options),
        index_(paths, table.size()),
        taken_(static_cast<std::size_t>(table.size()), 0),
        shortest_(std::max(1, static_cast<int>(std::ceil(options.shortest_s * table.pixel_rate_hz() - 1e-9)))) {}

  std::vector<PrimaryChoice> choose(std::span<const PosturePath> paths) {
    const std::vector<PixelInterval> candidates = candidate_intervals(table_, paths, shortest_, longest_pixels());
    std::vector<double> gains(candidates.size());
    parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t c) { gains[c] = evaluate(candidates[c]).gain; });
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      if (is_new(candidates[c])) push(candidates[c], gains[c]);
    }
    std::vector<PrimaryChoice> out;
    while (const auto best = best_candidate()) out.push_back(take(*best, evaluate(*best)));
    return out;
  }

 private:
  struct Entry {
    double gain = 0;
    PixelInterval interval;
    // The longer interval wins a draw, then the earlier.
    bool operator<(const Entry& other) const {
      return std::tuple(gain, interval.last - interval.first, -interval.first) <
             std::tuple(other.gain, other.interval.last - other.interval.first, -other.interval.first);
    }
  };

  // The free candidate of the largest gain. Gains in the queue date from when a candidate was last looked at, and they
  // fall as clips are taken: candidates are looked at again from the top until one stays there, or until the best of
  // `looks` of them stands for all.
  std::optional<PixelInterval> best_candidate() {
    Entry best;
    for (int look = 0; look < looks && !queue_.empty();) {
      const Entry top = queue_.top();
      queue_.pop();
      if (!is_free(top.interval)) {
        push_rest(top.interval);
        continue;
      }
      const Entry now{evaluate(top.interval).gain, top.interval};
      if (now.gain < options_.least_gain) continue;
      if (queue_.empty() || now.gain >= queue_.top().gain) return now.interval;
      queue_.push(now);
      best = std::max(best, now);
      ++look;
    }
    if (best.gain < options_.least_gain) return std::nullopt;
    return best.interval;
  }
  void push_rest(const PixelInterval& interval) {
    for (const PixelInterval& rest : free_parts(interval)) {
      if (is_new(rest)) push(rest, evaluate(rest).gain);
    }
  }

  [[nodiscard]] int longest_pixels() const {
    return std::max(shortest_, static_cast<int>(std::lround(options_.longest_s * table_.pixel_rate_hz())));
  }
  void push(const PixelInterval& interval, double gain) {
    if (gain >= options_.least_gain) queue_.push({gain, interval});
  }
  // What is left of many candidates is the same.
  bool is_new(const PixelInterval& interval) {
    return seen_.insert((static_cast<std::uint64_t>(interval.first) << 32U) | static_cast<std::uint64_t>(interval.last))
        .second;
  }
  [[nodiscard]] bool is_taken(int pixel) const { return taken_[static_cast<std::size_t>(pixel)] != 0; }
  [[nodiscard]] bool is_free(const PixelInterval& interval) const { return first_taken(interval) == interval.last; }
  [[nodiscard]] int first_taken(const PixelInterval& interval) const {
    int p = interval.first;
    while (p < interval.last && !is_taken(p)) ++p;
    return p;
  }
  // The free stretches of an interval that are long enough.
  [[nodiscard]] std::vector<PixelInterval> free_parts(PixelInterval interval) const {
    std::vector<PixelInterval> out;
    while (interval.first < interval.last) {
      const int end = first_taken(interval);
      if (end - interval.first >= shortest_) out.push_back({interval.first, end});
      interval.first = std::max(end, interval.first + 1);
      while (interval.first < interval.last && is_taken(interval.first)) ++interval.first;
    }
    return out;
  }

  // The longest stretch of [first, last) that no clip holds and that is not in the primary interval.
  [[nodiscard]] PixelInterval longest_free(int first, int last, const PixelInterval& primary) const {
    PixelInterval best{first, first};
    int begin = first;
    for (int p = first; p <= last; ++p) {
      const bool free = p < last && !is_taken(p) && (p < primary.first || p >= primary.last);
      if (free) continue;
      if (p - begin > best.last - best.first) best = {begin, p};
      begin = p + 1;
    }
    return best;
  }

  [[nodiscard]] std::vector<Offer> offers(const PixelInterval& primary) const {
    std::vector<Offer> out;
    index_.visit(primary.first, primary.last, [&](const PathSide& side) {
      const int first = side.to(0), last = side.to(side.size() - 1) + 1;
      if (last - first < shortest_) return;
      const PixelInterval free = longest_free(first, last, primary);
      if (free.last - free.first < shortest_) return;
      Offer offer{side.part_to(free.first, free.last), free.first, free.last, 0, 0};
      if (offer.part.size() == 0) return;
      offer.unique_cost = primary_cost(table_, free.first, free.last, options_);
      offer.repeated_cost = path_cost(table_, offer.part, free.last - free.first, options_);
      if (offer.saving() > 0) out.push_back(std::move(offer));
    });
    std::stable_sort(out.begin(), out.end(), [](const Offer& a, const Offer& b) { return a.saving() > b.saving(); });
    return out;
  }

  // The gain of a free interval, with the repetitions that do not lie over each other: what saves most first.
  [[nodiscard]] Evaluation evaluate(const PixelInterval& primary) const {
    Evaluation out;
    std::vector<PixelInterval> held;  // ascending
    double unique = 0, repeated = 0;
    int pixels = 0;
    for (Offer& offer : offers(primary)) {
      const auto at = std::lower_bound(held.begin(), held.end(), offer.first,
                                       [](const PixelInterval& h, int first) { return h.first < first; });
      if (at != held.end() && at->first < offer.last) continue;
      if (at != held.begin() && std::prev(at)->last > offer.first) continue;
      held.insert(at, {offer.first, offer.last});
      unique += offer.unique_cost;
      repeated += offer.repeated_cost;
      pixels += offer.last - offer.first;
      out.offers.push_back(std::move(offer));
    }
    // The paper's condition: more is repeated than is kept to refer to.
    if (pixels < primary.last - primary.first) return {};
    const double own = primary_cost(table_, primary.first, primary.last, options_);
    const double improved = own + repeated;
    out.gain = improved > 0 ? (own + unique) / improved : 1;
    return out;
  }

  [[nodiscard]] PrimaryChoice take(const PixelInterval& primary, const Evaluation& evaluation) {
    PrimaryChoice out{primary.first, primary.last, evaluation.gain, {}};
    hold(primary.first, primary.last);
    for (const Offer& offer : evaluation.offers) {
      out.repetitions.push_back(
          {offer.first, offer.last, references(offer.part, offer.first, offer.last, primary.first, primary.last)});
      hold(offer.first, offer.last);
    }
    return out;
  }
  void hold(int first, int last) { std::fill(taken_.begin() + first, taken_.begin() + last, std::uint8_t{1}); }

  const SelfDistance& table_;
  const ChoiceOptions& options_;
  PathIndex index_;
  std::vector<std::uint8_t> taken_;
  int shortest_;
  std::unordered_set<std::uint64_t> seen_;
  std::priority_queue<Entry> queue_;
};

}  // namespace

void ChoiceOptions::validate() const {
  require_option("shortest_s", shortest_s, 0.02, 10);
  require_option("longest_s", longest_s, shortest_s, 600);
  require_option("least_gain", least_gain, 1, 1e9);
  require_option("primary_overhead_s", primary_overhead_s, 0, 60);
  require_option("repeated_overhead_s", repeated_overhead_s, 0, 60);
}

double primary_cost(const SelfDistance& table, int first, int last, const ChoiceOptions& options) {
  const int middle = first + (last - first) / 2;
  Spread spread;
  spread_over(last - first, [&](int k) { spread.add(static_cast<double>(table.at(middle, first + k))); });
  return spread.deviation() * (last - first) * table.stride() + static_cast<double>(table.at(middle, first)) +
         overhead(table, options.primary_overhead_s);
}

double repeated_cost(const SelfDistance& table, std::span<const float> distances, const ChoiceOptions& options) {
  Spread spread;
  const int count = static_cast<int>(distances.size());
  spread_over(count, [&](int k) { spread.add(static_cast<double>(distances[static_cast<std::size_t>(k)])); });
  return spread.deviation() * count * table.stride() + overhead(table, options.repeated_overhead_s);
}

std::vector<PrimaryChoice> choose_repeats(const SelfDistance& table, std::span<const PosturePath> paths,
                                          const ChoiceOptions& options) {
  options.validate();
  if (paths.empty()) return {};
  return Chooser(table, paths, options).choose(paths);
}

}  // namespace kinespace
