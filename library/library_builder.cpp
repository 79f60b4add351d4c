#include "kinespace/library/library_builder.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>
#include <map>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/level_errors.h"
#include "kinespace/library/detail/space_codec.h"
#include "kinespace/library/library_view.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/joint_distance.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/plausibility.h"
#include "kinespace/motion/read.h"
#include "kinespace/storage/library_build.h"

namespace kinespace {
namespace {

constexpr int clips_per_block = 16;
constexpr int importer_version = 3;  // raise it when imports of the same file would come out otherwise

// Everything that an import depends on besides its file.
std::string fingerprint_of(const LibraryBuilderOptions& options) {
  const SequenceOptions& s = options.space.sequences;
  return fmt::format("importer {} sequences {} {} {} {} {} {} cycles {} {} {} {} {}", importer_version, s.shortest_s,
                     s.longest_s, s.length_weight, s.jerk_weight, s.break_cm, s.break_ratio, s.most_cycles,
                     s.cycles.shortest_s, s.cycles.longest_s, s.cycles.most_difference, s.equal_windows ? 1 : 0);
}

// One file on its way into the library.
struct Import {
  std::filesystem::path file;
  std::string animation;  // of a file with several; else empty
  std::size_t index = 0;  // which of them
  std::string name;
  std::string source_hash;  // of the file and, for AMC, its skeleton file
  std::string tree_hash;
  std::vector<Doubt> doubts;
  std::vector<std::string> notes;
  bool resumed = false;  // an earlier build had read it
};

// The clips of a file, which goes by that name.
void add_imports_of(const std::filesystem::path& file, const std::string& name, std::vector<Import>& imports) {
  const std::vector<std::string> clips = clips_of_file(file);
  for (std::size_t c = 0; c < clips.size(); ++c) {
    imports.push_back(
        {.file = file, .animation = clips[c], .index = c, .name = clips.size() > 1 ? name + "." + clips[c] : name});
  }
}

// All clips of the files. What cannot be listed goes to `bad`, where it is to be left out.
std::vector<Import> imports_of(const std::vector<std::filesystem::path>& files, bool leave_out_bad,
                               std::vector<BadFile>& bad) {
  const std::vector<std::string> names = clip_names(files);
  std::vector<Import> out;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (leave_out_bad) {
      static_cast<void>(read_or_list(bad, files[i], [&] { add_imports_of(files[i], names[i], out); }));
    } else {
      add_imports_of(files[i], names[i], out);
    }
  }
  return out;
}

// Part 0 is kept under the hash itself, and last: where it is, the others are.
std::string part_key(const std::string& source_hash, int part) {
  return part == 0 ? source_hash : fmt::format("{} part {}", source_hash, part);
}

// nullopt when there is none, or when a part of it is gone or damaged.
std::optional<PreparedClip> kept_import(const Import& import, const LibraryBuild& build) {
  return unpack_prepared([&](int part) { return build.find_import(part_key(import.source_hash, part)); },
                         import.file.string());
}

// True when an earlier build, or another clip of this one, has left what came of the same bytes.
bool take_kept(Import& import, const LibraryBuild& build) {
  const auto known = kept_import(import, build);
  if (!known) return false;
  import.tree_hash = known->skeleton.tree_hash();
  import.doubts = doubts_about(clip_from_curves(known->curves, known->skeleton));
  return true;
}

void keep(Import& import, Clip read, const LibraryBuilderOptions& options, LibraryBuild& build) {
  import.doubts = doubts_about(read);
  const PreparedClip clip = prepare(std::move(read), options.space.sequences);
  import.tree_hash = clip.skeleton.tree_hash();
  for (int part = prepared_parts(clip); part-- > 0;) {
    build.keep_import(part_key(import.source_hash, part), pack_prepared(clip, part));
  }
}

// Reads the clips of one file, but for those that are kept already.
void import_file(std::span<Import> imports, const LibraryBuilderOptions& options, LibraryBuild& build,
                 const std::set<std::string>& from_before) {
  std::vector<Import*> missing;
  for (Import& import : imports) {
    import.source_hash = source_hash_of(import.file, options.asf, import.animation);
    const bool kept = take_kept(import, build);
    import.resumed = kept && from_before.contains(import.source_hash);
    if (!kept) missing.push_back(&import);
  }
  if (missing.empty()) return;
  const bool one = missing.size() == 1;
  std::vector<std::string>& notes = imports.front().notes;
  std::vector<Clip> clips =
      read_clips(imports.front().file, {.companion = options.asf,
                                        .animation = one ? missing.front()->animation : std::string(),
                                        .note = [&](const std::string& what) { notes.push_back(what); }});
  for (Import* import : missing) keep(*import, std::move(clips.at(one ? 0 : import->index)), options, build);
}

// The clips of a file stand together.
std::vector<std::span<Import>> by_file(std::vector<Import>& imports) {
  std::vector<std::span<Import>> out;
  for (std::size_t start = 0; start < imports.size();) {
    std::size_t end = start + 1;
    while (end < imports.size() && imports[end].file == imports[start].file) ++end;
    out.push_back(std::span(imports).subspan(start, end - start));
    start = end;
  }
  return out;
}

// Leaves those in `imports` that could be read.
int import_files(std::vector<Import>& imports, const LibraryBuilderOptions& options, LibraryBuild& build,
                 const Progress& progress, std::vector<BadFile>& bad) {
  // Of an earlier build only: two files of one content in this one are no resuming.
  const std::vector<std::string> keys = build.import_keys();
  const std::set<std::string> from_before(keys.begin(), keys.end());
  const std::vector<std::span<Import>> files = by_file(imports);
  std::vector<std::vector<BadFile>> faults(files.size());
  const int count = static_cast<int>(files.size());
  for (int start = 0; start < count; start += clips_per_block) {
    progress.check_stop();
    progress.at("import", static_cast<double>(start) / count);
    const int in_block = std::min(clips_per_block, count - start);
    parallel_for(0, in_block, [&](int i) {
      const auto at = static_cast<std::size_t>(start + i);
      if (!options.leave_out_bad) return import_file(files[at], options, build, from_before);
      static_cast<void>(read_or_list(faults[at], files[at].front().file,
                                     [&] { import_file(files[at], options, build, from_before); }));
    });
  }
  progress.at("import", 1);
  std::set<std::filesystem::path> gone;
  for (const std::vector<BadFile>& fault : faults) {
    for (const BadFile& file : fault) {
      gone.insert(file.file);
      bad.push_back(file);
    }
  }
  std::erase_if(imports, [&](const Import& import) { return gone.contains(import.file); });
  return static_cast<int>(std::ranges::count(imports, true, &Import::resumed));
}

// A line a kind: the first clip that it is about, and how many others.
std::vector<std::string> doubts_of(const std::vector<Import>& imports) {
  std::vector<std::string> out;
  for (const DoubtKind kind : {DoubtKind::height, DoubtKind::axis, DoubtKind::floor}) {
    std::string line;
    int others = -1;
    for (const Import& import : imports) {
      const auto found = std::ranges::find(import.doubts, kind, &Doubt::kind);
      if (found == import.doubts.end()) continue;
      if (++others == 0) line = import.file.string() + ": " + found->text;
    }
    if (others > 0) line += fmt::format(" (and so with {} other{})", others, others == 1 ? "" : "s");
    if (!line.empty()) out.push_back(std::move(line));
  }
  return out;
}

PreparedSource source_of_imports(const std::vector<const Import*>& imports, const LibraryBuild& build) {
  return {static_cast<int>(imports.size()), [&imports, &build](int i) {
            const Import& import = *imports[static_cast<std::size_t>(i)];
            std::optional<PreparedClip> clip = kept_import(import, build);
            if (!clip) {
              throw Error(ErrorKind::machine, {.file = import.file.string(),
                                               .found = "its import is gone",
                                               .expected = "the partial library to stay",
                                               .remedy = "build again"});
            }
            clip->curves.name = import.name;
            return *std::move(clip);
          }};
}

void count_cycles(const EncodedClip& clip, LibraryReport& report) {
  for (const EncodedRun& run : clip.runs) {
    for (const EncodedSequence& s : run.sequences) {
      if (s.cycles == 0) continue;
      report.cycles += s.cycles;
      report.cyclic_seconds += (s.last - s.first) / clip.rate_hz;
    }
  }
}

// What a space does with the clips of one joint tree.
class SpaceWriter {
 public:
  SpaceWriter(Library& library, const BuiltSpace& built, const ClipSpace& clips, const std::string& tree_hash,
              const Compute& compute)
      : library_(library),
        built_(built),
        decoder_(built.space),
        clips_(clips),
        tree_hash_(tree_hash),
        compute_(compute) {
    space_id_ = library.put_space(
        {.name = sequence_space_name(tree_hash), .tree_hash = tree_hash, .blob = pack_space(built.space)});
    library.put_space({.name = clip_space_name(tree_hash), .tree_hash = tree_hash, .blob = clips.pack()});
  }
  [[nodiscard]] std::int64_t space_id() const { return space_id_; }

