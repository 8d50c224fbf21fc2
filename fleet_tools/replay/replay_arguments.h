// What a replay is asked for on the command line, and whether that can be done.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "fleet_tools/replay/replay.h"
#include "fleet_tools/replay/replay_compare.h"

namespace comap {

struct ReplayArguments {
  std::vector<std::string> robots;
  std::string link = "dds", mode = "graph";
  ReplayOptions options;
  PaperOptions paper;
  std::vector<std::string> fixes;
  CompareOptions compare;
  bool side_by_side = false, link_given = false, mode_given = false;
  std::vector<std::string> truths;
  int seeds = 0;  // 0: one run, in --out itself
  bool overwrite = false, json = false;
};

/// Adds the options that fill `arguments`, which must live until the command line is read.
void addReplayOptions(CLI::App& verb, ReplayArguments& arguments);

/// Before anything is made or started: whether the words agree, sources and keys can be read, and so on; fills what
/// follows from them, `options.robots` among it.
Result<void> checkReplay(ReplayArguments& arguments);

}  // namespace comap
