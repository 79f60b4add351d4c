#include "kinespace/codecs/rma/detail/repeat_stream.h"

#include <algorithm>

#include "kinespace/base/error.h"
#include "kinespace/codecs/rma/contact_ik.h"
#include "kinespace/codecs/rma/seams.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

constexpr double seam_smoothing_s = 0.2;  // to either side of a seam
constexpr int prediction_context = contact_contexts;
constexpr int jump_context = prediction_context + prediction_contexts;
constexpr int point_context = jump_context + 1;
constexpr int limit_context = point_context + 1;
constexpr int context_count = limit_context + 1;

// The vectors of a window, of the one before and of the one after: all that its frames are smoothed by.
class NearWindows {
 public:
  explicit NearWindows(std::span<const WindowPlace> windows) : windows_(windows) {}

  // The window after the last that was added; `first` when there is none.
  [[nodiscard]] std::size_t end(std::size_t first) const { return held_.empty() ? first : held_.back().window + 1; }
  void add(std::size_t window, std::vector<double> vectors) {
    if (held_.size() == 3) held_.erase(held_.begin());
    held_.push_back({window, std::move(vectors)});
  }
  [[nodiscard]] std::span<const double> vectors(std::size_t window) const {
    return std::ranges::find(held_, window, &Held::window)->vectors;
  }
  void get(int frame, std::span<double> out) {
    visit(frame, [&](std::size_t k, const double& value) { out[k] = value; });
  }
  void set(int frame, std::span<const double> values) {
    visit(frame, [&](std::size_t k, double& value) { value = values[k]; });
  }

 private:
  struct Held {
    std::size_t window = 0;
    std::vector<double> vectors;  // [dimension][point]
  };

  template <typename Take>
  void visit(int frame, const Take& take) {
    for (Held& held : held_) {
      const WindowPlace& place = windows_[held.window];
      if (frame < place.first || frame >= place.first + place.points) continue;
      const auto points = static_cast<std::size_t>(place.points);
      double* const at = held.vectors.data() + (frame - place.first);
      for (std::size_t k = 0; k < held.vectors.size() / points; ++k) take(k, at[k * points]);
    }
  }

  std::span<const WindowPlace> windows_;
  std::vector<Held> held_;
};

}  // namespace

Bytes pack_repeats(const RepeatTables& tables, const ClipTable& clips) {
  ValueWriter out(context_count);
  put_predictions(out, clips, tables.predictions, prediction_context);
  for (const bool jump : tables.jumps) out.put_bit(jump, jump_context);
  for (const auto& clip : tables.contacts) put_contacts(out, clip);
  for (const auto& level : tables.predicted.points.shift) {
    for (const std::int8_t shift : level) out.put(shift, point_context);
  }
  out.put(tables.seam_limit_cm_s, limit_context);
  const Bytes numbers = std::move(out).finish();
  const bool any = std::ranges::any_of(tables.predictions, &WindowPrediction::used);
  ByteWriter all;
  put_part(all, numbers);
  if (!any) return std::move(all).take();
  put_part(all, pack_spectrum(tables.predicted.spectrum));
  all.put_bytes(pack_start(tables.predicted.start));
  return std::move(all).take();
}

void unpack_repeats(std::span<const std::byte> bytes, const ClipTable& clips, std::int64_t numbers,
                    const std::string& source, RepeatTables& out) {
  ByteReader all(bytes, source);
  ValueReader in(get_part(all, "bytes of repeats"), context_count, source);
  out.predictions = get_predictions(in, clips, prediction_context);
  for (std::size_t w = 0; w < out.predictions.size(); ++w) out.jumps.push_back(in.get_bit(jump_context));
  for (const ClipEntry& clip : clips.clips) {
    const Skeleton& skeleton = clips.skeletons[static_cast<std::size_t>(clip.skeleton)];
    out.contacts.push_back(get_contacts(in, clip.frames, skeleton.joint_count(), numbers));
  }
  for (auto& level : out.predicted.points.shift) {
    for (std::int8_t& shift : level) shift = static_cast<std::int8_t>(in.get_between(-127, 127, point_context));
  }
  out.seam_limit_cm_s = static_cast<int>(in.get_between(0, most_seam_limit, limit_context));
  in.expect_end();
  const int components = out.tables.basis.components;
  out.predicted.spectrum = out.tables.coding.spectrum;
  if (std::ranges::any_of(out.predictions, &WindowPrediction::used)) {
    const auto spectrum = get_part(all, "bytes of a spectrum");
    out.predicted.spectrum = unpack_spectrum(spectrum, components, source);
    out.predicted.start = unpack_start(all.take(all.remaining()), source);
  }
  all.expect_end();
}

