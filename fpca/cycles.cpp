#include "kinespace/fpca/cycles.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include <Eigen/Core>
#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/pose_features.h"

namespace kinespace {
namespace {

constexpr double keys_per_s = 30;
constexpr double least_second_cycle = 0.8;  // of a cycle, where the frames end
constexpr double least_variance = 1e-6;     // e of the header
// Costs of the path, tuned on walks and runs of bandai.
constexpr double length_cost = 0.1;
constexpr double change_cost = 0.05;
constexpr int most_change = 2;  // keys, from key to key
constexpr double switch_cost = 0.5;
constexpr int smoothed_keys = 9;
// Keys of a block. A block's path is chosen when the next one is known, two minutes on: paths that differ by less than
// two switches of state have met long before.
constexpr int keys_per_block = 4096;
constexpr double no_path = std::numeric_limits<double>::infinity();

void require_cycle_option(bool legal, const char* field, double value, const char* range) {
  if (legal) return;
  throw Error(ErrorKind::usage, {.found = fmt::format("CycleOptions::{} = {}", field, value), .expected = range});
}

// Cycle lengths in keys.
struct CycleLags {
  int shortest;
  int longest;  // shorter than the options say where the clip has no room for two of those
  double longest_wished;

  CycleLags(const CycleOptions& options, int keys)
      : shortest(std::max(2, static_cast<int>(std::round(options.shortest_s * keys_per_s)))),
        longest(static_cast<int>(std::round(options.longest_s * keys_per_s))),
        longest_wished(std::max(shortest, longest)) {
    longest = std::max(shortest, longest);
    while (longest >= shortest && last_key(longest, keys) < 0) --longest;
  }

  [[nodiscard]] int count() const { return longest - shortest + 1; }
  // The last key that is followed by a cycle of that length and enough of another.
  [[nodiscard]] static int last_key(int lag, int keys) {
    return keys - lag - static_cast<int>(std::ceil(least_second_cycle * lag - 1e-9));
  }
};

// r(t, L) for block after block of keys.
class CycleRatios {
 public:
  CycleRatios(const PoseFeatureSource& source, int first_key, int keys, const CycleLags& lags)
      : source_(source),
        first_key_(first_key),
        keys_(keys),
        lags_(lags),
        reach_(2 * lags.longest),
        latest_(static_cast<std::size_t>(lags.count()), std::numeric_limits<float>::infinity()) {}

  // [key][lag] of the keys [begin, begin + count), the next ones after those of the last call. Beyond the last key of a
  // lag its r stays what it was there, so that a path does not flee into ever shorter cycles as the end comes near.
  std::vector<float> next(int begin, int count) {
    measure_distances(begin, std::min(keys_ - begin, count + reach_));
    std::vector<float> out(static_cast<std::size_t>(count) * latest_.size());
    compare_neighbours(begin, count, out);
    sum_distances();
    divide_by_variance(begin, count, out);
    return out;
  }

 private:
  // Keys of the second stretch that are compared.
  [[nodiscard]] int compared(int key, int lag) const { return std::min(lag, keys_ - key - lag); }
  [[nodiscard]] float& distance(int row, int back) {
    return distances_[static_cast<std::size_t>(row) * static_cast<std::size_t>(reach_) +
                      static_cast<std::size_t>(back)];
  }

  // distance(i, k) = |x(i) - x(i - k)|^2 of the rows of this block, 0 <= k < reach.
  void measure_distances(int begin, int rows) {
    rows_ = rows;
    features_.clear();
    source_.append(first_key_ + begin, rows, features_);
    const auto dims = source_.dims();
    distances_.assign(static_cast<std::size_t>(rows) * static_cast<std::size_t>(reach_), 0.0F);
    const auto row = [&](int i) {
      return Eigen::Map<const Eigen::ArrayXf>(features_.data() + static_cast<std::ptrdiff_t>(i) * dims, dims);
    };
    for (int i = 0; i < rows; ++i) {
      const int most = std::min(i, reach_ - 1);
      for (int k = 1; k <= most; ++k) distance(i, k) = (row(i) - row(i - k)).square().sum();
    }
  }

  // The numerators: means of distance(u + L, L) over the u from a key on, as running sums.
  void compare_neighbours(int begin, int count, std::vector<float>& out) {
    std::vector<double> sums(latest_.size(), 0.0);
    for (int key = 0; key < count; ++key) {
      for (std::size_t l = 0; l < sums.size(); ++l) {
        const int lag = lags_.shortest + static_cast<int>(l);
        const int length = compared(begin + key, lag);
        if (length <= 0) break;
        if (key == 0) {
          for (int u = 0; u < length; ++u) sums[l] += distance(u + lag, lag);
        } else {
          sums[l] -= distance(key - 1 + lag, lag);
          if (compared(begin + key - 1, lag) == length) sums[l] += distance(key - 1 + length + lag, lag);
        }
        out[static_cast<std::size_t>(key) * sums.size() + l] = static_cast<float>(std::max(0.0, sums[l]) / length);
      }
    }
  }

