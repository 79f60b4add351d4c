// The keys other programs rely on, and the values behind them.
#include <cmath>
#include <filesystem>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bench/plot.h"
#include "bench/report.h"
#include "cli/json_output.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::HasSubstr;

class JsonOutput : public testing::Test {
 protected:
  JsonOutput() {
    write_text(a(), walking_bvh(30, 1));
    write_text(b(), walking_bvh(30, 1.1));
  }
  std::string a() const { return (folder_ / "a.bvh").string(); }
  std::string b() const { return (folder_ / "b.bvh").string(); }
  TemporaryFolder folder_;
};

nlohmann::json parsed(const CommandResult& result) {
  EXPECT_EQ(result.code, 0) << result.err;
  return nlohmann::json::parse(result.out);
}

TEST_F(JsonOutput, compare_prints_every_measure_under_its_key) {
  const nlohmann::json printed = parsed(run_command({"compare", a(), b(), "--json"}));
  const MotionError error = compare(read_clip(a()), read_clip(b()));
  ASSERT_GT(error.mean_joint_error_cm, 0.5);
  EXPECT_EQ(printed.at("joints"), error.joints);
  EXPECT_EQ(printed.at("frames"), error.frames);
  EXPECT_EQ(printed.at("mean_joint_error_cm"), error.mean_joint_error_cm);
  EXPECT_EQ(printed.at("max_joint_error_cm"), error.max_joint_error_cm);
  EXPECT_EQ(printed.at("shell_error_cm"), error.shell_error_cm);
  EXPECT_EQ(printed.at("mean_rotation_error_deg"), error.mean_rotation_error_deg);
  EXPECT_EQ(printed.at("kg"), error.kg);
  EXPECT_EQ(printed.at("kg_time"), error.kg_time);
  EXPECT_EQ(printed.at("channel_mse_deg2"), error.channel_mse_deg2);
}

TEST_F(JsonOutput, compare_without_json_prints_a_line_a_measure) {
  const CommandResult result = run_command({"compare", a(), b()});
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.out, HasSubstr("mean joint error cm"));
  EXPECT_THAT(result.out, HasSubstr("kg time"));
}

TEST_F(JsonOutput, info_describes_a_clip) {
  const nlohmann::json printed = parsed(run_command({"info", a(), "--json"}));
  EXPECT_EQ(printed.at("kind"), "clip");
  EXPECT_EQ(printed.at("name"), "a");
  EXPECT_EQ(printed.at("frames"), 30);
  EXPECT_NEAR(printed.at("rate_hz").get<double>(), 100, 1e-9);
  EXPECT_NEAR(printed.at("duration_s").get<double>(), 0.29, 1e-9);
  EXPECT_EQ(printed.at("joints"), 2);
  EXPECT_NEAR(printed.at("height_cm").get<double>(), read_clip(a()).skeleton.rest_height(), 1e-9);
  EXPECT_EQ(printed.at("bytes"), std::filesystem::file_size(a()));
}

TEST_F(JsonOutput, convert_tells_what_it_wrote_and_wrote_it) {
  const std::string out = (folder_ / "out.bvh").string();
  const nlohmann::json printed = parsed(run_command({"convert", a(), out, "--json"}));
  EXPECT_EQ(printed.at("output"), out);
  EXPECT_EQ(printed.at("frames"), 30);
  EXPECT_LT(compare(read_clip(a()), read_clip(out)).max_joint_error_cm, 1e-4);
}

TEST_F(JsonOutput, quiet_says_nothing_but_results_and_errors) {
  const CommandResult loud = run_command({"convert", a(), (folder_ / "out.bvh").string()});
  EXPECT_THAT(loud.err, HasSubstr("30 frames"));
  const CommandResult quiet = run_command({"convert", a(), (folder_ / "out.bvh").string(), "--quiet"});
  EXPECT_EQ(quiet.code, 0);
  EXPECT_EQ(quiet.err, "");
}

TEST_F(JsonOutput, devices_always_lists_the_processor_first) {
  const nlohmann::json printed = parsed(run_command({"devices", "--json"}));
  const nlohmann::json& devices = printed.at("devices");
  ASSERT_GE(devices.size(), 1U);
  EXPECT_EQ(devices[0].at("choice"), "cpu");
  for (std::size_t i = 1; i < devices.size(); ++i)
    EXPECT_EQ(devices[i].at("choice"), "opencl:" + std::to_string(i - 1));
  EXPECT_EQ(printed.at("no_opencl_because").is_null(), devices.size() > 1);
}

