// The map and the report as people see them: in a web browser.
#include "tests/end_to_end/browser.h"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <thread>

#include "edge_agent/capture/image_file.h"
#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

constexpr int kWidth = 1280, kHeight = 800;

class BrowserTest : public FlatTest {
 protected:
  void SetUp() override {
    FlatTest::SetUp();
    if (IsSkipped()) return;
    program_ = findBrowser();
    if (program_.empty()) GTEST_SKIP() << "no Chromium here; ./run-tests --browser installs one";
    const ProgramRun run = runProgram("fleet replay --link loopback --robot a=" + flat_ + "/a@0:60 --robot b=" + flat_ +
                                      "/b@0:60 --out " + folder_.path("run"));
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }

  // The address that `fleet view` prints.
  static std::string addressIn(const std::string& log) {
    for (int i = 0; i < 200; ++i) {
      const std::string text = contentOf(log);
      std::smatch match;
      if (std::regex_search(text, match, std::regex("http://[0-9.:]+/\n")))
        return match.str().substr(0, match.length() - 1);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return {};
  }

  // Share of the picture that differs from its most frequent colour, where no panel lies.
  double drawnShare(Browser& browser, const std::string& name) {
    browser.screenshot(folder_.path(name));
    const auto picture = readColour(folder_.path(name));
    if (!picture) {
      ADD_FAILURE() << picture.error().text;
      return 0;
    }
    std::map<std::array<uint8_t, 3>, size_t> colours;
    size_t all = 0, most = 0;
    for (int y = 60; y < kHeight - 120; ++y)
      for (int x = 320; x < kWidth - 440; ++x, ++all) {
        const Rgb c = picture->at(x, y);
        most = std::max(most, ++colours[{c.r, c.g, c.b}]);
      }
    return 1 - static_cast<double>(most) / static_cast<double>(all);
  }

  std::string program_;
};

TEST_F(BrowserTest, TheMapIsDrawnAKeyframeShowsItsPictureAndTheReportOpens) {
  Background view("fleet", {"view", folder_.path("run/map.comap"), "--port", "0"}, folder_.path("view.log"));
  const std::string address = addressIn(folder_.path("view.log"));
  ASSERT_FALSE(address.empty()) << contentOf(folder_.path("view.log"));
  Browser browser(program_, kWidth, kHeight);
  browser.open(address);
  ASSERT_TRUE(
      browser.waitFor("window.comap && comap.scene.splats.surfels > 10000 && comap.model.keyframes.length > 5 && "
                      "comap.scene.splats.drawn > 10000",
                      60));
  EXPECT_GT(drawnShare(browser, "map.png"), 0.1) << "the room";
  EXPECT_EQ(browser.evaluate("document.querySelectorAll('#robots .name').length"), 2);
  const int surfels = browser.evaluate("comap.scene.splats.counts().surfels").get<int>();
  EXPECT_EQ(browser.evaluate("document.getElementById('count-surfels').textContent.replaceAll(',', '')"),
            std::to_string(surfels));

  // What a switch turns off is no longer in the picture.
  browser.evaluate("document.querySelector('[data-layer=surfels]').click()");
  browser.evaluate("document.querySelector('[data-layer=grid]').click()");
  ASSERT_TRUE(browser.waitFor("comap.scene.dirty === false", 20));
  EXPECT_LT(drawnShare(browser, "lines.png"), 0.05) << "lines and labels alone";
  browser.evaluate("document.querySelector('[data-layer=surfels]').click()");

  const nlohmann::json target = browser.evaluate(
      "(() => { const s = comap.scene, free = s.keyframes.map(k => ({id: k.id, at: s.project(k.position)}))"
      ".filter(k => k.at && document.elementFromPoint(k.at.x, k.at.y) === s.canvas);"
      "const k = free[Math.floor(free.length / 2)]; return {x: k.at.x, y: k.at.y, id: s.nearest(k.at.x, k.at.y, "
      "16).id}; })()");
  browser.click(target.at("x").get<double>(), target.at("y").get<double>());
  ASSERT_TRUE(browser.waitFor("comap.chosen()", 20));
  EXPECT_EQ(browser.evaluate("comap.chosen().id"), target.at("id"));
  for (const std::string kind : {"colour", "depth"})
    EXPECT_TRUE(browser.waitFor("document.getElementById('picture-" + kind + "').naturalWidth >= 320", 20)) << kind;
  // The verdicts of that keyframe, as many as the store has.
  const ProgramRun matches = runProgram("fleet matches " + folder_.path("run/map.comap") + " --json");
  size_t expected = 0;
  for (const auto& match : nlohmann::json::parse(matches.out).at("matches"))
    expected += match.at("query") == target.at("id") || match.at("candidate") == target.at("id");
  EXPECT_TRUE(browser.waitFor("document.querySelectorAll('.verdict').length === " + std::to_string(expected), 20));
  // On a touch screen: two fingers move the view and choose nothing, a tap chooses.
  browser.evaluate("document.getElementById('detail-close').click()");
  ASSERT_TRUE(browser.waitFor("!comap.chosen()", 20));
  const char* distance = "comap.scene.camera.position.distanceTo(comap.scene.controls.target)";
  const double far_off = browser.evaluate(distance).get<double>();
  browser.pinch(target.at("x").get<double>(), target.at("y").get<double>(), target.at("x").get<double>() + 60,
                target.at("y").get<double>());
  EXPECT_TRUE(browser.waitFor(std::string(distance) + " < " + std::to_string(0.9 * far_off), 20)) << "zoomed in";
  EXPECT_EQ(browser.evaluate("comap.chosen()"), nullptr) << "a finger that rests is no tap";
  browser.evaluate("document.getElementById('fit').click()");
  ASSERT_TRUE(browser.waitFor("comap.scene.dirty === false", 20));
  const nlohmann::json finger = browser.evaluate(
      "(() => { const s = comap.scene, free = s.keyframes.map(k => s.project(k.position))"
      ".filter(at => at && document.elementFromPoint(at.x, at.y) === s.canvas);"
      "const at = free[Math.floor(free.length / 2)]; return {x: at.x, y: at.y, id: s.nearest(at.x, at.y, 30).id}; "
      "})()");
  browser.tap(finger.at("x").get<double>(), finger.at("y").get<double>());
  ASSERT_TRUE(browser.waitFor("comap.chosen()", 20));
  EXPECT_EQ(browser.evaluate("comap.chosen().id"), finger.at("id"));
  for (const std::string& complaint : browser.complaints()) ADD_FAILURE() << complaint;

  browser.open("file://" + folder_.path("run/report.html"));
  EXPECT_TRUE(
      browser.waitFor("document.readyState === 'complete' && document.images.length > 0 && "
                      "[...document.images].every(image => image.naturalWidth > 0)",
                      20));
  for (const std::string& complaint : browser.complaints()) ADD_FAILURE() << complaint;
  EXPECT_EQ(view.end(SIGINT), 0) << contentOf(folder_.path("view.log"));
}

// What the canvas shows while there is nothing to be drawn, or nothing to draw it with, and that it goes on afterwards.
TEST_F(BrowserTest, TheCanvasSaysWhatItWaitsFor) {
  Background view("fleet", {"view", folder_.path("run/map.comap"), "--port", "0"}, folder_.path("view.log"));
  const std::string address = addressIn(folder_.path("view.log"));
  ASSERT_FALSE(address.empty()) << contentOf(folder_.path("view.log"));
  Browser browser(program_, kWidth, kHeight);
  browser.open(address);
  const char* drawn = "window.comap && comap.scene.splats.drawn > 10000";
  const char* quiet = "document.getElementById('notice').hidden";
  ASSERT_TRUE(browser.waitFor(drawn, 60));
  ASSERT_TRUE(browser.waitFor(quiet, 20)) << browser.evaluate("document.getElementById('notice').textContent");
  const std::string notice = "comap.counts(); document.getElementById('notice').textContent";
  const int tiles = browser.evaluate("comap.scene.splats.counts().tiles").get<int>();
  browser.evaluate("comap.scene.splats.remove([...comap.scene.splats.tiles].find(([, t]) => t.visible)[0])");
  EXPECT_EQ(browser.evaluate(notice),
            "Loading " + std::to_string(tiles - 1) + " of " + std::to_string(tiles) + " tiles");
  browser.evaluate("comap.model.told.delete('maps')");
  EXPECT_EQ(browser.evaluate(notice), "Loading");
  browser.evaluate("comap.model.told.add('maps')");

  // A graphics card that never tells that it is done.
  browser.evaluate("comap.scene.renderer.getContext().getSyncParameter = () => 0");
  for (int i = 0; i < 2; ++i) {
    browser.evaluate("comap.scene.dirty = true");
    EXPECT_TRUE(browser.waitFor("comap.scene.dirty === false", 20)) << i;
  }
  browser.evaluate("delete comap.scene.renderer.getContext().getSyncParameter");

  // One that is taken away and comes back.
  browser.evaluate(
      "window.taken = comap.scene.renderer.getContext().getExtension('WEBGL_lose_context'), taken.loseContext()");
  EXPECT_TRUE(browser.waitFor("document.getElementById('notice').textContent.includes('graphics memory')", 20));
  browser.evaluate("comap.scene.splats.drawn = 0, taken.restoreContext()");
  EXPECT_TRUE(browser.waitFor(drawn, 20));
  EXPECT_GT(drawnShare(browser, "restored.png"), 0.1);
  EXPECT_EQ(view.end(SIGINT), 0) << contentOf(folder_.path("view.log"));
}

}  // namespace
}  // namespace comap
