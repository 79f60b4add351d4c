// Splines, bits, contacts, inverse kinematics and seams: each part's defining property.
#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/rma/contact_ik.h"
#include "kinespace/codecs/rma/detail/spline_fit.h"
#include "kinespace/codecs/rma/detail/window_prediction.h"
#include "kinespace/codecs/rma/seams.h"
#include "kinespace/entropy/adaptive_bits.h"
#include "kinespace/entropy/integer_coder.h"
#include "tests/codecs/sample_stream.h"

namespace kinespace {
namespace {

std::vector<double> part_curve(int frames) {
  std::vector<double> out;
  for (int f = 0; f < frames; ++f) out.push_back(10 * std::sin(0.05 * f) + (f > 60 && f < 66 ? 5 : 0) + 0.2 * f);
  return out;
}

TEST(RmaSplines, regular_knots_hold_both_ends_and_are_never_further_apart_than_the_span) {
  for (const int frames : {1, 2, 3, 7, 8, 9, 10, 100, 513}) {
    for (const int span : {1, 2, 8, 512}) {
      const std::vector<int> knots = regular_knots(frames, span);
      ASSERT_EQ(knots.front(), 0);
      ASSERT_EQ(knots.back(), frames - 1);
      for (std::size_t i = 1; i < knots.size(); ++i) {
        ASSERT_GT(knots[i], knots[i - 1]);
        ASSERT_LE(knots[i] - knots[i - 1], span);
      }
    }
  }
}

TEST(RmaSplines, the_curve_passes_through_its_control_points_and_straight_lines_stay_straight) {
  const std::vector<int> knots{0, 3, 4, 11, 20};
  std::vector<double> out(21);
  evaluate_spline(knots, std::vector<double>{1, -2, 5, 0, 3}, out);
  EXPECT_EQ(out[0], 1);
  EXPECT_EQ(out[3], -2);
  EXPECT_EQ(out[4], 5);
  EXPECT_EQ(out[11], 0);
  EXPECT_EQ(out[20], 3);
  evaluate_spline(knots, std::vector<double>{0, 6, 8, 22, 40}, out);
  for (int f = 0; f <= 20; ++f) EXPECT_NEAR(out[static_cast<std::size_t>(f)], 2 * f, 1e-12);
}

TEST(RmaSplines, added_control_points_bring_the_curve_within_the_tolerance) {
  const std::vector<double> curve = part_curve(150);
  const std::vector<int> start = regular_knots(150, 16);
  std::size_t last = start.size();
  for (const double tolerance : {5.0, 1.0, 0.1, 0.0}) {
    const std::vector<int> knots = fit_knots(curve, start, tolerance);
    EXPECT_GE(knots.size(), last);
    last = knots.size();
    std::vector<double> values, shown(curve.size());
    for (const int k : knots) values.push_back(curve[static_cast<std::size_t>(k)]);
    evaluate_spline(knots, values, shown);
    for (std::size_t f = 0; f < curve.size(); ++f) ASSERT_LE(std::abs(shown[f] - curve[f]), tolerance + 1e-12) << f;
  }
  EXPECT_EQ(fit_knots(curve, start, 1e9), start);
}

TEST(RmaBits, equation_8_expects_no_more_error_than_asked_and_one_bit_less_would) {
  for (const double range : {0.5, 3.0, 40.0, 300.0}) {
    for (const double error : {0.01, 0.5, 0.6}) {
      const int bits = adaptive_bits(range, error);
      EXPECT_LE(range / std::exp2(bits) / 4, error * (1 + 1e-12)) << range << " " << error;
      if (bits > 0) {
        EXPECT_GT(range / std::exp2(bits - 1) / 4, error * (1 - 1e-12)) << range << " " << error;
      }
    }
  }
  // The paper's example: 300 cm to 0.5 cm takes 8 bits.
  EXPECT_EQ(adaptive_bits(300, 0.5), 8);
}

TEST(RmaBits, equation_7_is_off_by_half_a_step_at_most) {
  const UniformQuantiser quantiser{.least = -3, .step = 0.7};
  for (double v = -3; v < 50; v += 0.0931) {
    EXPECT_GE(quantiser.quantise(v), 0);
    EXPECT_LE(std::abs(quantiser.value(quantiser.quantise(v)) - v), 0.35 + 1e-12);
  }
}

TEST(RmaValues, numbers_come_back_and_bytes_that_end_early_are_noticed) {
  const std::vector<std::int64_t> values{0, 1, -1, 5, -77, 1 << 20, -(std::int64_t{1} << 37), 0, 0, 3};
  ValueWriter out(3);
  for (std::size_t i = 0; i < values.size(); ++i) out.put(values[i], static_cast<int>(i % 3));
  const Bytes bytes = std::move(out).finish();
  ValueReader in(bytes, 3, "s");
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(in.get(static_cast<int>(i % 3)), values[i]);
  EXPECT_NO_THROW(in.expect_end());
  ValueReader longer(bytes, 3, "s");
  EXPECT_THROW(longer.expect_end(), Error);
}

// The first sample with planted feet.
const Clip& walking() {
  for (const Clip& clip : test::sample_clips()) {
    if (clip.name.find("walk") != std::string::npos) return clip;
  }
  return test::sample_clips().front();
}

TEST(RmaContacts, feet_of_a_walk_are_found_and_contacts_come_back_from_their_code) {
  const Clip& clip = walking();
  const std::vector<ContactTrack> tracks = find_contacts(clip);
  ASSERT_GT(tracks.size(), 2U);
  const std::vector<ContactCode> codes = code_contacts(tracks, clip);
  ASSERT_EQ(codes.size(), tracks.size());
  ValueWriter out(contact_contexts);
  put_contacts(out, codes);
  const Bytes bytes = std::move(out).finish();
  ValueReader in(bytes, contact_contexts, "s");
  std::int64_t numbers = 1 << 20;
  const std::vector<ContactCode> back = get_contacts(in, clip.frames, clip.skeleton.joint_count(), numbers);
  in.expect_end();
  ASSERT_EQ(back.size(), codes.size());
  for (std::size_t i = 0; i < codes.size(); ++i) {
    EXPECT_EQ(back[i].joint, codes[i].joint);
    EXPECT_EQ(back[i].first, codes[i].first);
    EXPECT_EQ(back[i].start, codes[i].start);
    EXPECT_EQ(back[i].moves, codes[i].moves);
  }
}

TEST(RmaContacts, decoded_contacts_keep_within_two_steps_of_where_the_joint_was) {
  const Clip& clip = walking();
  const std::vector<ContactTrack> tracks = find_contacts(clip);
  const std::vector<ContactTrack> back = contact_tracks(code_contacts(tracks, clip), clip);
  ASSERT_EQ(back.size(), tracks.size());
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    for (std::size_t i = 0; i < tracks[t].points.size(); ++i) {
      EXPECT_LT((back[t].points[i] - tracks[t].points[i]).norm(), 2) << t << " " << i;
    }
  }
}

TEST(RmaContacts, inverse_kinematics_brings_touching_joints_back_and_moves_nothing_far_from_a_contact) {
  const Clip& clip = walking();
  const std::vector<ContactTrack> tracks = find_contacts(clip);
  // Legs that were bent a little at every joint.
  Clip moved = clip;
  const int root = clip.skeleton.travel_root();
  for (int j = root + 1; j < clip.skeleton.joint_count(); ++j) {
    if (!clip.skeleton.joints[static_cast<std::size_t>(j)].has_rotation()) continue;
    for (int f = 0; f < clip.frames; ++f) {
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.03 * std::sin(j + 0.02 * f), Eigen::Vector3d::UnitX()));
      moved.set_rotation(j, f, clip.rotation(j, f) * turn);
    }
  }
  const Clip before = moved;
  hold_contacts(moved, tracks);
  double off_before = 0, off_after = 0;
  for (const ContactTrack& track : tracks) {
    const int count = static_cast<int>(track.points.size());
    const auto was = joint_path(before, track.joint, track.first, count);
    const auto is = joint_path(moved, track.joint, track.first, count);
    for (std::size_t i = 0; i < is.size(); ++i) {
      off_before += (was[i] - track.points[i]).norm();
      off_after += (is[i] - track.points[i]).norm();
    }
  }
  EXPECT_LT(off_after, 0.15 * off_before);
  const int blending = static_cast<int>(std::ceil(0.03 * clip.rate_hz));
  for (int f = 0; f < clip.frames; ++f) {
    const bool near = std::ranges::any_of(tracks, [&](const ContactTrack& t) {
      return f >= t.first - blending && f < t.first + static_cast<int>(t.points.size()) + blending;
    });
    if (near) continue;
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
      EXPECT_EQ(moved.rotation(j, f).coeffs(), before.rotation(j, f).coeffs()) << f;
    }
  }
}

