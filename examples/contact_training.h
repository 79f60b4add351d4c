// The labelled clips of which the standard contact model is learnt (footskate/contact_model.h), and its table.
#pragma once

#include <string>

#include "examples/sample_motions.h"
#include "kinespace/footskate/contact_model.h"

namespace kinespace {

// The contacts of a sample motion as those of its feet.
[[nodiscard]] FootContacts contacts_of(const SampleMotion& motion, const Feet& feet);

// The model that ContactModel::standard() is.
[[nodiscard]] ContactModel train_standard_contacts();

// Its bytes as C++ string literals of base 64: footskate/standard_contacts.inc.
[[nodiscard]] std::string standard_contact_table();

}  // namespace kinespace
