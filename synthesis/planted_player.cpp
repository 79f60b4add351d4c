#include "kinespace/synthesis/planted_player.h"

#include <algorithm>
#include <array>
#include <utility>

#include "kinespace/synthesis/detail/leg_chain.h"

namespace kinespace {

struct PlantedPlayer::Legs {
  FootPlanter planter;
  std::array<LegChain, 2> chains;
  std::vector<FootPlanter::Ends> ends;  // by level

  Legs(const Player& player, const EncodedClip& clip, const Skeleton& skeleton)
      : planter(*clip.feet, clip.placement, clip.rate_hz),
        chains{LegChain(skeleton, clip.feet->legs[0]), LegChain(skeleton, clip.feet->legs[1])} {
    const int levels = std::min(planted_below, player.functions() + 1);
    for (int level = 0; level < levels; ++level) ends.push_back(ends_at(player, clip.rate_hz, level));
  }

 private:
  [[nodiscard]] FootPlanter::Ends ends_at(const Player& player, double rate_hz, int level) const {
    FootPlanter::Ends out;
    std::vector<float> rotations(4 * static_cast<std::size_t>(player.joints()));
    for (int i = 0; i < planter.contact_count(); ++i) {
      const KeptContact& c = planter.contact(i);
      for (const int frame : {c.first_frame(), c.last_frame()}) {
        const Eigen::Vector3f root = player.pose(frame / rate_hz, level, rotations);
        const LegState state = chains[static_cast<std::size_t>(c.slot / 2)].state(root, rotations);
        const Eigen::Vector3d& at = c.slot % 2 == 0 ? state.ankle.position : state.toe;
        out.emplace_back((planter.place(i, frame) - at).cast<float>());
      }
    }
    return out;
  }
};

PlantedPlayer::PlantedPlayer(Player player, const EncodedClip& clip, const Skeleton& skeleton)
    : player_(std::move(player)) {
  if (!clip.feet) return;
  auto legs = std::make_shared<const Legs>(player_, clip, skeleton);
  if (legs->chains[0].turns() && legs->chains[1].turns()) legs_ = std::move(legs);
}

Eigen::Vector3f PlantedPlayer::pose(double time_s, int functions, std::span<float> rotations) const {
  const Eigen::Vector3f root = player_.pose(time_s, functions, rotations);
  const int level = functions < 0 ? player_.functions() : std::min(functions, player_.functions());
  if (!legs_ || level >= static_cast<int>(legs_->ends.size())) return root;
  const double frame = player_.frame_at(time_s);
  const FootPlanter::Ends& ends = legs_->ends[static_cast<std::size_t>(level)];
  for (int side = 0; side < 2; ++side) {
    const LegChain& chain = legs_->chains[static_cast<std::size_t>(side)];
    const auto turned = legs_->planter.plant(side, frame, chain.state(root, rotations), ends);
    if (turned) chain.put(*turned, rotations);
  }
  return root;
}

}  // namespace kinespace
