#include "codecs/mesh/moving_part.h"

#include <algorithm>
#include <cmath>

#include "motion/simd.h"
#include "storage/varint.h"

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

// How many of the columns are worth coding.
int columns_above(const Eigen::MatrixXd& weights, double least) {
  Eigen::Index count = weights.cols();
  while (count > 0 && weights.col(count - 1).cwiseAbs().maxCoeff() < least) --count;
  return static_cast<int>(count);
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
  const Eigen::MatrixXd gram = table.transpose() * table;
  energy_ = gram.trace();
  components_ = principal_components(gram);
}

CodedPart PartCoder::code(const PartOptions& options) const {
  const auto frames = static_cast<int>(table_.cols());
  CodedPart out;
  Bytes basis;
  if (options.transform == FrameTransform::cosines) {
    out.part.functions = cosine_basis(frames);
  } else {
    const Eigen::MatrixXd weights = table_ * components_.functions;
    const int kept = columns_above(weights, least_weight * options.step);
    std::vector<double> sizes(static_cast<std::size_t>(kept));
    for (int r = 0; r < kept; ++r) sizes[static_cast<std::size_t>(r)] = components_.sizes[r] / options.step;
    auto coded = encode_frame_basis(components_.functions.leftCols(kept), sizes, options.coarseness);
    basis = std::move(coded.bytes);
    out.part.functions = std::move(coded.functions);
  }
  const Eigen::MatrixXd weights = table_ * out.part.functions;
  const int kept = options.transform == FrameTransform::cosines ? columns_above(weights, least_weight * options.step)
                                                                : static_cast<int>(weights.cols());
  out.part.functions.conservativeResize(Eigen::NoChange, kept);
  NodeValues wanted{.components = kept, .value = {}};
  wanted.value.resize(static_cast<std::size_t>(weights.rows()) * static_cast<std::size_t>(kept));
  for (std::size_t i = 0; i < wanted.value.size(); ++i) wanted.value[i] = weights.data()[i] / options.step;
  const CodedNodes coded = encode_nodes(wanted, graph_, options.rate_weight);
  out.squared_error =
      energy_ - weights.leftCols(kept).squaredNorm() + options.step * options.step * coded.squared_error;
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
