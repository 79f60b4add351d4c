#include "kinespace/footskate/contact_labels.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

constexpr std::string_view kind = "contact labels";
constexpr std::uint32_t version = 1;
constexpr double dense = 0.05;  // so that what people say outweighs the standard model where they said it

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// Takes the last word off `text`.
std::string_view take_last(std::string_view& text) {
  const auto space = text.find_last_of(" \t");
  const std::string_view word = space == std::string_view::npos ? text : text.substr(space + 1);
  text = space == std::string_view::npos ? std::string_view() : trimmed(text.substr(0, space));
  return word;
}

std::optional<int> number(std::string_view word) {
  int value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

class LineParser {
 public:
  LineParser(const std::string& source, const Clip& clip, const Feet& feet)
      : source_(source), clip_(clip), joints_(feet.foot_joints()) {}

  [[nodiscard]] FootContact parse(std::string_view line, int number_of_line) const {
    std::string_view rest = line;
    const auto last = number(take_last(rest));
    const auto first = number(take_last(rest));
    const bool in_clip = first && last && *first >= 0 && *first <= *last && *last < clip_.frames;
    if (!in_clip) {
      fail(number_of_line, std::string(line), fmt::format("JOINT FIRST LAST with frames 0 to {}", clip_.frames - 1));
    }
    return {slot_of(std::string(rest), number_of_line), *first, *last};
  }

 private:
  [[nodiscard]] int slot_of(const std::string& name, int line) const {
    std::string names;
    for (int slot = 0; slot < 4; ++slot) {
      if (joints_[slot] < 0) continue;
      const std::string& joint = clip_.skeleton.joints[joints_[slot]].name;
      if (joint == name) return slot;
      names += (names.empty() ? "" : ", ") + joint;
    }
    fail(line, fmt::format("the joint \"{}\"", name), "one of " + names);
  }

  [[noreturn]] void fail(int line, std::string found, std::string expected) const {
    throw Error(
        ErrorKind::bad_input,
        {.file = source_, .line = line, .found = std::move(found), .expected = std::move(expected), .remedy = {}});
  }

  const std::string& source_;
  const Clip& clip_;
  std::array<int, 4> joints_;
};

// Contacts and keyframes as they are kept.
struct Kept {
  FootContacts contacts;
  ContactModel model;
};

Kept read(const Library& library, const std::string& clip, const Bytes& bytes) {
  ByteReader in(bytes, fmt::format("{}: contact labels of {}", library.path().string(), clip));
  const auto found = in.get<std::uint32_t>();
  if (found != version) in.fail(fmt::format("version {}", found), fmt::format("version {}", version));
  FootContacts contacts;
  for (auto left = in.get<std::uint32_t>(); left > 0; --left) {
    const auto slot = in.get<std::int32_t>();
    const auto first = in.get<std::int32_t>();
    const auto last = in.get<std::int32_t>();
    if (slot < 0 || slot > 3 || first < 0 || last < first) in.fail("a contact that cannot be", "frames in order");
    contacts.push_back({slot, first, last});
  }
  const auto rest = in.take(in.remaining());
  return {std::move(contacts), ContactModel::from_bytes(rest, "contact labels of " + clip)};
}

}  // namespace

std::string format_contacts(const FootContacts& contacts, const Skeleton& skeleton, const Feet& feet) {
  const auto joints = feet.foot_joints();
  std::string out;
  for (const FootContact& c : contacts) {
    out += fmt::format("{} {} {}\n", skeleton.joints[joints[c.slot]].name, c.first_frame, c.last_frame);
  }
  return out;
}

FootContacts parse_contacts(std::string_view text, const std::string& source, const Clip& clip, const Feet& feet) {
  const LineParser parser(source, clip, feet);
  std::array<std::vector<char>, 4> planted;
  planted.fill(std::vector<char>(clip.frames, 0));
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view content = text.substr(0, end);
    const std::string_view words = trimmed(content.substr(0, content.find('#')));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.empty()) continue;
    const FootContact c = parser.parse(words, line);
    std::fill(planted[c.slot].begin() + c.first_frame, planted[c.slot].begin() + c.last_frame + 1, 1);
  }
  FootContacts out;
  for (int slot = 0; slot < 4; ++slot) append_runs(planted[slot], slot, out);
  return out;
}

void put_contact_labels(Library& library, const LabelledClip& labelled) {
  ByteWriter out;
  out.put(version);
  out.put(static_cast<std::uint32_t>(labelled.contacts.size()));
  for (const FootContact& c : labelled.contacts) {
    for (const int value : {c.slot, c.first_frame, c.last_frame}) out.put(static_cast<std::int32_t>(value));
  }
  out.put_bytes(ContactModel::train(std::span(&labelled, 1), dense).to_bytes());
  library.put_artifact(kind, labelled.clip.name, out.bytes());
}

std::vector<std::string> labelled_clips(const Library& library) {
  return library.artifact_keys(kind);
}

std::optional<FootContacts> contact_labels(const Library& library, const std::string& clip) {
  const auto bytes = library.artifact(kind, clip);
  if (!bytes) return std::nullopt;
  return read(library, clip, *bytes).contacts;
}

std::optional<ContactModel> library_contact_model(const Library& library) {
  const std::vector<std::string> clips = labelled_clips(library);
  if (clips.empty()) return std::nullopt;
  ContactModel out = ContactModel::standard();
  for (const std::string& clip : clips) {
    if (const auto bytes = library.artifact(kind, clip)) out = out.with(read(library, clip, *bytes).model);
  }
  return out;
}

}  // namespace kinespace
