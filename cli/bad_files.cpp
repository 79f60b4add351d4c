#include "cli/bad_files.h"

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace::cli {
void add_skip_bad(CLI::App* command, bool& skip_bad) {
  command->add_flag("--skip-bad", skip_bad, "Files that cannot be read are no failure; they are listed all the same");
}

void BadFiles::tell(bool skip_bad, Session& session) const {
  for (const BadFile& bad : files_) session.warn("left out: " + bad.reason());
  if (files_.empty() || skip_bad) return;
  throw Error(ErrorKind::bad_input,
              {.found = fmt::format("{} file{} that cannot be read", files_.size(), files_.size() == 1 ? "" : "s"),
               .expected = "clips; what was written is made of the others",
               .remedy = "mend or remove them, or give --skip-bad"});
}

Json to_json(const BadFiles& bad) {
  Json out = Json::array();
  for (const BadFile& file : bad.files()) out.push_back({{"file", file.file.string()}, {"reason", file.reason()}});
  return out;
}

}  // namespace kinespace::cli
