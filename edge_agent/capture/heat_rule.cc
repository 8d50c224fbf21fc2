#include "edge_agent/capture/heat_rule.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace comap {
namespace {

constexpr int kMost = 8;
constexpr double kCooler_C = 5, kColdest_C = -50, kHottest_C = 200;
constexpr std::chrono::seconds kHotStep{10}, kCoolStep{30};

std::optional<double> temperature_C(const std::filesystem::path& zone) {
  std::ifstream file(zone / "temp");
  double thousandths = 0;
  if (!(file >> thousandths)) return std::nullopt;  // some drivers refuse while their device sleeps
  const double celsius = thousandths / 1000;
  return celsius > kColdest_C && celsius < kHottest_C ? std::optional(celsius) : std::nullopt;
}

}  // namespace

std::optional<double> hottest_C(const std::string& folder) {
  std::optional<double> hottest;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (!it->path().filename().string().starts_with("thermal_zone")) continue;
    const auto here = temperature_C(it->path());
    if (here) hottest = std::max(*here, hottest.value_or(*here));
  }
  return hottest;
}

void HeatRule::measured(std::optional<double> hottest_C, Clock::time_point now) {
  if (hot_C_ <= 0 || !hottest_C) return;
  if (*hottest_C > hot_C_ - kCooler_C) cool_since_.reset();
  if (*hottest_C >= hot_C_) {
    if (stepped_ && now - *stepped_ < kHotStep) return;
    every_ = std::min(every_ + 1, kMost);
    stepped_ = now;
  } else if (*hottest_C <= hot_C_ - kCooler_C) {
    if (!cool_since_) cool_since_ = now;
    if (now - *cool_since_ < kCoolStep) return;
    every_ = std::max(every_ - 1, 1);
    cool_since_ = now;
  }
}

}  // namespace comap
