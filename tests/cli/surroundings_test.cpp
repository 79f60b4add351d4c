// What stands around the command: odd file names, a comma locale, a terminal or a log, signals.
#include <algorithm>
#include <chrono>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/progress_bar.h"
#include "cli/session.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

TEST(Surroundings, file_names_may_hold_spaces_quotes_colons_and_more) {
  for (const char* name : {"two words", "it's \"quoted\"", "C: drive", "info", "[1,2]", "100%{}", "ü ñ",
                           "semi;colon & $HOME `x`", "back\\slash", "=", "tab\there", "caf\xe9"}) {
    SCOPED_TRACE(name);
    const TemporaryFolder folder;
    const auto input = folder.path() / name / (std::string(name) + ".bvh");
    std::filesystem::create_directory(folder.path() / name);
    write_text(input, walking_bvh(5, 1));
    const auto output = folder.path() / (std::string(name) + " copy.bvh");
    const CommandResult converted = run_command({"convert", input.string(), output.string(), "--json"});
    ASSERT_EQ(converted.code, 0) << converted.err;
    EXPECT_TRUE(nlohmann::json::accept(converted.out)) << converted.out;
    EXPECT_TRUE(std::filesystem::exists(output));
    EXPECT_EQ(run_command({"compare", input.string(), output.string()}).code, 0);
  }
}

TEST(Surroundings, a_name_that_looks_like_an_option_or_a_subcommand_is_still_a_name) {
  const TemporaryFolder folder;
  write_text(folder / "--json.bvh", walking_bvh(5, 1));
  std::filesystem::copy_file(folder / "--json.bvh", folder / "info");
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  const CommandResult dashed = run_command({"info", "--", "--json.bvh"});
  const CommandResult named = run_command({"compare", "info", "convert"});
  std::filesystem::current_path(before);
  EXPECT_EQ(dashed.code, 0) << dashed.err;
  // `info` is the clip here, of a kind its name does not tell, and not the subcommand.
  EXPECT_EQ(named.code, 1) << named.err;
  EXPECT_THAT(named.err, StartsWith("kinespace: info"));
}

TEST(Surroundings, a_comma_locale_changes_nothing_the_command_prints_or_writes) {
  const TemporaryFolder folder;
  const std::string input = (folder / "in.bvh").string();
  write_text(input, walking_bvh(20, 1.25));
  const CommandOptions comma{
      .environment = {"LC_ALL=de_DE.UTF-8", "LANG=de_DE.UTF-8", "LOCPATH=" + comma_locale_folder()}};
  const CommandOptions plain{.environment = {"LC_ALL=C"}};
  ASSERT_EQ(run_command({"convert", input, (folder / "comma.bvh").string()}, comma).code, 0);
  ASSERT_EQ(run_command({"convert", input, (folder / "plain.bvh").string()}, plain).code, 0);
  EXPECT_EQ(read_text(folder / "comma.bvh"), read_text(folder / "plain.bvh"));
  EXPECT_EQ(run_command({"info", input, "--json"}, comma).out, run_command({"info", input, "--json"}, plain).out);
  EXPECT_EQ(run_command({"info", input}, comma).out, run_command({"info", input}, plain).out);
}

TEST(Surroundings, a_program_that_set_a_comma_locale_may_use_the_library) {
  const TemporaryFolder folder;
  write_text(folder / "in.bvh", walking_bvh(20, 1.25));
  const Clip before = read_clip(folder / "in.bvh");
  ASSERT_EQ(setenv("LOCPATH", comma_locale_folder().c_str(), 1), 0);
  ASSERT_NE(std::setlocale(LC_ALL, "de_DE.UTF-8"), nullptr);
  char shown[8];
  ASSERT_GT(std::snprintf(shown, sizeof shown, "%.1f", 0.5), 0);
  EXPECT_STREQ(shown, "0,5") << "the locale is in force";
  const Clip after = read_clip(folder / "in.bvh");
  write_clip(folder / "out.bvh", after);
  const Clip again = read_clip(folder / "out.bvh");
  std::setlocale(LC_ALL, "C");
  EXPECT_EQ(after.rotations, before.rotations);
  EXPECT_LT(compare(before, again).max_joint_error_cm, 1e-4);
}

