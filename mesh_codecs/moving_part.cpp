#include "kinespace/mesh_codecs/moving_part.h"

#include <algorithm>
#include <cmath>

#include "kinespace/motion/simd.h"
#include "kinespace/storage/varint.h"

namespace kinespace {
namespace {

constexpr double least_weight = 0.55;  // steps; what stays below in a whole component is not coded

KINESPACE_VECTOR_CLONES
void add_multiple(double by, const float* row, double* out, std::ptrdiff_t count) {
  for (std::ptrdiff_t i = 0; i < count; ++i) out[i] += by * static_cast<double>(row[i]);
}

std::vector<float> in_units(const NodeValues& values, double step) {
  std::vector<float> out(values.value.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(values.value[i] * step);
  return out;
}

// The largest number of each column of table * functions, a few columns at a time: the product would take as much
// memory as the table.
Eigen::VectorXd peaks(const Eigen::MatrixXd& table, const Eigen::MatrixXd& functions) {
  constexpr Eigen::Index together = 32;
  Eigen::VectorXd out(functions.cols());
  for (Eigen::Index first = 0; first < functions.cols(); first += together) {
    const Eigen::Index count = std::min(together, functions.cols() - first);
    const Eigen::MatrixXd weights = table * functions.middleCols(first, count);
    out.segment(first, count) = weights.cwiseAbs().colwise().maxCoeff().transpose();
  }
  return out;
}

Bytes pack(FrameTransform transform, int components, const Bytes& basis, const Bytes& values) {
  ByteWriter out;
  out.put(static_cast<std::uint8_t>(transform));
  put_varint(out, static_cast<std::uint64_t>(components));
  put_varint(out, basis.size());
  out.put_bytes(basis);
  out.put_bytes(values);
  return std::move(out).take();
}

}  // namespace

void MovingPart::add(int frame, std::span<double> out) const {
  for (Eigen::Index r = 0; r < functions.cols(); ++r) {
    add_multiple(functions(frame, r), weights.data() + static_cast<std::size_t>(r) * out.size(), out.data(),
                 static_cast<std::ptrdiff_t>(out.size()));
  }
}

PartCoder::PartCoder(const Eigen::MatrixXd& table, const NodeGraph& graph) : table_(table), graph_(graph) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(table.cols(), table.cols());
  gram.selfadjointView<Eigen::Lower>().rankUpdate(table.transpose());
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  energy_ = gram.trace();
  components_ = principal_components(gram);
  component_peaks_ = peaks(table, components_.functions);
  cosine_peaks_ = peaks(table, cosine_basis(static_cast<int>(table.cols())));
}

int PartCoder::worth_coding(FrameTransform transform, double step) const {
  const Eigen::VectorXd& peaks = transform == FrameTransform::cosines ? cosine_peaks_ : component_peaks_;
  Eigen::Index count = peaks.size();
  while (count > 0 && peaks[count - 1] < least_weight * step) --count;
  return static_cast<int>(count);
}

CodedPart PartCoder::code(const PartOptions& options, const Eigen::MatrixXd& table, double energy) const {
  const int kept = worth_coding(options.transform, options.step);
  CodedPart out;
  Bytes basis;
  if (options.transform == FrameTransform::cosines) {
    out.part.functions = cosine_basis(static_cast<int>(table.cols())).leftCols(kept);
  } else {
    std::vector<double> sizes(static_cast<std::size_t>(kept));
    for (int r = 0; r < kept; ++r) sizes[static_cast<std::size_t>(r)] = components_.sizes[r] / options.step;
    auto coded = encode_frame_basis(components_.functions.leftCols(kept), sizes, options.coarseness);
    basis = std::move(coded.bytes);
    out.part.functions = std::move(coded.functions);
  }
  const Eigen::MatrixXd weights = table * out.part.functions;
  NodeValues wanted{.components = kept, .value = {}};
  wanted.value.resize(static_cast<std::size_t>(weights.size()));
  for (std::size_t i = 0; i < wanted.value.size(); ++i) wanted.value[i] = weights.data()[i] / options.step;
  const CodedNodes coded = encode_nodes(wanted, graph_, options.rate_weight);
  out.squared_error = energy - weights.squaredNorm() + options.step * options.step * coded.squared_error;
  out.part.nodes = graph_.nodes();
  out.part.weights = in_units(coded.decoded, options.step);
  out.bytes = pack(options.transform, kept, basis, coded.bytes);
  return out;
}

MovingPart decode_part(std::span<const std::byte> bytes, int frames, const NodeGraph& graph, double step,
                       std::int64_t most_numbers, const std::string& source) {
  ByteReader in(bytes, source);
  const auto transform = in.get<std::uint8_t>();
  const std::uint64_t components = get_varint(in);
  if (transform > 1 || components > static_cast<std::uint64_t>(frames) ||
      static_cast<std::int64_t>(components) * graph.nodes() * 3 > most_numbers) {
    in.fail("a part of " + std::to_string(components) + " components", "what the encoder writes (damaged)");
  }
  const std::size_t basis_bytes = get_count(in, 1, "bytes of components");
  const auto basis = in.take(basis_bytes);
  const auto kept = static_cast<int>(components);
  MovingPart out;
  out.nodes = graph.nodes();
  if (transform == static_cast<std::uint8_t>(FrameTransform::cosines)) {
    if (!basis.empty()) in.fail("components in a part of cosines", "none (damaged)");
    out.functions = cosine_basis(frames).leftCols(kept);
  } else {
    out.functions = decode_frame_basis(basis, frames, kept, source);
  }
  out.weights = in_units(decode_nodes(in.take(in.remaining()), kept, graph, source), step);
  return out;
}

}  // namespace kinespace