TEST(RmaContacts, options_out_of_range_are_named) {
  try {
    static_cast<void>(find_contacts(walking(), {.move_cm = -1}));
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("move_cm"), std::string::npos);
  }
}

TEST(RmaSeams, a_step_and_a_kink_become_smooth_and_nothing_else_changes) {
  constexpr int frames = 60;
  constexpr int seam = 30;
  const auto raw = [](int frame, std::span<double> out) {
    out[0] = frame < seam ? 0.1 * frame : 8 - 0.3 * frame;
    out[1] = 2;
  };
  SeamSmoother smoother(2, frames, std::vector<int>{seam}, 12, raw);
  std::vector<double> shown;
  for (int f = 0; f < frames; ++f) {
    std::array<double, 2> v{};
    raw(f, v);
    const double before = v[0];
    const bool touched = smoother.touches(f);
    smoother.apply(f, v);
    EXPECT_EQ(v[1], 2);
    if (std::abs(f - seam + 0.5) >= 12) {
      EXPECT_EQ(v[0], before);
      EXPECT_FALSE(touched);
    }
    shown.push_back(v[0]);
  }
  double largest = 0;
  for (int f = 1; f + 1 < frames; ++f) {
    const auto at = static_cast<std::size_t>(f);
    largest = std::max(largest, std::abs(shown[at + 1] - 2 * shown[at] + shown[at - 1]));
  }
  EXPECT_LT(largest, 0.3);  // the step was 5, the kink 0.4
}

