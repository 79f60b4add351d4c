// How far the channels of a clip move its joints: the quadratic form M with
//
//   dx' M dx  ~  mean over joints of |dp|^2 + shell_weight / 3 * sum over k |d(p + 3 cm R e_k)|^2       (cm^2)
//
// to first order, on the average over some poses of the clip. What codecs/pose_space/position_metric.h is for pose vectors, for
// the channels of codecs/stream/joint_channels.h; by finite differences. Encoders use it; decoders never need it.
// Private to this folder.
#pragma once

#include <Eigen/Core>

#include "kinespace/codecs/stream/joint_channels.h"

namespace kinespace {

// Positions see no turns of hands and toes; this much of the shell error keeps those from being free.
inline constexpr double shell_weight = 0.1;

[[nodiscard]] Eigen::MatrixXd channel_metric(const Clip& clip, const ChannelLayout& layout,
                                             const ChannelCurves& curves);

}  // namespace kinespace