  // From here on distance(i, k) is the sum over 1..k.
  void sum_distances() {
    for (int i = 0; i < rows_; ++i) {
      for (int k = 1; k < reach_; ++k) distance(i, k) += distance(i, k - 1);
    }
  }

  // The variance of n rows is the sum of their squared distances, each pair once, over n^2: nothing is subtracted, so
  // that it is exact for a body at rest as well.
  void divide_by_variance(int begin, int count, std::vector<float>& out) {
    for (int key = 0; key < count; ++key) {
      double pairs = 0;
      int n = 1;  // rows in pairs
      for (std::size_t l = 0; l < latest_.size(); ++l) {
        const int lag = lags_.shortest + static_cast<int>(l);
        float& r = out[static_cast<std::size_t>(key) * latest_.size() + l];
        if (begin + key <= CycleLags::last_key(lag, keys_)) {
          for (const int window = lag + compared(begin + key, lag); n < window; ++n) pairs += distance(key + n, n);
          const double variance = pairs / (static_cast<double>(n) * n);
          latest_[l] = static_cast<float>((r + least_variance) / (2 * variance + least_variance));
        }
        r = latest_[l];
      }
    }
  }

  const PoseFeatureSource& source_;
  int first_key_;
  int keys_;
  CycleLags lags_;
  int reach_;                  // keys from a key to the end of its longest two cycles
  std::vector<float> latest_;  // by lag
  int rows_ = 0;
  std::vector<float> features_;
  std::vector<float> distances_;
};

struct CycleKey {
  float length = 0;  // T, in keys; 0 where not cyclic
  float difference = 0;
};

// The cheapest path through states: one for each lag, the last one not cyclic.
class CyclePath {
 public:
  CyclePath(const CycleLags& lags, double most_difference)
      : lags_(lags), none_(lags.count()), none_cost_(most_difference), costs_(padded(), no_path) {}

  // The next keys' r, [key][lag].
  void add(std::vector<float> ratios) {
    latest_.ratios = std::move(ratios);
    const std::size_t count = latest_.ratios.size() / static_cast<std::size_t>(none_);
    latest_.change.resize(latest_.ratios.size());
    latest_.from.resize(count);
    for (std::size_t key = 0; key < count; ++key) step(key);
    int state = best_state();
    for (std::size_t key = count; key-- > 0;) state = before(latest_, key, state);
    choose(earlier_, state);
    earlier_ = std::exchange(latest_, {});
  }

  [[nodiscard]] std::vector<CycleKey> finish() {
    choose(earlier_, best_state());
    return std::move(path_);
  }

 private:
  struct Block {
    std::vector<float> ratios;        // [key][lag]
    std::vector<std::int8_t> change;  // [key][lag]: of the lag since the key before, or `began`
    std::vector<int> from;            // by key: the state before "not cyclic"
  };
  static constexpr std::int8_t began = 100;

  // Costs have lags around them that are none, so that every one has neighbours.
  [[nodiscard]] std::size_t padded() const { return static_cast<std::size_t>(none_) + 2 * most_change; }
  [[nodiscard]] std::size_t cell(std::size_t key, int lag) const {
    return key * static_cast<std::size_t>(none_) + static_cast<std::size_t>(lag);
  }

  [[nodiscard]] int best_state() const {
    const auto best = std::ranges::min_element(costs_);
    return *best < idle_ ? static_cast<int>(best - costs_.begin()) - most_change : none_;
  }

  void step(std::size_t key) {
    const std::vector<double> old = costs_;
    const auto best = std::ranges::min_element(old);
    for (int lag = 0; lag < none_; ++lag) {
      double least = idle_ + switch_cost;
      std::int8_t change = began;
      for (int d = -most_change; d <= most_change; ++d) {
        const double cost = old[static_cast<std::size_t>(lag + most_change - d)] + change_cost * std::abs(d);
        if (cost < least) {
          least = cost;
          change = static_cast<std::int8_t>(d);
        }
      }
      latest_.change[cell(key, lag)] = change;
      costs_[static_cast<std::size_t>(lag + most_change)] =
          least + key_of(latest_, key, lag).difference + length_cost * (lags_.shortest + lag) / lags_.longest_wished;
    }
    const bool ceases = *best + switch_cost < idle_;
    latest_.from[key] = ceases ? static_cast<int>(best - old.begin()) - most_change : none_;
    idle_ = (ceases ? *best + switch_cost : idle_) + none_cost_;
  }