std::int64_t numbers_in(const RepeatTables& tables) {
  std::int64_t out = 0;
  for (const auto& clip : tables.contacts) {
    for (const ContactCode& code : clip) out += 16 + code.frames();
  }
  return out;
}

RepeatLayout::RepeatLayout(const ClipTable& clips, const RepeatTables& tables)
    : plain(lay_out(clips, tables.tables.coding.spectrum, tables.tables.group_frames)),
      predicted(lay_out(clips, tables.predicted.spectrum, tables.tables.group_frames)),
      group_of_(plain.windows.size()) {
  for (std::size_t g = 0; g < plain.groups.size(); ++g) {
    for (std::size_t i = 0; i < plain.groups[g].count; ++i) group_of_[plain.groups[g].first + i] = g;
  }
}

GroupPart group_part(const RepeatLayout& layout, const RepeatTables& tables, std::size_t group, bool is_predicted) {
  GroupPart out;
  const WindowGroup& of = layout.plain.groups[group];
  const auto components = static_cast<std::size_t>(tables.tables.basis.components);
  for (std::size_t w = of.first; w < of.first + of.count; ++w) {
    if (tables.predictions[w].used() != is_predicted) continue;
    const WindowPlace& window = layout.window(w, is_predicted);
    const bool neighbours = !out.windows.empty() && out.windows.back() + 1 == w;
    out.windows.push_back(w);
    out.blocks.push_back(
        {.functions = window.functions, .edges = window.edges, .follows = window.follows && neighbours});
    out.offsets.push_back(out.size);
    out.size += components * static_cast<std::size_t>(window.functions);
  }
  return out;
}

RepeatDecoder::RepeatDecoder(const ClipTable& clips, const RepeatTables& tables, const RepeatLayout& layout,
                             Groups groups, std::string source)
    : clips_(clips),
      tables_(tables),
      layout_(layout),
      groups_(std::move(groups)),
      source_(std::move(source)),
      synthesis_(tables.tables, clips.skeletons.front()) {}

std::vector<double> RepeatDecoder::plain_part(std::size_t w) const {
  const bool is_predicted = tables_.predictions[w].used();
  const WindowPlace& window = layout_.window(w, is_predicted);
  const std::size_t g = layout_.group_of(w);
  const auto group = groups_(g);
  const auto [offset, size] = group->places[w - layout_.plain.groups[g].first];
  std::vector<double> out(static_cast<std::size_t>(tables_.tables.reference.dimensions()) *
                          static_cast<std::size_t>(window.points));
  WindowSynthesis::Scratch scratch;
  synthesis_.synthesise(window, std::span(group->values[is_predicted ? 1 : 0]).subspan(offset, size), out, scratch);
  return out;
}

