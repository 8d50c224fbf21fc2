#include "edge_agent/capture/capture_commands.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "edge_agent/capture/depth_colours.h"
#include "edge_agent/capture/edge_agreement.h"
#include "edge_agent/capture/image_file.h"
#include "edge_agent/capture/source_uri.h"
#include "edge_agent/capture/tum_writer.h"

namespace comap {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds kPatience{10};
constexpr std::chrono::milliseconds kTurn{100};
constexpr int kSettled = 10;

// The next whole frame; nullopt at the end of the source.
Result<std::optional<Frame>> awaitFrame(FrameSource& source, const CaptureLog& log) {
  const auto deadline = Clock::now() + kPatience;
  std::string problem;
  while (Clock::now() < deadline) {
    if (!source.ready(kTurn)) continue;
    auto next = source.next();
    if (next) return next;
    if (!source.live()) return next;
    log("frame passed over: " + next.error().text);
    problem = next.error().text;
  }
  const auto health = source.health();
  if (problem.empty() && health) problem = toString(*health);
  if (health && health->unpaired > 0)
    problem += ": colour and depth pictures lie farther apart than camera.pair_gap_ms allows";
  return Error{ErrorCode::kUnreachable,
               "no frame in " + std::to_string(kPatience.count()) + " s" + (problem.empty() ? "" : ": " + problem)};
}

std::string describe(const Frame& frame) {
  const size_t with_depth = frame.depth.size() - static_cast<size_t>(std::count(
                                                     frame.depth.data(), frame.depth.data() + frame.depth.size(), 0));
  return fmt::format("{}x{}, fx {:.1f} fy {:.1f} cx {:.1f} cy {:.1f}, depth in {:.0f} % of the pixels",
                     frame.camera.width, frame.camera.height, frame.camera.fx, frame.camera.fy, frame.camera.cx,
                     frame.camera.cy,
                     100.0 * static_cast<double>(with_depth) / static_cast<double>(frame.depth.size()));
}

}  // namespace

void listSources() {
  for (const std::string& line : knownSources()) std::printf("%s\n", line.c_str());
  const auto found = camerasFound();
  std::printf("\n%s\n", found.empty() ? "No cameras were found." : "Cameras found:");
  for (const std::string& line : found) std::printf("%s\n", line.c_str());
}

Result<void> preview(FrameSource& source, const std::string& file, const CaptureLog& log) {
  std::optional<Frame> frame;
  for (int i = 0; i < (source.live() ? kSettled : 1); ++i) {
    auto next = awaitFrame(source, log);
    if (!next) return next.error();
    if (!*next) break;
    frame = std::move(**next);
  }
  if (!frame) return Error{ErrorCode::kUnreachable, "the source has no frame"};
  const int width = frame->colour.width(), height = frame->colour.height();
  ColourImage both(2 * width, height);
  for (int y = 0; y < height; ++y) {
    std::copy_n(frame->colour.row(y), width, both.row(y));
    for (int x = 0; x < width; ++x) both.at(width + x, y) = depthColour(frame->depth.at(x, y));
  }
  if (auto written = writeColourPng(file, both); !written) return written;
  log(file + ": " + describe(*frame));
  return {};
}

Result<void> checkCalibration(FrameSource& source, const std::string& file, const CaptureLog& log) {
  EdgeComparison comparison;
  std::optional<Frame> last;
  for (int i = 0; i < (source.live() ? 2 : 1) * kSettled; ++i) {
    auto next = awaitFrame(source, log);
    if (!next) return next.error();
    if (!*next) break;
    last = std::move(**next);
    if (!source.live() || i >= kSettled) comparison.add(*last);
  }
  if (!last) return Error{ErrorCode::kUnreachable, "the source has no frame"};
  if (auto written = writeColourPng(file, drawEdges(*last)); !written) return written;
  const EdgeAgreement found = comparison.result();
  if (!found.determined())
    return Error{
        ErrorCode::kProblem,
        fmt::format("{}: too few edges to tell ({} depth edges, contrast {:.2f}): look at near things in front "
                    "of far ones, that differ in colour",
                    file, found.edges, found.contrast)};
  if (found.out_of_reach)
    return Error{
        ErrorCode::kProblem,
        fmt::format("{}: colour and depth do not agree: they fit best {} pixels apart, as far as is searched, so "
                    "it may be more or no shift at all: look at camera.colour.fx, camera.depth.fx and "
                    "camera.depth_in_colour",
                    file, EdgeAgreement::kReach)};
  const std::string line = fmt::format(
      "depth has to move by {:.1f} pixels right and {:.1f} down to lie on the edges of the colour picture "
      "({} depth edges, contrast {:.2f})",
      found.offset_x_px, found.offset_y_px, found.edges, found.contrast);
  if (!found.agrees()) return Error{ErrorCode::kProblem, file + ": colour and depth do not agree: " + line};
  log(file + ": colour and depth agree: " + line);
  return {};
}

Result<void> record(FrameSource& source, const std::string& directory, size_t most, const std::function<bool()>& stop,
                    const CaptureLog& log) {
  auto writer = TumWriter::create(directory);
  if (!writer) return writer.error();
  log(source.description());
  while (!stop() && (most == 0 || writer->size() < most)) {
    if (!source.ready(kTurn)) continue;
    auto next = source.next();
    if (!next) {
      log("frame left out: " + next.error().text);
      continue;
    }
    if (!*next) break;
    if (auto added = writer->add(**next); !added) return added;
  }
  const auto health = source.health();
  log(fmt::format("{}: {} frames{}", directory, writer->size(), health ? "; " + toString(*health) : std::string()));
  if (writer->size() == 0) return Error{ErrorCode::kUnreachable, "nothing was recorded: no frame came"};
  return {};
}

}  // namespace comap