TEST(RmaSeams, nothing_is_carried_across_a_break) {
  const auto raw = [](int frame, std::span<double> out) { out[0] = frame < 20 ? 0 : frame < 24 ? 1 : 50; };
  SeamSmoother smoother(1, 60, std::vector<int>{20}, 12, raw, std::vector<int>{24});
  for (int f = 0; f < 60; ++f) {
    std::array<double, 1> v{};
    raw(f, v);
    const double before = v[0];
    smoother.apply(f, v);
    EXPECT_LT(std::abs(v[0] - before), 1);
    if (f >= 24) {
      EXPECT_EQ(v[0], before);
    }
  }
}

TEST(RmaPrediction, a_window_that_is_turned_and_elsewhere_is_predicted_but_for_its_place) {
  constexpr int points = 40;
  constexpr int steps = 9;
  const double angle = 2 * 3.14159265358979323846 * steps / WindowPrediction::turn_steps;
  std::vector<double> reference(6 * points), wanted(6 * points);
  for (std::size_t f = 0; f < points; ++f) {
    const double t = 0.1 * static_cast<double>(f);
    const std::array<double, 6> v{3 * t, 90 + std::sin(t), t * t, 0.2 * t, std::cos(t), t};
    const std::array<double, 6> w{100 + std::cos(angle) * v[0] + std::sin(angle) * v[2],
                                  v[1],
                                  7 + std::cos(angle) * v[2] - std::sin(angle) * v[0],
                                  v[3] + angle,
                                  v[4],
                                  v[5]};
    for (std::size_t k = 0; k < 6; ++k) {
      reference[k * points + f] = v[k];
      wanted[k * points + f] = w[k];
    }
  }
  const WindowPrediction prediction{.clip = 0, .turn = steps, .frames = {0, points - 1}};
  std::vector<double> out(6 * points);
  predict_window(prediction, points, points, reference, 0, points, out);
  for (std::size_t k = 0; k < 6; ++k) {
    const double place = wanted[k * points] - out[k * points];
    for (std::size_t f = 0; f < points; ++f) EXPECT_NEAR(wanted[k * points + f] - out[k * points + f], place, 1e-9);
    if (k == 1 || k > 3) {
      EXPECT_NEAR(place, 0, 1e-9) << k;
    }
  }
}

}  // namespace
}  // namespace kinespace