  [[nodiscard]] int before(const Block& block, std::size_t key, int state) const {
    if (state == none_) return block.from[key];
    const std::int8_t change = block.change[cell(key, state)];
    return change == began ? none_ : state - change;
  }

  // The path through a block that ends in a state.
  void choose(const Block& block, int state) {
    const std::size_t first = path_.size();
    path_.resize(first + block.from.size());
    for (std::size_t key = block.from.size(); key-- > 0; state = before(block, key, state)) {
      if (state != none_) path_[first + key] = key_of(block, key, state);
    }
  }

  // Below a key: the bottom of the parabola through the differences of three neighbouring lags. Its depth counts, too:
  // twice a cycle of 13.5 keys is a whole number of keys, and would repeat better than 13 or 14 do.
  [[nodiscard]] CycleKey key_of(const Block& block, std::size_t key, int lag) const {
    const float b = block.ratios[cell(key, lag)];
    CycleKey out{static_cast<float>(lags_.shortest + lag), b};
    if (lag == 0 || lag + 1 == none_) return out;
    const float a = block.ratios[cell(key, lag - 1)];
    const float c = block.ratios[cell(key, lag + 1)];
    const float bend = a - 2 * b + c;
    // Up to 0.75, so that a path which keeps its lag beyond the half way to the next one is no worse for it.
    if (!std::isfinite(bend) || !(bend > 0) || std::abs(a - c) > 2 * 0.75F * bend) return out;
    out.length += (a - c) / (2 * bend);
    out.difference = std::max(0.0F, b - (a - c) * (a - c) / (8 * bend));
    return out;
  }

  CycleLags lags_;
  int none_;
  double none_cost_;
  std::vector<double> costs_;
  double idle_ = 0;  // of "not cyclic"
  Block earlier_, latest_;
  std::vector<CycleKey> path_;
};

// Keys [begin, end) of a path that are cyclic.
struct CyclicKeys {
  int begin;
  int end;
};

class StretchMaker {
 public:
  StretchMaker(std::span<const CycleKey> path, const CycleLags& lags, double most_difference, int first_key,
               double frames_per_key)
      : path_(path),
        lags_(lags),
        most_difference_(most_difference),
        first_key_(first_key),
        frames_per_key_(frames_per_key) {}

  // Without marks where there is no whole cycle.
  [[nodiscard]] CyclicStretch stretch(CyclicKeys keys) const {
    keys.end = last_compared(keys) + 1;
    CyclicStretch out;
    if (keys.end == keys.begin) return out;
    double saved = 0;
    for (int key = keys.begin; key < keys.end; ++key) {
      saved += most_difference_ - at(key).difference - length_cost * at(key).length / lags_.longest_wished;
      out.difference += static_cast<double>(at(key).difference) / (keys.end - keys.begin);
    }
    if (saved < switch_cost) return out;
    const double end = std::min(static_cast<double>(path_.size()) - 1, keys.end - 1 + 2.0 * at(keys.end - 1).length);
    place_marks(keys, end, out);
    return out;
  }

 private:
  [[nodiscard]] const CycleKey& at(int key) const { return path_[static_cast<std::size_t>(key)]; }
  [[nodiscard]] int frame_of(double key) const {
    return static_cast<int>(std::lround((first_key_ + key) * frames_per_key_));
  }

  // begin - 1 where none has enough frames after it.
  [[nodiscard]] int last_compared(CyclicKeys keys) const {
    int key = keys.begin;
    while (key < keys.end && key <= CycleLags::last_key(static_cast<int>(std::lround(at(key).length)), size())) ++key;
    return key - 1;
  }
  [[nodiscard]] int size() const { return static_cast<int>(path_.size()); }

  // The cycle's length at each key from the first to the end.
  [[nodiscard]] std::vector<double> lengths(CyclicKeys keys, int end) const {
    std::vector<double> out;
    out.reserve(static_cast<std::size_t>(end - keys.begin) + 1);
    int next = keys.begin;  // the first one whose middle lies at the key or beyond
    double middle_before = 0;
    for (int key = keys.begin; key <= end; ++key) {
      while (next < keys.end && next + static_cast<double>(at(next).length) < key) {
        middle_before = next + static_cast<double>(at(next).length);
        ++next;
      }
      if (next == keys.begin || next == keys.end) {
        out.push_back(at(std::min(next, keys.end - 1)).length);
        continue;
      }
      const double middle = next + static_cast<double>(at(next).length);
      const double b = (key - middle_before) / (middle - middle_before);
      out.push_back((1 - b) * at(next - 1).length + b * at(next).length);
    }
    return out;
  }