  void write(const std::vector<const Import*>& imports, const PreparedSource& source, LibraryReport& report,
             const Progress& progress) {
    for (int start = 0; start < source.count; start += clips_per_block) {
      progress.check_stop();
      progress.at("encode", static_cast<double>(start) / source.count);
      const int count = std::min(clips_per_block, source.count - start);
      const std::vector<Ready> ready = make(source, start, count);
      for (int i = 0; i < count; ++i)
        add(*imports[static_cast<std::size_t>(start + i)], ready[static_cast<std::size_t>(i)], report);
    }
    progress.at("encode", 1);
  }

 private:
  struct Ready {
    Skeleton skeleton;
    EncodedClip clip;
    std::vector<float> retrieval;
  };

  // Clips of ordinary length are encoded together, for a device to have many sequences at a time. A long one is enough by
  // itself, and would stay in memory meanwhile; and the processor gains nothing.
  [[nodiscard]] std::vector<Ready> make(const PreparedSource& source, int start, int count) const {
    constexpr int ordinary_frames = 4096;
    std::vector<Ready> out(static_cast<std::size_t>(count));
    std::vector<std::optional<PreparedClip>> held(out.size());
    parallel_for(0, count, [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      PreparedClip clip = source.load(start + i);
      built_.space.apply_references(clip.curves.values);
      clip.runs = built_.runs_of(start + i, clip.runs);
      if (compute_.choice() != "cpu" && clip.curves.frames() <= ordinary_frames) {
        held[at] = std::move(clip);
        return;
      }
      out[at].clip = encode(built_.space, clip.curves, clip.runs, warps_of(start + i), compute_);
      out[at].retrieval = clips_.vector_of(clip.curves, compute_);
      complete(std::move(clip), out[at]);
    });
    encode_together(start, held, out);
    parallel_for(std::size_t{0}, held.size(), [&](std::size_t at) {
      if (held[at]) complete(*std::move(held[at]), out[at]);
    });
    return out;
  }

