#include "edge_agent/agent_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace comap {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(AgentMetrics, TellHowTheCameraDoes) {
  CaptureHealth camera;
  camera.colour = {StreamState::kStreaming, "", 100, 1, 2, 3, 4, 5, 6};
  camera.depth = {StreamState::kGone, "unplugged", 90, 7, 8, 9, 10, 11, 12};
  camera.overtaken = 20;
  camera.unpaired = 21;
  camera.not_decoded = 22;
  camera.every = 3;
  MetricsPage page;
  addCamera(camera, {{"robot", "a"}}, page);
  const std::string text = page.text();
  for (const char* sample :
       {"comap_agent_camera_pictures_total{robot=\"a\",stream=\"colour\"} 100\n",
        "comap_agent_camera_pictures_total{robot=\"a\",stream=\"depth\"} 90\n",
        "comap_agent_camera_pictures_lost_total{reason=\"damaged\",robot=\"a\",stream=\"colour\"} 1\n",
        "comap_agent_camera_pictures_lost_total{reason=\"missed\",robot=\"a\",stream=\"depth\"} 8\n",
        "comap_agent_camera_pictures_lost_total{reason=\"repeated\",robot=\"a\",stream=\"depth\"} 9\n",
        "comap_agent_camera_clock_jumps_total{robot=\"a\",stream=\"colour\"} 4\n",
        "comap_agent_camera_reopened_total{robot=\"a\",stream=\"depth\"} 11\n",
        "comap_agent_camera_stalls_total{robot=\"a\",stream=\"depth\"} 12\n",
        "comap_agent_camera_stream{robot=\"a\",state=\"streaming\",stream=\"colour\"} 1\n",
        "comap_agent_camera_stream{robot=\"a\",state=\"streaming\",stream=\"depth\"} 0\n",
        "comap_agent_camera_stream{robot=\"a\",state=\"gone\",stream=\"depth\"} 1\n",
        "comap_agent_camera_frames_left_out_total{reason=\"overtaken\",robot=\"a\"} 20\n",
        "comap_agent_camera_frames_left_out_total{reason=\"unpaired\",robot=\"a\"} 21\n",
        "comap_agent_camera_frames_left_out_total{reason=\"not_decoded\",robot=\"a\"} 22\n",
        "comap_agent_camera_one_of{robot=\"a\"} 3\n"})
    EXPECT_THAT(text, HasSubstr(sample));
  EXPECT_THAT(text, Not(HasSubstr("celsius"))) << "of a machine that does not tell";
  camera.hottest_C = 61.5;
  addCamera(camera, {{"robot", "b"}}, page);
  EXPECT_THAT(page.text(), HasSubstr("comap_agent_camera_machine_celsius{robot=\"b\"} 61.5\n"));
}

TEST(AgentMetrics, ACameraThatGivesNothingIsNamed) {
  EXPECT_EQ(cameraTrouble(std::nullopt), "");
  CaptureHealth camera;
  EXPECT_EQ(cameraTrouble(camera), "") << "it starts";
  camera.colour.state = StreamState::kStreaming;
  camera.depth.state = StreamState::kGone;
  EXPECT_EQ(cameraTrouble(camera), "camera: depth gone");
  camera.colour.state = StreamState::kStalled;
  EXPECT_EQ(cameraTrouble(camera), "camera: colour stalled, depth gone");
}

}  // namespace
}  // namespace comap
