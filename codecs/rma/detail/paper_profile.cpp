#include "kinespace/codecs/rma/detail/paper_profile.h"

#include <algorithm>

#include "kinespace/base/error.h"
#include "kinespace/codecs/rma/marker_decoder.h"
#include "kinespace/codecs/rma/marker_encoder.h"
#include "kinespace/codecs/stream/clip_reader.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/target_search.h"

namespace kinespace {
namespace {

// A coarseness is the mean joint error that may be expected, in cm.
MarkerSettings settings_at(const MarkerEncoder& encoder, double coarseness, const PaperSettings& given) {
  return {.variance = encoder.variance_for(0.75 * coarseness),
          .control_cm = 1.6 * coarseness,
          .primary_cm = std::min(0.5, 0.22 * coarseness),
          .repeated_cm = std::min(0.6, 0.26 * coarseness),
          .primary_bits = given.primary_bits,
          .repeated_bits = given.repeated_bits,
          .contacts = given.contacts};
}

class PaperReader final : public ClipReader {
 public:
  explicit PaperReader(Bitstream stream)
      : ClipReader(std::move(stream)),
        motion_(unpack_marker_stream(this->stream().section("motion"), table(), marker_dimensions(table()),
                                     most_numbers(this->stream().size()), this->stream().source())),
        decoder_(table(), motion_, this->stream().source()) {}

 private:
  // Contacts and seams reach over the whole clip.
  [[nodiscard]] Clip part(std::size_t clip, int first, int count, int) const override {
    return cut(decoder_.decode(clip), first, count);
  }

  MarkerStream motion_;
  MarkerDecoder decoder_;
};

}  // namespace

Bytes encode_paper_profile(std::span<const Clip> clips, const CodecTarget& target, const PaperSettings& settings,
                           const Progress& progress) {
  // What is expected of the error, for the alignment: it comes first and stays.
  double expected = 2;
  if (target.mean_error_cm) expected = *target.mean_error_cm;
  if (target.max_error_cm) expected = *target.max_error_cm / 8;
  const MarkerEncoder encoder(
      clips, {.repeats = settings.repeats, .contacts = settings.contacts, .root_cm = std::min(2.0, 0.35 * expected)},
      progress);
  const Bytes table = pack_clip_table(encoder.table());
  const auto attempt = [&](const MarkerSettings& at) {
    const MarkerAttempt made = encoder.attempt(at);
    BitstreamWriter out(stream_kind("rma"));
    out.set_option("profile", "paper");
    const MeasuredError error = made.error.measured();
    out.set_error(error);
    out.add_section("clips", table);
    out.add_section("motion", made.bytes);
    add_padding(out, table.size() + made.bytes.size(), encoder.table().frames(), numbers_in(made.stream));
    return CodedAttempt{out.finish(), error};
  };
  if (!target.any()) {
    MarkerSettings at = settings_at(encoder, expected, settings);
    at.variance = settings.variance;
    return attempt(at).stream;
  }
  return search_target(target, {.start = expected},
                       [&](double coarseness) { return attempt(settings_at(encoder, coarseness, settings)); });
}

std::unique_ptr<StreamReader> open_paper_profile(Bitstream stream) {
  return std::make_unique<PaperReader>(std::move(stream));
}

}  // namespace kinespace
