#include <filesystem>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "cli/clip_input.h"
#include "cli/commands.h"
#include "cli/json_output.h"
#include "cli/output.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/printable.h"
#include "kinespace/footskate/contact_labels.h"
#include "kinespace/library/library_view.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {
namespace {

struct ContactsOptions {
  std::string clip;
  ClipChoice choice;  // where the clip is a file
  std::optional<std::filesystem::path> library;
  bool next = false;
  std::string label;
  std::string from = "-";
  std::string feet;
  bool json = false;
};

FeetNames feet_names(const ContactsOptions& options) {
  return options.feet.empty() ? FeetNames{} : FeetNames::parse(options.feet);
}

Json to_json(const FootContacts& contacts, const Clip& clip, const Feet& feet) {
  Json out = Json::array();
  const auto joints = feet.foot_joints();
  for (const FootContact& c : contacts) {
    out.push_back({{"joint", clip.skeleton.joints[joints[c.slot]].name},
                   {"first_frame", c.first_frame},
                   {"last_frame", c.last_frame}});
  }
  return out;
}

const ContactModel& or_standard(const std::optional<ContactModel>& model) {
  return model ? *model : ContactModel::standard();
}

Clip clip_named(const ContactsOptions& options, Session& session) {
  if (!options.library) return read_input(options.clip, options.choice, session);
  LibraryView library(*options.library);
  const bool there = std::filesystem::exists(options.clip);
  if (there && (is_motion_file(options.clip) || !library.library().find_clip(options.clip))) {
    return read_input(options.clip, options.choice, session);
  }
  return library.clip(library.require_clip(options.clip));
}

void run_detect(const ContactsOptions& options, Session& session) {
  const Clip clip = clip_named(options, session);
  const Feet feet = require_feet(clip, feet_names(options));
  std::optional<ContactModel> model;
  if (options.library) model = library_contact_model(Library::open_read_only(*options.library));
  const FootTracks tracks = foot_tracks(clip, feet);
  const Ground ground = estimate_ground(tracks);
  const FootContacts contacts = or_standard(model).detect(tracks, ground);
  if (!options.json) {
    print("{}", format_contacts(contacts, clip.skeleton, feet));
    return;
  }
  print_json({{"clip", clip.name},
              {"frames", clip.frames},
              {"rate_hz", clip.rate_hz},
              {"ground", to_string(ground.kind)},
              {"floor_cm", ground.height_cm},
              {"contacts", to_json(contacts, clip, feet)}});
}

// The clip without labels that holds the keyframe farthest from all labelled ones (yoo2019, section 6.3).
struct Farthest {
  std::string clip;
  int frame = 0;
  double distance = -1;
};

Farthest farthest(LibraryView& library, const ContactModel& model, const ContactsOptions& options) {
  const std::vector<std::string> names = labelled_clips(library.library());
  const std::set<std::string> labelled(names.begin(), names.end());
  Farthest out;
  for (const ClipRow& row : library.library().clips()) {
    Session::check_stop();
    if (labelled.contains(row.name)) continue;
    const Clip clip = library.clip(row);
    const auto feet = find_feet(clip, feet_names(options));
    if (!feet) continue;
    const FootTracks tracks = foot_tracks(clip, *feet);
    const std::vector<double> distances = model.distances(tracks, estimate_ground(tracks));
    const auto most = std::ranges::max_element(distances);
    if (*most > out.distance) out = {row.name, static_cast<int>(most - distances.begin()), *most};
  }
  return out;
}

void run_next(const ContactsOptions& options) {
  LibraryView library(*options.library);
  const auto model = library_contact_model(library.library());
  const Farthest next = farthest(library, or_standard(model), options);
  const std::size_t labelled = labelled_clips(library.library()).size();
  if (next.distance < 0) {
    options.json ? print_json({{"clip", nullptr}, {"labelled_clips", labelled}})
                 : print("# every clip with feet has labels\n");
    return;
  }
  const Clip clip = library.clip(library.require_clip(next.clip));
  const Feet feet = require_feet(clip, feet_names(options));
  const FootTracks tracks = foot_tracks(clip, feet);
  const FootContacts contacts = or_standard(model).detect(tracks, estimate_ground(tracks));
  if (options.json) {
    print_json({{"clip", next.clip},
                {"frame", next.frame},
                {"time_s", next.frame / clip.rate_hz},
                {"distance", next.distance},
                {"labelled_clips", labelled},
                {"contacts", to_json(contacts, clip, feet)}});
    return;
  }
  print("# label next: {} (frame {}, {:.2f} s, is {:.3f} leg lengths from what is labelled)\n{}", printable(next.clip),
        next.frame, next.frame / clip.rate_hz, next.distance, format_contacts(contacts, clip.skeleton, feet));
}

std::string text_of(const std::string& file) {
  if (file != "-") return std::string(FileContent(file).text());
  return {std::istreambuf_iterator<char>(std::cin), std::istreambuf_iterator<char>()};
}

void run_label(const ContactsOptions& options) {
  LibraryView view(*options.library);
  LabelledClip labelled{
      .clip = view.clip(view.require_clip(options.label)), .contacts = {}, .feet = feet_names(options)};
  labelled.clip.name = options.label;
  const Feet feet = require_feet(labelled.clip, labelled.feet);
  const std::string source = options.from == "-" ? "standard input" : options.from;
  labelled.contacts = parse_contacts(text_of(options.from), source, labelled.clip, feet);
  Library library = Library::open(*options.library);
  put_contact_labels(library, labelled);
  const Json out{{"clip", options.label},
                 {"contacts", labelled.contacts.size()},
                 {"labelled_clips", labelled_clips(library).size()}};
  options.json ? print_json(out) : print_fields(out);
}

void run_contacts(const ContactsOptions& options, Session& session) {
  const int wishes = (options.next ? 1 : 0) + (options.label.empty() ? 0 : 1) + (options.clip.empty() ? 0 : 1);
  if (wishes != 1) {
    throw Error(ErrorKind::usage, {.found = "none or several of CLIP, --next and --label",
                                   .expected = "one of them",
                                   .remedy = "kinespace contacts --help"});
  }
  if (options.next) return run_next(options);
  options.label.empty() ? run_detect(options, session) : run_label(options);
}

}  // namespace

void add_contacts(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("contacts", "When feet are planted: find, and teach by labels");
  const auto options = std::make_shared<ContactsOptions>();
  command->add_option("CLIP", options->clip,
                      fmt::format("A file, {}, or a clip of the library", listed(clip_endings_read())));
  CLI::Option* library = command->add_option("--library", options->library, "The library that keeps labels");
  command->add_flag("--next", options->next, "Name the clip to label next, with the contacts it seems to have")
      ->needs(library);
  CLI::Option* label = command->add_option("--label", options->label, "Keep labels for this clip of the library");
  label->needs(library);
  command->add_option("--from", options->from, "The labels: lines JOINT FIRST LAST; - is standard input")->needs(label);
  add_clip_choice(command, options->choice);
  command->add_option("--feet", options->feet, "The ankle joints as LEFT,RIGHT; found by name and shape otherwise");
  command->add_flag("--json", options->json, "Print one JSON object");
  session.files.reads(command, {"CLIP", "--from"});
  session.files.updates(command, {"--library"});
  command->callback([options, &session] { run_contacts(*options, session); });
}

}  // namespace kinespace::cli