  // Clips and retrieval vectors of those that are held.
  void encode_together(int start, const std::vector<std::optional<PreparedClip>>& held, std::vector<Ready>& out) const {
    std::vector<ClipToEncode> clips;
    std::vector<const ClipCurves*> curves;
    std::vector<std::size_t> places;
    for (std::size_t at = 0; at < held.size(); ++at) {
      if (!held[at]) continue;
      places.push_back(at);
      curves.push_back(&held[at]->curves);
      clips.push_back({&held[at]->curves, held[at]->runs, warps_of(start + static_cast<int>(at))});
    }
    if (clips.empty()) return;
    std::vector<EncodedClip> encoded = encode(built_.space, clips, compute_);
    std::vector<std::vector<float>> vectors = clips_.vectors_of(curves, compute_);
    for (std::size_t i = 0; i < places.size(); ++i) {
      out[places[i]].clip = std::move(encoded[i]);
      out[places[i]].retrieval = std::move(vectors[i]);
    }
  }

  [[nodiscard]] const std::vector<Warp>& warps_of(int index) const {
    return built_.warps[static_cast<std::size_t>(index)];
  }

  // Rounds what was encoded as it is stored, and measures how far it is from the clip.
  void complete(PreparedClip prepared, Ready& out) const {
    round_to_stored(out.clip, built_.space);
    measure_levels(decoder_, prepared.curves, prepared.skeleton, built_.space.levels(), out.clip);
    if (prepared.curves.frames() <= most_frames_with_feet) {
      out.clip.feet = keep_feet(clip_from_curves(prepared.curves, prepared.skeleton), prepared.curves.placement);
    }
    out.skeleton = std::move(prepared.skeleton);
  }