  void place_marks(CyclicKeys keys, double end, CyclicStretch& out) const {
    const std::vector<double> length = lengths(keys, static_cast<int>(end));
    const auto smoothed = [&](int i) {
      double sum = 0;
      for (int d = -(smoothed_keys / 2); d <= smoothed_keys / 2; ++d) {
        sum += length[static_cast<std::size_t>(std::clamp(i + d, 0, static_cast<int>(length.size()) - 1))];
      }
      return sum / smoothed_keys;
    };
    out.end = frame_of(end);
    out.marks = {frame_of(keys.begin)};
    // A mark belongs to the nearest frame: the last one may lie half a frame beyond the end.
    const double limit = end - keys.begin + 0.5 / frames_per_key_;
    double phase = 0;  // since the mark before
    double pace = 1 / smoothed(0);
    for (int i = 0; i < limit; ++i) {
      const double next_pace = 1 / smoothed(i + 1);
      const double step = (pace + next_pace) / 2;
      pace = next_pace;
      phase += step;
      if (phase < 1) continue;  // a cycle lasts more than a key
      phase -= 1;
      const double mark = i + 1 - phase / step;
      const int frame = std::min(frame_of(keys.begin + mark), out.end);
      if (mark <= limit && frame > out.marks.back()) out.marks.push_back(frame);
    }
  }

  std::span<const CycleKey> path_;
  CycleLags lags_;
  double most_difference_;
  int first_key_;
  double frames_per_key_;
};

std::vector<CyclicKeys> cyclic_keys(std::span<const CycleKey> path) {
  std::vector<CyclicKeys> out;
  for (int key = 0; key < static_cast<int>(path.size()); ++key) {
    if (path[static_cast<std::size_t>(key)].length == 0) continue;
    if (out.empty() || out.back().end != key) out.push_back({key, key});
    out.back().end = key + 1;
  }
  return out;
}

// The last marks of a stretch may lie in the next one.
void part_stretches(std::vector<CyclicStretch>& stretches) {
  for (std::size_t i = stretches.size(); i-- > 1;) {
    CyclicStretch& earlier = stretches[i - 1];
    earlier.end = std::min(earlier.end, stretches[i].marks.front() - 1);
    while (earlier.marks.size() > 1 && earlier.marks.back() > earlier.end) earlier.marks.pop_back();
    if (earlier.marks.size() < 2) stretches.erase(stretches.begin() + static_cast<std::ptrdiff_t>(i) - 1);
  }
}

}  // namespace

void CycleOptions::validate() const {
  require_cycle_option(shortest_s > 0, "shortest_s", shortest_s, "seconds above 0");
  require_cycle_option(longest_s > shortest_s && longest_s <= 60, "longest_s", longest_s,
                       "seconds above shortest_s, at most 60");
  require_cycle_option(most_difference > 0 && most_difference <= 1, "most_difference", most_difference,
                       "more than 0, at most 1");
}

std::vector<CyclicStretch> find_cycles(const ClipCurves& curves, const Skeleton& skeleton, int first, int last,
                                       const CycleOptions& options) {
  options.validate();
  assert(first >= 0 && last < curves.frames());
  if (last <= first) return {};
  const PoseFeatureSource source(curves, skeleton, {.rate_hz = keys_per_s});
  const double frames_per_key = curves.rate_hz / keys_per_s;
  const int first_key = static_cast<int>(std::ceil(first / frames_per_key - 1e-9));
  const int last_key = std::min(static_cast<int>(std::floor(last / frames_per_key + 1e-9)), source.rows() - 1);
  const int keys = last_key - first_key + 1;
  const CycleLags lags(options, keys);
  if (lags.count() < 1) return {};

  CycleRatios ratios(source, first_key, keys, lags);
  CyclePath search(lags, options.most_difference);
  for (int key = 0; key < keys; key += keys_per_block)
    search.add(ratios.next(key, std::min(keys_per_block, keys - key)));
  const std::vector<CycleKey> path = search.finish();

  const StretchMaker maker(path, lags, options.most_difference, first_key, frames_per_key);
  std::vector<CyclicStretch> out;
  for (const CyclicKeys& keys_of_one : cyclic_keys(path)) {
    CyclicStretch stretch = maker.stretch(keys_of_one);
    if (stretch.marks.size() > 1) out.push_back(std::move(stretch));
  }
  part_stretches(out);
  return out;
}

}  // namespace kinespace
