#include "bench/prepared_set.h"

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"

namespace kinespace {

PreparedSet load_prepared_set(const std::string& name, const std::vector<std::filesystem::path>& inputs,
                              const SequenceOptions& options) {
  for (const auto& input : inputs) {
    if (std::filesystem::exists(input)) continue;
    throw Error(ErrorKind::bad_input, {.file = input.string(),
                                       .found = "no such file or folder",
                                       .expected = "the clips of this bench",
                                       .remedy = "check the path, or name the folder that has the data with --data"});
  }
  const std::vector<std::filesystem::path> files = find_motion_files(inputs);
  PreparedSet out{name, std::vector<Clip>(files.size()), std::vector<PreparedClip>(files.size())};
  parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
    out.clips[i] = read_clip(files[i]);
    out.prepared[i] = prepare(out.clips[i], options);
  });
  return out;
}

PreparedSet cut_again(const PreparedSet& set, const SequenceOptions& options) {
  PreparedSet out{set.name, set.clips, std::vector<PreparedClip>(set.clips.size())};
  parallel_for(std::size_t{0}, set.clips.size(),
               [&](std::size_t i) { out.prepared[i] = prepare(set.clips[i], options); });
  return out;
}

std::vector<EncodedClip> encode_all(const PreparedSet& set, const BuiltSpace& built) {
  std::vector<EncodedClip> out(set.prepared.size());
  parallel_for(std::size_t{0}, out.size(), [&](std::size_t i) {
    ClipCurves curves = set.prepared[i].curves;
    built.space.apply_references(curves.values);
    out[i] = encode(built.space, curves, built.runs_of(static_cast<int>(i), set.prepared[i].runs), built.warps[i]);
  });
  return out;
}

}  // namespace kinespace
