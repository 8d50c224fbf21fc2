#include "protocol/telemetry/metrics_page.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <sstream>

namespace comap {
namespace {

double valueOf(const std::string& text, const std::string& sample) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(sample + " ")) return std::stod(line.substr(sample.size() + 1));
  ADD_FAILURE() << "no sample " << sample << " in\n" << text;
  return -1;
}

TEST(MetricsPage, SamplesOfOneNameStandTogetherUnderOneHead) {
  MetricsPage page;
  page.counter("comap_bytes_total", "Bytes.", 7, {{"robot", "a"}});
  page.gauge("comap_maps", "Maps.", 2);
  page.counter("comap_bytes_total", "Bytes.", 9, {{"robot", "b"}});
  EXPECT_EQ(page.text(),
            "# HELP comap_bytes_total Bytes.\n# TYPE comap_bytes_total counter\n"
            "comap_bytes_total{robot=\"a\"} 7\ncomap_bytes_total{robot=\"b\"} 9\n"
            "# HELP comap_maps Maps.\n# TYPE comap_maps gauge\ncomap_maps 2\n");
}

TEST(MetricsPage, LabelsAreEscaped) {
  MetricsPage page;
  page.gauge("comap_info", "One.", 1, {{"device", "a \"b\"\\c\nd"}});
  EXPECT_NE(page.text().find("device=\"a \\\"b\\\"\\\\c\\nd\""), std::string::npos) << page.text();
}

TEST(MetricsPage, SummariesAreInSeconds) {
  TimeHistogram times;
  for (int i = 0; i < 99; ++i) times.add(100);
  times.add(2000);
  MetricsPage page;
  page.summary("comap_stage_seconds", "Stages.", times, {{"stage", "fuse"}});
  const std::string text = page.text();
  EXPECT_EQ(valueOf(text, "comap_stage_seconds_count{stage=\"fuse\"}"), 100);
  EXPECT_NEAR(valueOf(text, "comap_stage_seconds_sum{stage=\"fuse\"}"), 99 * 0.1 + 2, 1e-9);
  EXPECT_NEAR(valueOf(text, "comap_stage_seconds{stage=\"fuse\",quantile=\"0.5\"}"), 0.1, 0.001);
  EXPECT_NEAR(valueOf(text, "comap_stage_seconds{stage=\"fuse\",quantile=\"1\"}"), 2, 1e-9);
}

TEST(MetricsPage, ProcessTellsMemoryAndTime) {
  MetricsPage page;
  page.process();
  const std::string text = page.text();
  EXPECT_GT(valueOf(text, "process_resident_memory_bytes"), 1e5);
  EXPECT_GE(valueOf(text, "process_cpu_seconds_total"), 0);
  EXPECT_GT(valueOf(text, "process_start_time_seconds"), 1.6e9);
}

}  // namespace
}  // namespace comap