  void add(const Import& import, const Ready& ready, LibraryReport& report) {
    const std::int64_t skeleton_id = library_.add_skeleton(
        {.name = import.file.filename().string(), .tree_hash = tree_hash_, .blob = pack_skeleton(ready.skeleton)});
    const ClipRow row{.space_id = space_id_,
                      .skeleton_id = skeleton_id,
                      .name = import.name,
                      .source = import.file.string(),
                      .source_hash = import.source_hash,
                      .rate_hz = ready.clip.rate_hz,
                      .frames = ready.clip.frames,
                      .labels = labels_of(import.name)};
    store_clip(library_, row, ready.clip, built_.space, ready.retrieval, false);
    const double weight = static_cast<double>(row.frames);
    report.mean_joint_error_cm += weight * ready.clip.error.mean_joint_error_cm;
    report.max_joint_error_cm = std::max(report.max_joint_error_cm, ready.clip.error.max_joint_error_cm);
    report.sequences += ready.clip.sequence_count();
    count_cycles(ready.clip, report);
    report.frames += row.frames;
    ++report.added;
  }

  Library& library_;
  const BuiltSpace& built_;
  ClipDecoder decoder_;
  const ClipSpace& clips_;
  std::string tree_hash_;
  const Compute& compute_;
  std::int64_t space_id_ = 0;
};

// Puts the clips that are there already into the extended spaces.
void transfer_clips(Library& library, std::int64_t space_id, const RegisteredSpace& from, const RegisteredSpace& to,
                    const ClipSpace& clips_from, const ClipSpace& clips_to) {
  for (const ClipRow& row : library.clips()) {
    if (row.space_id != space_id) continue;
    const Skeleton skeleton = unpack_skeleton(library.skeleton(row.skeleton_id).blob, row.name);
    const PackedClip packed{library.clip_blob(row.id, ClipBlob::vectors), library.clip_blob(row.id, ClipBlob::warps),
                            library.clip_blob(row.id, ClipBlob::side)};
    EncodedClip clip =
        unpack_clip(packed, from, skeleton,
                    {.name = row.name, .rate_hz = row.rate_hz, .frames = static_cast<int>(row.frames)}, row.name);
    const JointPositions before = joint_positions(clip_from_curves(decode(from, clip), skeleton));
    for (EncodedRun& run : clip.runs) {
      for (EncodedSequence& s : run.sequences) {
        s.scores = to.of(s.cycles).transfer(s.scores, from.of(s.cycles));
        to.of(s.cycles).drop_needless(s.scores);
      }
    }
    round_to_stored(clip, to);
    // Its own curves are not there any more: errors of levels are not known any more, and with what the transfer moves
    // added, its error is never less than it is.
    JointDistance moved;
    moved.add(before, joint_positions(clip_from_curves(decode(to, clip), skeleton)));
    clip.error.mean_joint_error_cm += moved.mean();
    clip.error.max_joint_error_cm += moved.largest();
    clip.levels.clear();
    const std::vector<float> old_vector = library.retrieval_vector(row.id);
    if (old_vector.size() != clips_from.dimensions()) {
      throw Error(ErrorKind::bad_input, {.file = row.name,
                                         .found = fmt::format("a vector of {} numbers", old_vector.size()),
                                         .expected = fmt::format("{}", clips_from.dimensions())});
    }
    const Eigen::Map<const ScoreMatrix> old_scores(old_vector.data(), clips_from.space().functions(),
                                                   clips_from.space().curves());
    const ScoreMatrix scores = clips_to.space().transfer(old_scores, clips_from.space());
    store_clip(library, row, clip, to, {scores.data(), scores.data() + scores.size()}, true);
  }
}

void require_one_tree(const std::map<std::string, std::vector<const Import*>>& by_tree,
                      const LibraryBuilderOptions& options) {
  if (options.by_skeleton || by_tree.size() < 2) return;
  const Import& a = *by_tree.begin()->second.front();
  const Import& b = *std::next(by_tree.begin())->second.front();
  throw Error(ErrorKind::bad_input, {.file = b.file.string(),
                                     .found = "another joint tree than that of " + a.file.string(),
                                     .expected = "clips of one skeleton (bone lengths may differ)",
                                     .remedy = "build them apart, or give --by-skeleton for one space each"});
}

// A library that grows keeps what its functions were made with. Defaults stand for no choice.
void require_choices_of(const MotionSpaceOptions& kept, const MotionSpaceOptions& asked, const std::string& name) {
  const auto differs = [&](auto MotionSpaceOptions::*field) {
    return asked.*field != MotionSpaceOptions().*field && asked.*field != kept.*field;
  };
  const std::array<std::pair<const char*, bool>, 5> choices = {{
      {"grouping", differs(&MotionSpaceOptions::grouping)},
      {"points", differs(&MotionSpaceOptions::points)},
      {"variance", differs(&MotionSpaceOptions::variance_share)},
      {"functions", differs(&MotionSpaceOptions::functions)},
      {"smooth", differs(&MotionSpaceOptions::smooth)},
  }};
  for (const auto& [choice, other] : choices) {
    if (!other) continue;
    throw Error(ErrorKind::usage,
                {.file = name,
                 .found = fmt::format("another choice of \"{}\" than the library was made with", choice),
                 .expected = "its own, which it keeps when it is added to",
                 .remedy = "leave it out, or build the whole library anew"});
  }
}

// The spaces of one joint tree: new ones, or the library's own extended by the new clips.
void build_tree(const std::string& tree_hash, const std::vector<const Import*>& imports,
                const LibraryBuilderOptions& options, LibraryBuild& build, const Compute& compute,
                const Progress& progress, LibraryReport& report) {
  Library& library = build.library();
  const PreparedSource source = source_of_imports(imports, build);
  std::optional<SpaceRow> old_space, old_clips;
  for (const SpaceRow& row : library.spaces()) {
    if (row.name == sequence_space_name(tree_hash)) old_space = library.space(row.id);
    if (row.name == clip_space_name(tree_hash)) old_clips = library.space(row.id);
  }
  if (old_space && old_clips) {
    const std::string name = build.target().string();
    const RegisteredSpace from = unpack_registered_space(old_space->blob, name);
    require_choices_of(from.options(), options.space.space, name);
    const ClipSpace clips_from = ClipSpace::unpack(old_clips->blob, name);
    const BuiltSpace built = extend_space(from, source, options.space, compute, progress);
    const ClipSpace clips = clips_from.extend(source, compute, progress);
    SpaceWriter writer(library, built, clips, tree_hash, compute);
    transfer_clips(library, writer.space_id(), from, built.space, clips_from, clips);
    writer.write(imports, source, report, progress);
  } else {
    const BuiltSpace built = build_space(source, options.space, compute, progress);
    const ClipSpace clips = ClipSpace::build(source, built.space.references(), options.clips, compute, progress);
    SpaceWriter(library, built, clips, tree_hash, compute).write(imports, source, report, progress);
  }
}

// Files that are in the library already, with the same name and content, need nothing.
int drop_unchanged(std::vector<Import>& imports, const Library& library, const LibraryBuilderOptions& options) {
  const std::size_t before = imports.size();
  std::erase_if(imports, [&](const Import& import) {
    const auto row = library.find_clip(import.name);
    return row && row->source_hash == source_hash_of(import.file, options.asf, import.animation);
  });
  return static_cast<int>(before - imports.size());
}

void summarise(Library& library, LibraryReport& report) {
  const std::int64_t sequences = report.sequences + library.metadata_count("sequences").value_or(0);
  library.set_metadata("sequences", std::to_string(sequences));
  report.sequences = static_cast<int>(sequences);
  report.cycles += library.metadata_count("cycles").value_or(0);
  library.set_metadata("cycles", std::to_string(report.cycles));
  report.cyclic_seconds += library.metadata_number("cyclic_seconds").value_or(0);
  library.set_metadata("cyclic_seconds", fmt::format("{:.3f}", report.cyclic_seconds));
  report.seconds = library.totals().seconds;
  report.variance = 1;
  report.movement = 1;
  for (const SpaceRow& row : library.spaces()) {
    if (!row.name.starts_with("sequences ")) continue;
    const RegisteredSpace space = unpack_registered_space(library.space(row.id).blob, row.name);
    ++report.spaces;
    report.functions = std::max(report.functions, space.functions());
    report.all_functions += space.function_count();
    report.variance = std::min(report.variance, space.variance_covered());
    report.movement = std::min(report.movement, space.movement_covered());
    report.warped = report.warped || space.warped();
  }
  library.set_metadata("functions", std::to_string(report.functions));
  library.set_metadata("movement", fmt::format("{:.9f}", report.movement));
  library.set_metadata("variance", fmt::format("{:.9f}", report.variance));
  report.clips = static_cast<int>(library.totals().clips);
}

}  // namespace

