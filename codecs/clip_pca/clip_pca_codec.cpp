#include "kinespace/codecs/clip_pca/clip_pca_codec.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/QR>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/codecs/clip_pca/detail/clip_clusters.h"
#include "kinespace/codecs/clip_pca/detail/clip_pca_stream.h"
#include "kinespace/codecs/rma/contact_ik.h"
#include "kinespace/codecs/rma/marker_clips.h"
#include "kinespace/codecs/rma/marker_decoder.h"
#include "kinespace/codecs/rma/marker_encoder.h"
#include "kinespace/codecs/stream/clip_error.h"
#include "kinespace/codecs/stream/clip_reader.h"
#include "kinespace/codecs/stream/codec.h"
#include "kinespace/codecs/stream/target_search.h"

namespace kinespace {
namespace {

constexpr std::array clip_pca_settings{
    CodecSetting{"variance", 95, 30, 100, "percent of variance that the axes keep, where no target is given"},
    CodecSetting::flag("contacts", true, "joints on the ground are kept apart and put there by inverse kinematics"),
};

class ClipPcaEncoder {
 public:
  ClipPcaEncoder(std::span<const Clip> clips, double variance, double root_cm, bool contacts, const Progress& progress)
      : clips_(clips),
        progress_(progress),
        aligned_(align_clips(clips)),
        table_(marker_clip_table(clips, aligned_)),
        packed_clips_(pack_clip_table(table_)) {
    const double rate = aligned_.rate_hz;
    const double seconds = rate >= 60 ? 0.2 : 0.533;
    length_ = static_cast<int>(std::clamp(std::round(seconds * rate), 4.0, 512.0));
    root_span_ = static_cast<int>(std::clamp(std::round(0.2 * rate), 6.0, 512.0));
    roots_ = fit_roots(aligned_, root_cm, root_span_);
    fit_curves();
    progress_.check_stop();
    spaces_ = cluster_spaces(rows_, variance / 100, 32);
    progress_.check_stop();
    contacts_.resize(clips_.size());
    if (!contacts) return;
    parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) { contacts_[c] = find_contacts(clips_[c]); });
  }

  // The share of variance that leaves the markers so many cm off, as root mean square.
  [[nodiscard]] double share_for(double left_cm) const {
    double total = 0;
    for (const ClusterSpace& space : spaces_) {
      total += space.total_variance * static_cast<double>(space.members.size()) / static_cast<double>(rows_.rows());
    }
    // Control points move further than the curve between them: half of their square is left on it.
    const double left = left_cm * left_cm * static_cast<double>(rows_.cols()) / 3 * 2;
    return std::clamp(1 - left / std::max(total, 1e-12), 0.3, 1 - 1e-12);
  }

