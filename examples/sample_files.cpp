#include "examples/sample_files.h"

#include <nlohmann/json.hpp>

#include "kinespace/base/file.h"
#include "kinespace/motion/read.h"

namespace kinespace {

std::string describe_sample(const SampleMotion& motion) {
  const Clip& clip = motion.clip;
  nlohmann::ordered_json out = {{"clip", clip.name},       {"file", clip.name + ".bvh"},
                                {"frames", clip.frames},   {"rate_hz", clip.rate_hz},
                                {"labels", motion.labels}, {"contacts", nlohmann::ordered_json::array()}};
  for (const Contact& contact : motion.contacts) {
    out["contacts"].push_back({{"side", to_string(contact.side)},
                               {"joint", clip.skeleton.joints[static_cast<std::size_t>(contact.joint)].name},
                               {"first_frame", contact.first_frame},
                               {"last_frame", contact.last_frame}});
  }
  return out.dump(1) + "\n";
}

void write_sample(const std::filesystem::path& folder, const SampleMotion& motion) {
  write_clip(folder / (motion.clip.name + ".bvh"), motion.clip);
  write_file_atomically(folder / (motion.clip.name + ".json"), describe_sample(motion));
}

}  // namespace kinespace