std::vector<std::filesystem::path> find_motion_files(const std::vector<std::filesystem::path>& arguments) {
  std::set<std::filesystem::path> files;
  for (const auto& argument : arguments) {
    if (std::filesystem::is_directory(argument)) {
      for (const auto& entry : std::filesystem::recursive_directory_iterator(argument)) {
        if (entry.is_regular_file() && is_motion_file(entry.path())) files.insert(entry.path());
      }
    } else if (!std::filesystem::exists(argument)) {
      throw Error(ErrorKind::bad_input, {.file = argument.string(),
                                         .found = "no such file or folder",
                                         .expected = "a motion file or a folder of them",
                                         .remedy = "check the path"});
    } else if (is_motion_file(argument)) {
      files.insert(argument);
    } else {
      throw Error(ErrorKind::bad_input, {.file = argument.string(),
                                         .found = "not a motion file by its ending",
                                         .expected = listed(clip_endings_read()),
                                         .remedy = "name clips, or folders that hold them"});
    }
  }
  if (files.empty()) {
    throw Error(ErrorKind::bad_input, {.file = arguments.empty() ? "" : arguments.front().string(),
                                       .found = "no motion files",
                                       .expected = "at least one " + listed(clip_endings_read())});
  }
  return {files.begin(), files.end()};
}

