#include "fleet_tools/render/picture_legend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "fleet_tools/render/picture_text.h"
#include "fleet_tools/render/surfel_renderer.h"

namespace comap {
namespace {

constexpr Rgb kGround{120, 120, 120};

bool isDark(Rgb c) { return c.r < 60 && c.g < 60 && c.b < 60; }

// Where the dark dots of a text are.
std::vector<bool> dotsOf(const std::string& text) {
  ColourImage picture(8 * static_cast<int>(text.size()) + 8, 12, kGround);
  drawText(picture, text, 2, 2, 1);
  std::vector<bool> dots;
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) dots.push_back(isDark(picture.at(x, y)));
  return dots;
}

TEST(PictureText, EachLetterOfANameLooksLikeNoOther) {
  std::set<std::vector<bool>> shapes;
  const std::string letters = "abcdefghijklmnopqrstuvwxyz0123456789-_?";
  for (const char letter : letters) {
    const std::vector<bool> dots = dotsOf(std::string(1, letter));
    EXPECT_GE(std::count(dots.begin(), dots.end(), true), 5) << letter;
    EXPECT_TRUE(shapes.insert(dots).second) << letter;
  }
  EXPECT_EQ(dotsOf("?"), dotsOf("\xe4")) << "what is no letter of a name is a box";
}

TEST(PictureText, DotsGrowAndStayWithinTheirWidth) {
  for (const int dot : {1, 2, 3}) {
    ColourImage picture(200, 40, kGround);
    drawText(picture, "wag_on", 10, 5, dot);
    const int right = 10 + textWidth_px("wag_on", dot), bottom = 5 + kLetterHeight_dots * dot;
    int dark = 0;
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 0; x < picture.width(); ++x) {
        if (!isDark(picture.at(x, y))) continue;
        ++dark;
        EXPECT_TRUE(x >= 10 && x < right && y >= 5 && y < bottom) << x << " " << y;
      }
    const std::vector<bool> dots = dotsOf("wag_on");
    EXPECT_EQ(dark, dot * dot * std::count(dots.begin(), dots.end(), true));
  }
}

TEST(PictureText, WhatLiesOutsideThePictureIsLeftOut) {
  ColourImage picture(16, 8, kGround);
  drawText(picture, "a-robot-of-some-length", -9, -3, 3);
  drawText(picture, "a", 14, 6, 3);
  EXPECT_EQ(picture.width(), 16);
}

// The leftmost pixel of each robot's colour, or -1, and the rows that have some.
struct Square {
  int left = -1, top = -1;
};
Square squareOf(const ColourImage& picture, size_t robot) {
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x)
      if (picture.at(x, y) == robotColour(robot)) return {x, y};
  return {};
}

TEST(PictureLegend, EachRobotHasItsColourAndItsName) {
  ColourImage picture(640, 320, kGround);
  const std::vector<std::string> robots = {"kitchen", "r2"};
  drawLegend(picture, robotLegend(robots));
  const Square first = squareOf(picture, 0), second = squareOf(picture, 1);
  ASSERT_GE(first.left, 0);
  EXPECT_EQ(first.top, second.top);
  EXPECT_GT(first.top, 280) << "at the foot";
  EXPECT_GT(second.left, first.left + textWidth_px("kitchen", 1)) << "the name lies between";
  const auto darkBetween = [&](int from, int to) {
    int dark = 0;
    for (int y = 0; y < picture.height(); ++y)
      for (int x = from; x < to; ++x) dark += isDark(picture.at(x, y));
    return dark;
  };
  EXPECT_GT(darkBetween(first.left, second.left), 50);
  EXPECT_GT(darkBetween(second.left, 640), 10);
}

TEST(PictureLegend, WhoDoesNotFitBeginsALine) {
  ColourImage picture(300, 400, kGround);
  std::vector<std::string> robots;
  for (int i = 0; i < 8; ++i) robots.push_back("robot-number-" + std::to_string(i));
  drawLegend(picture, robotLegend(robots));
  int top = -1, lines = 0;
  for (size_t robot = 0; robot < robots.size(); ++robot) {
    const Square square = squareOf(picture, robot);
    ASSERT_GE(square.left, 0) << robot;
    EXPECT_LT(square.left + 8, 300) << robot;
    EXPECT_GE(square.top, top) << "in their order";
    lines += square.top > top;
    top = square.top;
  }
  EXPECT_GE(lines, 3);
}

TEST(PictureLegend, EachColouringSaysWhatItsColoursAre) {
  const auto namesOf = [](Colouring colouring) {
    std::vector<std::string> names;
    for (const LegendEntry& entry : legendOf(colouring, std::vector<std::string>{"a", "b"}))
      names.push_back(entry.name);
    return names;
  };
  EXPECT_TRUE(namesOf(Colouring::kRgb).empty());
  EXPECT_EQ(namesOf(Colouring::kContribution), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(namesOf(Colouring::kNormal), (std::vector<std::string>{"x", "-x", "y", "-y", "z", "-z"}));
  EXPECT_EQ(namesOf(Colouring::kConfidence), (std::vector<std::string>{"1", "3", "7", "19", "50"}));
  const auto normals = legendOf(Colouring::kNormal, {});
  EXPECT_EQ(normals[0].colour, (Rgb{255, 128, 128}));
  EXPECT_EQ(normals[3].colour, (Rgb{128, 0, 128}));
  const auto weights = legendOf(Colouring::kConfidence, {});
  EXPECT_EQ(weights.front().colour, (Rgb{68, 1, 84}));
  EXPECT_EQ(weights.back().colour, (Rgb{253, 231, 37}));
}

TEST(PictureLegend, ASmallPictureIsNoReasonToFail) {
  ColourImage picture(16, 16, kGround);
  drawLegend(picture, robotLegend(std::vector<std::string>(9, "a-name-that-is-far-too-long")));
  drawLegend(picture, {});
  EXPECT_EQ(picture.height(), 16);
}

}  // namespace
}  // namespace comap