TEST_F(JsonOutput, without_any_opencl_driver_devices_says_so_and_the_processor_remains) {
  const std::string nowhere = (folder_ / "no drivers").string();
  std::filesystem::create_directory(nowhere);
  const CommandOptions no_driver{.environment = {"OCL_ICD_VENDORS=" + nowhere}};
  const nlohmann::json printed = parsed(run_command({"devices", "--json"}, no_driver));
  EXPECT_EQ(printed.at("devices").size(), 1U);
  EXPECT_TRUE(printed.at("no_opencl_because").is_string());
  const CommandResult plain = run_command({"devices"}, no_driver);
  EXPECT_EQ(plain.code, 0);
  EXPECT_THAT(plain.out, HasSubstr("No OpenCL device: "));
}

TEST_F(JsonOutput, bench_report_has_its_keys_and_null_for_no_bar) {
  const BenchReport report{
      .bench = "io",
      .device = "cpu",
      .threads = 2,
      .results = {{.name = "speed", .data = "x", .value = 140, .unit = "MB/s", .bar = 150, .higher_is_better = true},
                  {.name = "size | whole", .data = "y", .value = 3.5, .unit = "MB"}}};
  const nlohmann::json printed = nlohmann::json::parse(to_json(report));
  EXPECT_EQ(printed.at("bench"), "io");
  EXPECT_EQ(printed.at("device"), "cpu");
  EXPECT_EQ(printed.at("threads"), 2);
  const nlohmann::json& first = printed.at("results").at(0);
  EXPECT_EQ(first,
            nlohmann::json(
                {{"name", "speed"}, {"data", "x"}, {"value", 140.0}, {"unit", "MB/s"}, {"bar", 150.0}, {"ok", false}}));
  EXPECT_TRUE(printed.at("results").at(1).at("bar").is_null());
  EXPECT_EQ(printed.at("results").at(1).at("ok"), true);
  const std::string table = to_markdown(report);
  EXPECT_THAT(table, HasSubstr("| speed | x | 140 | MB/s | >= 150 | **no** |"));
  EXPECT_THAT(table, HasSubstr("| size \\| whole | y | 3.5 | MB |  |  |"));
}

TEST_F(JsonOutput, tables_of_a_bench_are_lists_of_rows_and_their_empty_cells_null) {
  const BenchReport report{
      .bench = "codecs",
      .device = "cpu",
      .threads = 2,
      .tables = {{.title = "Table 4", .columns = {"clip", "ratio"}, .rows = {{"walk | slow", 59.4}, {"run", {}}}}}};
  const nlohmann::json table = nlohmann::json::parse(to_json(report)).at("tables").at(0);
  EXPECT_EQ(table.at("title"), "Table 4");
  EXPECT_EQ(table.at("columns"), nlohmann::json({"clip", "ratio"}));
  EXPECT_EQ(table.at("rows").at(0), nlohmann::json({"walk | slow", 59.4}));
  EXPECT_TRUE(table.at("rows").at(1).at(1).is_null());
  EXPECT_THAT(to_markdown(report), HasSubstr("| walk \\| slow | 59.4 |\n| run |  |"));
  EXPECT_EQ(to_text(report.tables.front()),
            "Table 4\n  clip         ratio\n  walk | slow   59.4\n  run               \n");
}

TEST_F(JsonOutput, a_plot_shows_what_its_axes_can_show) {
  const Plot plot{.title = "errors & bytes",
                  .x = {.label = "error", .logarithmic = true},
                  .y = {.label = "bytes"},
                  .series = {{"ours", {{0.1, 5}, {1, 3}, {0, 9}}}, {"nobody's", {}}}};
  const std::string svg = to_svg(plot);
  EXPECT_THAT(svg, HasSubstr("errors &amp; bytes"));
  EXPECT_THAT(svg, HasSubstr("nobody's"));
  const auto circles = [](const std::string& text) {
    std::size_t out = 0;
    for (std::size_t at = text.find("<circle"); at != std::string::npos; at = text.find("<circle", at + 1)) ++out;
    return out;
  };
  EXPECT_EQ(circles(svg), 2U) << "zero has no place on a logarithmic axis";
  EXPECT_EQ(svg, to_svg(plot));
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(to_svg({}).find("nan"), std::string::npos) << "an empty plot is one too";
}

TEST_F(JsonOutput, what_is_no_number_or_no_text_is_still_valid_json) {
  testing::internal::CaptureStdout();
  cli::print_json({{"ratio", std::numeric_limits<double>::infinity()}, {"name", "caf\xe9"}});
  const nlohmann::json printed = nlohmann::json::parse(testing::internal::GetCapturedStdout());
  EXPECT_TRUE(printed.at("ratio").is_null());
  EXPECT_EQ(printed.at("name"), "caf\xef\xbf\xbd");
}

}  // namespace
}  // namespace kinespace::test
