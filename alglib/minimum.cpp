#include "kinespace/alglib/minimum.h"

#include <algorithm>

#include <optimization.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

alglib::real_1d_array array_of(const BoxPoint& point) {
  alglib::real_1d_array out;
  out.setcontent(point.size(), point.data());
  return out;
}

BoxPoint point_of(const alglib::real_1d_array& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.getcontent(), values.length());
}

struct Counted {
  const BoxFunction& function;
  int evaluations = 0;
};

void evaluate_counted(const alglib::real_1d_array& x, double& value, alglib::real_1d_array& gradient, void* context) {
  auto& counted = *static_cast<Counted*>(context);
  ++counted.evaluations;
  BoxPoint slope(x.length());
  value = counted.function(point_of(x), slope);
  std::copy(slope.begin(), slope.end(), gradient.getcontent());  // its size may not change here
}

}  // namespace

BoxMinimum alglib_minimise_in_box(const BoxFunction& function, const BoxPoint& start, const BoxPoint& lower,
                                  const BoxPoint& upper, const BoxOptions& options) {
  require_box(start, lower, upper, options);
  // A box without width in a variable is as good as one of any width there.
  const BoxPoint width = (upper - lower).unaryExpr([](double w) { return w > 0 ? w : 1.0; });
  const BoxPoint first = start.cwiseMax(lower).cwiseMin(upper);
  Counted counted{function};
  // ALGLIB reports by its own exception, which must not leave this file.
  try {
    alglib::minbcstate state;
    alglib::minbcreport report;
    alglib::minbccreate(array_of(first), state);
    alglib::minbcsetbc(state, array_of(lower), array_of(upper));
    alglib::minbcsetscale(state, array_of(width));
    alglib::minbcsetprecscale(state);
    alglib::minbcsetcond(state, 0, 0, options.last_step, options.most_evaluations);
    alglib::minbcsetstpmax(state, 0);
    alglib::minbcoptimize(state, evaluate_counted, nullptr, &counted);
    alglib::real_1d_array found;
    alglib::minbcresults(state, found, report);
    BoxMinimum out{.at = point_of(found).cwiseMax(lower).cwiseMin(upper),
                   .evaluations = counted.evaluations,
                   .converged = report.terminationtype > 0 && report.terminationtype != 5};
    BoxPoint slope(out.at.size());
    out.value = function(out.at, slope);
    return out;
  } catch (const alglib::ap_error& error) {
    throw Error(ErrorKind::machine,
                {.found = "ALGLIB: " + error.msg, .expected = "a function that is finite in its box"});
  }
}

}  // namespace kinespace