std::vector<std::string> clip_names(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names(files.size());
  std::vector<std::filesystem::path> rest(files.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    names[i] = files[i].stem().string();
    rest[i] = files[i].parent_path();
  }
  for (bool clash = true; clash;) {
    std::map<std::string, int> uses;
    for (const std::string& name : names) ++uses[name];
    clash = false;
    for (std::size_t i = 0; i < files.size(); ++i) {
      const std::string folder = rest[i].filename().string();
      if (uses[names[i]] < 2 || folder.empty()) continue;
      names[i] = folder + "/" + names[i];
      rest[i] = rest[i].parent_path();
      clash = true;
    }
  }
  return names;
}

std::vector<std::string> labels_of(const std::string& name) {
  std::vector<std::string> out;
  const std::string stem = name.substr(name.rfind('/') + 1);
  for (std::size_t at = 0; at <= stem.size();) {
    const std::size_t end = std::min(stem.find('_', at), stem.size());
    const std::string part = stem.substr(at, end - at);
    const bool number = std::ranges::all_of(part, [](unsigned char c) { return std::isdigit(c) != 0; });
    if (!number) out.push_back(part);
    at = end + 1;
  }
  return out;
}

LibraryReport build_library(const std::vector<std::filesystem::path>& files, const std::filesystem::path& target,
                            const LibraryBuilderOptions& options, const Compute& compute, const Progress& progress) {
  options.space.validate();
  options.clips.validate();
  for (const auto& file : files) require_different_files(file, target);
  LibraryReport report;
  std::vector<Import> imports = imports_of(files, options.leave_out_bad, report.bad);
  LibraryBuild build(target, {.fingerprint = fingerprint_of(options), .extend = options.add});
  if (options.add) report.unchanged = drop_unchanged(imports, Library::open_read_only(target), options);
  report.resumed = import_files(imports, options, build, progress, report.bad);
  if (imports.empty() && report.unchanged == 0) require_no_bad_files(report.bad);
  report.doubts = doubts_of(imports);
  for (Import& import : imports) std::ranges::move(import.notes, std::back_inserter(report.notes));

  std::map<std::string, std::vector<const Import*>> by_tree;
  for (const Import& import : imports) by_tree[import.tree_hash].push_back(&import);
  require_one_tree(by_tree, options);
  for (const auto& [tree_hash, members] : by_tree)
    build_tree(tree_hash, members, options, build, compute, progress, report);
  if (report.frames > 0) report.mean_joint_error_cm /= static_cast<double>(report.frames);
  progress.at("store", 0);
  summarise(build.library(), report);
  build.finish();
  progress.at("store", 1);
  report.bytes = static_cast<std::int64_t>(std::filesystem::file_size(target));
  return report;
}

}  // namespace kinespace
