// kinespace-contact-table FILE: learns the standard contact model anew and writes footskate/standard_contacts.inc.
#include <cstdio>
#include <exception>

#include "examples/contact_training.h"
#include "kinespace/base/file.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: kinespace-contact-table FILE\n", stderr);
    return 2;
  }
  try {
    kinespace::write_file_atomically(argv[1], kinespace::standard_contact_table());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "kinespace-contact-table: %s\n", error.what());
    return 1;
  }
  return 0;
}