std::string shown(bool terminal, cli::ProgressBar::Clock::duration every,
                  const std::function<void(cli::ProgressBar&)>& work) {
  std::FILE* file = std::tmpfile();
  EXPECT_NE(file, nullptr);
  {
    cli::ProgressBar bar(file, terminal, every);
    work(bar);
  }
  std::string text(static_cast<std::size_t>(std::ftell(file)), '\0');
  std::rewind(file);
  EXPECT_EQ(std::fread(text.data(), 1, text.size(), file), text.size());
  std::fclose(file);
  return text;
}

void align_and_analyse(cli::ProgressBar& bar) {
  for (int i = 0; i <= 1000; ++i) bar.show("align", i / 1000.0);
  bar.show("analyse", 0.55);
  bar.show("analyse", 0.5);  // late news from another thread
}

TEST(Surroundings, a_log_gets_plain_lines_of_work_that_takes_long) {
  std::string expected;
  for (int percent = 0; percent <= 100; ++percent) expected += "kinespace: align " + std::to_string(percent) + " %\n";
  expected += "kinespace: analyse 55 %\n";
  EXPECT_EQ(shown(false, std::chrono::seconds(0), align_and_analyse), expected);
  EXPECT_EQ(shown(false, std::chrono::hours(1), align_and_analyse), "");
}

TEST(Surroundings, a_terminal_gets_a_bar_a_stage_that_redraws_its_line) {
  const std::string text = shown(true, std::chrono::hours(1), align_and_analyse);
  EXPECT_THAT(text, StartsWith("\ralign "));
  EXPECT_THAT(text, HasSubstr("] 100 %\n\ranalyse"));
  EXPECT_THAT(text, EndsWith("]  55 %\n"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 3);
}

TEST(Surroundings, a_signal_stops_work_that_polls_its_progress) {
  cli::Session session;
  session.quiet = true;
  const Progress progress = session.progress();
  EXPECT_NO_THROW(progress.check_stop());
  cli::catch_stop_signals();
  ASSERT_EQ(std::raise(SIGTERM), 0);
  EXPECT_EQ(cli::stop_signal(), SIGTERM);
  EXPECT_THROW(progress.check_stop(), Interrupted);
}

TEST(Surroundings, a_loop_of_links_and_a_lost_working_folder_are_errors_of_one_line) {
  const TemporaryFolder folder;
  write_text(folder / "in.bvh", walking_bvh(5, 1));
  std::filesystem::create_symlink(folder / "b.bvh", folder / "a.bvh");
  std::filesystem::create_symlink(folder / "a.bvh", folder / "b.bvh");
  const std::string loop = (folder / "a.bvh").string(), in = (folder / "in.bvh").string();
  const std::string inside = (folder / "a.bvh/x").string();
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"info", loop},
                                             {"convert", loop, "o.bvh"},
                                             {"convert", in, loop},
                                             {"convert", in, inside + ".glb"},
                                             {"clean", in, "-o", loop},
                                             {"build", loop, "-o", "o.kspace"},
                                             {"build", in, "-o", inside},
                                             {"encode", in, "-o", inside},
                                             {"encode", loop, "-o", "o.ksm"},
                                             {"decode", loop, "-o", "o"},
                                             {"query", loop, in},
                                             {"mesh", "info", loop},
                                             {"mesh", "encode", in, "-o", inside}}) {
    for (const char* shell : {"exec \"$@\"", "mkdir lost; cd lost; rmdir ../lost; exec \"$@\""}) {
      const CommandResult result =
          run_command(words, {.environment = {}, .shell = "cd '" + folder.path().string() + "'; " + shell});
      EXPECT_THAT(result.code, testing::AnyOf(1, 2, 3)) << testing::PrintToString(words) << result.err;
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
      EXPECT_THAT(result.err, testing::Not(HasSubstr("please report"))) << testing::PrintToString(words);
    }
  }
}

}  // namespace
}  // namespace kinespace::test
