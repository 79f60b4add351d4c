// Where the attacks take place: a folder with clips, a library, a stream and the outputs of an earlier run, the work
// that is done there, and the check that whatever happened, every output is whole: the old one or the new one.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {

// A run of the command, in the arena as its working folder.
struct Work {
  std::string name;
  std::vector<std::string> arguments;
};

class Arena {
 public:
  // Makes the folder as it is before any work, and as each work leaves it when nothing is in its way.
  Arena();

  [[nodiscard]] const std::vector<Work>& works() const { return works_; }

  struct Outcome {
    CommandResult result;
    std::map<std::string, std::string> files;  // by their path in the arena
  };
  // The work in a fresh copy of the folder, run by this line of shell in which "$@" is the command.
  [[nodiscard]] Outcome run(const Work& work, const std::string& shell,
                            const std::vector<std::string>& environment = {});

  // Fails the test unless the work ended with a code of its own (0, 1 or 3; or by SIGKILL where that was sent), every
  // file is to the byte what it was before or what the undisturbed work makes of it (all of them so after exit 0),
  // inputs are as they were, and what is left of the writing goes with the next run of the same work, which must
  // succeed.
  void expect_whole(const Work& work, const Outcome& outcome, bool killed = false);

  // Fails the test unless every file is as the undisturbed work leaves it, whatever the exit code.
  void expect_done(const Work& work, const Outcome& outcome) const;

  // Calls of the undisturbed work: allocations, and changes of files.
  struct Counts {
    long allocations = 0;
    long changes = 0;
  };
  [[nodiscard]] Counts counts(const Work& work);

 private:
  [[nodiscard]] std::filesystem::path before() const { return folder_ / "before"; }
  void fresh_copy() const;

  TemporaryFolder folder_;
  std::vector<Work> works_;
  std::map<std::string, std::string> before_;
  std::map<std::string, std::map<std::string, std::string>> after_;  // by the work's name
};

// `count` numbers of 1 to `last`, spread evenly, the first and the last few among them; all of them where the variable
// KINESPACE_ATTACK_ALL is set.
[[nodiscard]] std::vector<long> points_of(long last, int count);

}  // namespace kinespace::test