std::vector<double> RepeatDecoder::predicted_vectors(std::size_t w) const {
  const WindowPrediction& prediction = tables_.predictions[w];
  const auto clip = static_cast<std::size_t>(prediction.clip);
  const int first = prediction.first_frame();
  const int count = std::min(prediction.last_frame() + 2, clips_.clips[clip].frames) - first;
  const auto dimensions = static_cast<std::size_t>(tables_.tables.reference.dimensions());
  std::vector<double> reference(dimensions * static_cast<std::size_t>(count));
  for (std::size_t r = layout_.plain.first_of_clip[clip]; r < layout_.plain.first_of_clip[clip + 1]; ++r) {
    const WindowPlace& window = layout_.plain.windows[r];
    const int from = std::max(first, window.first);
    const int to = std::min(first + count, window.first + window.points);
    if (from >= to) continue;
    if (tables_.predictions[r].used()) {
      throw Error(ErrorKind::bad_input, {.file = source_,
                                         .found = "a prediction from a window that is predicted",
                                         .expected = "one from windows that stand for themselves (damaged)"});
    }
    const std::vector<double> vectors = plain_part(r);
    for (std::size_t k = 0; k < dimensions; ++k) {
      std::copy_n(vectors.begin() + static_cast<std::ptrdiff_t>(k) * window.points + (from - window.first), to - from,
                  reference.begin() + static_cast<std::ptrdiff_t>(k) * count + (from - first));
    }
  }
  const WindowPlace& own = layout_.plain.windows[w];
  std::vector<double> out(dimensions * static_cast<std::size_t>(own.points));
  const double rate = clips_.clips[static_cast<std::size_t>(own.clip)].rate_hz;
  predict_window(prediction, own.points, prediction_span(rate), reference, first, count, out);
  return out;
}

std::vector<double> RepeatDecoder::window_vectors(std::size_t w) const {
  std::vector<double> out = plain_part(w);
  if (!tables_.predictions[w].used()) return out;
  const std::vector<double> prediction = predicted_vectors(w);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] += prediction[i];
  return out;
}

ClipSeams RepeatDecoder::seams(std::size_t clip) const {
  ClipSeams out;
  for (std::size_t w = layout_.plain.first_of_clip[clip] + 1; w < layout_.plain.first_of_clip[clip + 1]; ++w) {
    (tables_.jumps[w] ? out.breaks : out.seams).push_back(layout_.plain.windows[w].first);
  }
  return out;
}

Clip RepeatDecoder::decode_without_contacts(std::size_t clip) const {
  const ClipEntry& entry = clips_.clips[clip];
  const Skeleton& bones = clips_.skeletons[static_cast<std::size_t>(entry.skeleton)];
  Clip out = make_clip(entry.name, bones, entry.rate_hz, entry.frames);
  out.require_translation_track(bones.travel_root());
  for (const SideTrack& track : entry.side_tracks) apply_side_track(track, 0, out);
  PoseWriter writer(tables_.tables.reference, entry.placement, out);

  const auto dimensions = static_cast<std::size_t>(tables_.tables.reference.dimensions());
  const std::size_t end = layout_.plain.first_of_clip[clip + 1];
  NearWindows near(layout_.plain.windows);
  const auto [inner, jumps] = seams(clip);
  SeamSmoother smoother(
      static_cast<int>(dimensions), entry.frames, inner, seam_smoothing_s * entry.rate_hz,
      [&](int frame, std::span<double> values) { near.get(frame, values); }, jumps);
  std::vector<double> values(dimensions);
  for (std::size_t w = layout_.plain.first_of_clip[clip]; w < end; ++w) {
    for (std::size_t ahead = near.end(w); ahead < std::min(w + 2, end); ++ahead) near.add(ahead, window_vectors(ahead));
    const WindowPlace& window = layout_.plain.windows[w];
    for (int f = window.first; f < window.first + window.points; ++f) {
      if (!smoother.touches(f)) continue;
      near.get(f, values);
      smoother.apply(f, values);
      near.set(f, values);
    }
    writer.write(near.vectors(w), window.first, window.points);
  }
  return out;
}

Clip RepeatDecoder::decode(std::size_t clip) const {
  Clip out = decode_without_contacts(clip);
  hold_contacts(out, contact_tracks(tables_.contacts[clip], out), contact_blending_s);
  const ClipSeams at = seams(clip);
  ease_seams(out, at.seams, tables_.seam_limit_cm_s, at.breaks);
  return out;
}

}  // namespace kinespace
