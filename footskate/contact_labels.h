// Contacts as people write them, and the labels a library keeps.
//
// As text a contact is a line "JOINT FIRST LAST": the name of an ankle or toe joint and two frames, from 0, both
// included. Empty lines and what follows a '#' do not count.
//
// A library keeps the labels of a clip as an artifact of the kind "contact labels", under the clip's name: the contacts
// and the keyframes learnt from them, so that its model needs no clip decoded.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kinespace/footskate/contact_model.h"
#include "kinespace/storage/library.h"

namespace kinespace {

[[nodiscard]] std::string format_contacts(const FootContacts& contacts, const Skeleton& skeleton, const Feet& feet);

// Throws Error{bad_input} naming `source` and the line: not a joint of a foot, no frames of the clip.
[[nodiscard]] FootContacts parse_contacts(std::string_view text, const std::string& source, const Clip& clip,
                                          const Feet& feet);

// Learns the clip's contacts and keeps them under its name; replaces what was there.
void put_contact_labels(Library& library, const LabelledClip& labelled);

// The names of the clips with labels, sorted, and the labels of one; nullopt when it has none.
[[nodiscard]] std::vector<std::string> labelled_clips(const Library& library);
[[nodiscard]] std::optional<FootContacts> contact_labels(const Library& library, const std::string& clip);

// The standard model with all labels of the library; nullopt when it has none.
[[nodiscard]] std::optional<ContactModel> library_contact_model(const Library& library);

}  // namespace kinespace