  [[nodiscard]] CodedAttempt attempt(double share) const {
    ClipPcaStream stream{.length = length_,
                         .root_span = root_span_,
                         .reference = aligned_.reference,
                         .groups = {},
                         .pieces = {},
                         .roots = roots_,
                         .contacts = {}};
    stream.pieces.resize(static_cast<std::size_t>(rows_.rows()));
    stream.contacts.resize(clips_.size());
    for (const ClusterSpace& space : spaces_) add_group(space, share, stream);
    const ClipPcaDecoder decoder(table_, stream);
    std::vector<ClipErrorSums> parts(clips_.size());
    parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
      progress_.check_stop();
      Clip decoded = decoder.decode_without_contacts(c);
      stream.contacts[c] = code_contacts(contacts_[c], decoded);
      hold_contacts(decoded, contact_tracks(stream.contacts[c], decoded));
      parts[c] = clip_error(clips_[c], decoded, 0, clips_[c].frames, 0);
    });
    ClipErrorSums sums;
    for (const ClipErrorSums& part : parts) sums.add(part);
    const Bytes motion = pack_clip_pca(stream);
    BitstreamWriter out(stream_kind("clip-pca"));
    out.set_error(sums.measured());
    out.add_section("clips", packed_clips_);
    out.add_section("motion", motion);
    add_padding(out, packed_clips_.size() + motion.size(), table_.frames(), numbers_in(stream));
    return {out.finish(), sums.measured()};
  }

 private:
  // The control points of all clips of one length, a row each; the last of an input clip goes on with its last posture.
  void fit_curves() {
    const MarkerRig& rig = aligned_.rigs.front();
    const Eigen::Index coordinates = rig.dimensions() + 3 * rig.joint_count();
    Eigen::MatrixXd bezier(length_, 4);
    for (int f = 0; f < length_; ++f) {
      const auto weight = bernstein(f, length_);
      for (int k = 0; k < 4; ++k) bezier(f, k) = weight[static_cast<std::size_t>(k)];
    }
    const Eigen::MatrixXd fit = bezier.completeOrthogonalDecomposition().pseudoInverse();
    std::vector<Eigen::Index> first;
    Eigen::Index pieces = 0;
    for (const Clip& clip : clips_) {
      first.push_back(pieces);
      pieces += (clip.frames - 1) / length_ + 1;
    }
    rows_.resize(pieces, 4 * coordinates);
    parallel_for(std::size_t{0}, clips_.size(), [&](std::size_t c) {
      const int frames = clips_[c].frames;
      std::vector<double> markers(static_cast<std::size_t>(coordinates) * static_cast<std::size_t>(frames));
      clip_markers(aligned_, c, MarkerDecoder::alignment(roots_[c], root_span_), 0, clips_[c].frames, markers.data(),
                   true);
      Eigen::MatrixXd piece(length_, coordinates);
      for (int p = 0; p * length_ < frames; ++p) {
        for (int f = 0; f < length_; ++f) {
          const int at = std::min(p * length_ + f, frames - 1);
          piece.row(f) = Eigen::Map<const Eigen::RowVectorXd>(markers.data() + at * coordinates, coordinates);
        }
        const Eigen::MatrixXd points = fit * piece;
        for (int k = 0; k < 4; ++k) {
          rows_.row(first[c] + p).segment(k * coordinates, coordinates) = points.row(k).cast<float>();
        }
      }
    });
  }

  void add_group(const ClusterSpace& space, double share, ClipPcaStream& stream) const {
    ClipPcaGroup group;
    for (const double m : space.mean) {
      group.mean.push_back(static_cast<std::int32_t>(std::lround(m / ClipPcaGroup::mean_step_cm)));
    }
    const int axes = space.axes_for(share);
    for (int a = 0; a < axes; ++a) {
      for (Eigen::Index k = 0; k < space.axes.rows(); ++k) {
        group.axes.push_back(static_cast<std::int16_t>(std::lround(space.axes(k, a) * ClipPcaGroup::axis_steps)));
      }
    }
    Eigen::MatrixXd h(static_cast<Eigen::Index>(space.members.size()), axes);
    parallel_for(std::size_t{0}, space.members.size(), [&](std::size_t i) {
      const Eigen::VectorXd off = rows_.row(space.members[i]).cast<double>().transpose() - space.mean;
      h.row(static_cast<Eigen::Index>(i)) = (space.axes.leftCols(axes).transpose() * off).transpose();
    });
    const auto number = static_cast<int>(stream.groups.size());
    for (int a = 0; a < axes; ++a) {
      group.range.push_back(AxisSteps::range_code(std::max(2 * h.col(a).cwiseAbs().maxCoeff(), 1e-4)));
    }
    for (std::size_t i = 0; i < space.members.size(); ++i) {
      ClipPcaPiece& piece = stream.pieces[static_cast<std::size_t>(space.members[i])];
      piece.group = number;
      for (int a = 0; a < axes; ++a) {
        const double steps = h(static_cast<Eigen::Index>(i), a) / group.step_cm(static_cast<std::size_t>(a));
        piece.coefficients.push_back(static_cast<std::int32_t>(std::lround(steps)));
      }
    }
    stream.groups.push_back(std::move(group));
  }

  std::span<const Clip> clips_;
  const Progress& progress_;
  AlignedClips aligned_;
  ClipTable table_;
  Bytes packed_clips_;
  int length_ = 24;
  int root_span_ = 24;
  std::vector<RootCode> roots_;
  Eigen::MatrixXf rows_;
  std::vector<ClusterSpace> spaces_;
  std::vector<std::vector<ContactTrack>> contacts_;
};

class ClipPcaReader final : public ClipReader {
 public:
  explicit ClipPcaReader(Bitstream bits)
      : ClipReader(std::move(bits)),
        motion_(unpack_clip_pca(stream().section("motion"), table(), coordinates(table()),
                                most_numbers(stream().size()), stream().source())),
        decoder_(table(), motion_) {}

 private:
  // Of a frame: those of its markers, and three a rotating joint.
  static int coordinates(const ClipTable& table) {
    const int markers = marker_dimensions(table);
    return markers + (markers - 3) / 2;
  }
  // Contacts reach over the whole clip.
  [[nodiscard]] Clip part(std::size_t clip, int first, int count, int) const override {
    return cut(decoder_.decode(clip), first, count);
  }

  ClipPcaStream motion_;
  ClipPcaDecoder decoder_;
};

}  // namespace

std::span<const CodecSetting> ClipPcaCodec::settings() const {
  return clip_pca_settings;
}

Bytes ClipPcaCodec::encode(std::span<const Clip> clips, const CodecOptions& options) const {
  double expected = 2;
  if (options.target.mean_error_cm) expected = *options.target.mean_error_cm;
  if (options.target.max_error_cm) expected = *options.target.max_error_cm / 8;
  const double variance = setting(options, "variance");
  const ClipPcaEncoder encoder(clips, variance, std::min(2.0, 0.35 * expected), flag(options, "contacts"),
                               options.progress);
  if (!options.target.any()) return encoder.attempt(variance / 100).stream;
  return search_target(options.target, {.start = expected},
                       [&](double coarseness) { return encoder.attempt(encoder.share_for(0.75 * coarseness)); });
}

std::unique_ptr<StreamReader> ClipPcaCodec::open(Bitstream stream) const {
  stream.require_kind(stream_kind(name()));
  return std::make_unique<ClipPcaReader>(std::move(stream));
}

}  // namespace kinespace
