#include "bench/curve_errors.h"

#include <algorithm>
#include <cmath>

namespace kinespace {
namespace {

Eigen::Map<const Eigen::ArrayXd> array_of(const std::vector<double>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

}  // namespace

void CurveErrors::add(const CurveView& curves, const CurveView& decoded, const Eigen::VectorXd& weights) {
  const Eigen::VectorXd squares = (curves - decoded).cwiseAbs2() * weights;
  for (const double square : squares) values_.push_back(std::sqrt(square));
}

void CurveErrors::add(const CurveErrors& others) {
  values_.insert(values_.end(), others.values_.begin(), others.values_.end());
}

double CurveErrors::average() const {
  return values_.empty() ? 0 : array_of(values_).mean();
}

double CurveErrors::variance() const {
  return values_.empty() ? 0 : (array_of(values_) - average()).square().mean();
}

double CurveErrors::largest() const {
  return values_.empty() ? 0 : array_of(values_).maxCoeff();
}

double CurveErrors::percentile(double share) const {
  if (values_.empty()) return 0;
  const double rank = std::ceil(share * static_cast<double>(values_.size()));
  std::vector<double> sorted = values_;
  const auto at = sorted.begin() + std::max<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(rank) - 1, 0);
  std::ranges::nth_element(sorted, at);
  return *at;
}

double CurveErrors::root_mean_square() const {
  return values_.empty() ? 0 : std::sqrt(array_of(values_).square().mean());
}

}  // namespace kinespace
