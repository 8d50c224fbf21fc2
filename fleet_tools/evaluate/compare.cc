#include "fleet_tools/evaluate/compare.h"

#include <algorithm>
#include <cmath>

#include "fleet_tools/command_line/text_table.h"

namespace comap {
namespace {

using nlohmann::json;

const json* at(const json& from, std::initializer_list<const char*> path) {
  const json* here = &from;
  for (const char* key : path) {
    if (!here->is_object() || !here->contains(key)) return nullptr;
    here = &(*here)[key];
  }
  return here;
}

json number(const json& from, std::initializer_list<const char*> path) {
  const json* found = at(from, path);
  return found && found->is_number() ? *found : json(nullptr);
}

// Robots of the map with the most surfels, which is that of map.ply, of doubles and of the pictures.
json robotsOfLargest(const json& report) {
  json robots = nullptr;
  double most = -1;
  if (const json* maps = at(report, {"maps"}); maps && maps->is_array())
    for (const json& map : *maps) {
      const json surfels = number(map, {"surfels"});
      if (!surfels.is_number() || surfels.get<double>() <= most || !map.contains("robots")) continue;
      most = surfels.get<double>();
      robots = map["robots"];
    }
  return robots;
}

// Remedies that a run of the paper mode had, by their names on the command line.
json fixesOf(const json& report) {
  json names = json::array();
  if (const json* fixes = at(report, {"fixes"}); fixes && fixes->is_object())
    for (const auto& [key, on] : fixes->items()) {
      if (!on.is_boolean() || !on.get<bool>()) continue;
      std::string name = key;
      std::replace(name.begin(), name.end(), '_', '-');
      names.push_back(name);
    }
  return names;
}

// What both modes tell of a run.
json numbersOf(const json& report) {
  json numbers;
  double frames = 0, bytes = 0;
  for (const char* key : {"ate_rmse_m", "ate_pairs", "ate_reason", "frames_of", "lost_frames"})
    numbers[key] = json::object();
  if (const json* robots = at(report, {"robots"}); robots && robots->is_object()) {
    for (const auto& [name, robot] : robots->items()) {
      numbers["ate_rmse_m"][name] = number(robot, {"ate_rmse_m"});
      numbers["ate_pairs"][name] = number(robot, {"ate_pairs"});
      numbers["frames_of"][name] = number(robot, {"frames"});
      numbers["lost_frames"][name] = number(robot, {"tracking_lost_frames"});
      const json* reason = at(robot, {"ate_reason"});
      if (reason && reason->is_string()) numbers["ate_reason"][name] = *reason;
      frames += robot.value("frames", 0.0);
      bytes += robot.value("uplink_bytes", 0.0);
    }
  }
  const auto count = [&](const char* key) {
    const json* list = at(report, {key});
    return list && list->is_array() ? json(list->size()) : json(nullptr);
  };
  numbers["joint_ate_rmse_m"] = number(report, {"joint_ate_rmse_m"});
  numbers["surface_mean_m"] = number(report, {"surface", "accuracy_mean_m"});
  numbers["completeness_2cm"] = number(report, {"surface", "completeness_2cm"});
  numbers["double_surface"] = number(report, {"double_surface"});
  for (const char* key : {"joint_ate_reason", "surface_reason"}) {
    const json* reason = at(report, {key});
    numbers[key] = reason && reason->is_string() ? *reason : json(nullptr);
  }
  numbers["largest_map"] = robotsOfLargest(report);
  numbers["fixes"] = fixesOf(report);
  numbers["maps"] = count("maps");
  numbers["merges"] = count("merges");
  numbers["false_merges"] = number(report, {"closures", "false_merges_standing"});
  numbers["frames"] = frames;
  numbers["uplink_bytes"] = bytes;
  numbers["uplink_bytes_per_frame"] = frames > 0 ? json(bytes / frames) : json(nullptr);
  const json wall = number(report, {"wall_s"});
  numbers["wall_ms_per_frame"] =
      frames > 0 && wall.is_number() ? json(1000 * wall.get<double>() / frames) : json(nullptr);
  numbers["round_ms"] = at(report, {"core", "round_ms"}) ? *at(report, {"core", "round_ms"}) : json(nullptr);
  numbers["core_frame_ms"] = at(report, {"core", "frame_ms"}) ? *at(report, {"core", "frame_ms"}) : json(nullptr);
  numbers["core_keyframe_ms"] =
      at(report, {"core", "keyframe_ms"}) ? *at(report, {"core", "keyframe_ms"}) : json(nullptr);
  return numbers;
}

std::string cell(const json& value, double scale, int decimals) {
  return value.is_number() ? fixed(scale * value.get<double>(), decimals) : "-";
}

std::string listText(const json& names) {
  std::string text;
  for (const json& name : names) text += (text.empty() ? "" : ", ") + name.get<std::string>();
  return text;
}

std::string robotsText(const json& robots) { return (robots.size() == 1 ? "robot " : "robots ") + listText(robots); }

struct Said {
  bool accurate = true;
  std::vector<std::string> words;
};

// `graph` may not be larger than `paper`; a tenth of a millimetre is no difference.
void compareOne(const std::string& what, const json& graph, const json& paper, double tolerance, Said& said) {
  if (!paper.is_number()) return;
  if (!graph.is_number()) {
    said.accurate = false;
    said.words.push_back(what + ": the graph mode has none, the paper mode " + paper.dump());
    return;
  }
  if (graph.get<double>() <= paper.get<double>() + tolerance) return;
  said.accurate = false;
  said.words.push_back(what + ": graph mode " + fixed(graph.get<double>(), 4) + ", paper mode " +
                       fixed(paper.get<double>(), 4));
}

// What must be known of a robot's pair of errors: that one is missing, or that they are not of the same frames.
void noteRobot(const std::string& what, const std::string& robot, const json& graph, const json& paper, json& notes) {
  const auto hasNone = [&](const json& numbers) {
    return !numbers["ate_rmse_m"].value(robot, json()).is_number() && !numbers["ate_reason"].contains(robot);
  };
  if (hasNone(graph) && hasNone(paper)) notes.push_back(what + ": no truth is known of " + robot);
  for (const auto& [mode, numbers] : {std::pair("graph", &graph), std::pair("paper", &paper)}) {
    if (numbers->at("ate_reason").contains(robot))
      notes.push_back(what + ", ATE of " + robot + ", " + mode + " mode: none, " +
                      numbers->at("ate_reason").at(robot).get<std::string>());
    const json lost = numbers->at("lost_frames").value(robot, json());
    if (lost.is_number() && lost.get<double>() > 0)
      notes.push_back(what + ", " + mode + " mode: " + robot + " was lost in " + lost.dump() + " of " +
                      numbers->at("frames_of").value(robot, json()).dump() + " frames");
  }
  const json one = graph["ate_pairs"].value(robot, json()), other = paper["ate_pairs"].value(robot, json());
  if (!one.is_number() || !other.is_number() || one == other) return;
  notes.push_back(what + ", ATE of " + robot + ": of " + one.dump() + " poses in the graph mode, of " + other.dump() +
                  " in the paper mode");
}

// Of a row: what it is measured on, where that is not all of it.
void noteRow(const std::string& what, const json& graph, const json& paper, json& notes) {
  for (const auto& [mode, numbers] : {std::pair("graph", &graph), std::pair("paper", &paper)}) {
    const json& maps = numbers->at("maps");
    if (maps.is_number() && maps.get<double>() > 1 && numbers->at("largest_map").is_array())
      notes.push_back(what + ", " + mode + " mode: doubles and pictures are of the largest of " + maps.dump() +
                      " maps, " + robotsText(numbers->at("largest_map")));
    if (numbers->at("surface_reason").is_string() && !numbers->at("joint_ate_reason").is_null())
      notes.push_back(what + ", joint ATE and surface, " + mode + " mode: none, " +
                      numbers->at("joint_ate_reason").get<std::string>());
  }
  if (graph["largest_map"] != paper["largest_map"])
    notes.push_back(what + ": the largest map is not of the same robots in both modes, so doubles are not compared");
}

// Why no trajectory has an error.
std::string whyUnknown(const json& inputs) {
  for (const json& input : inputs)
    for (const char* mode : {"graph", "paper"})
      for (const auto& [robot, reason] : input.at(mode).at("ate_reason").items())
        return "no trajectory can be measured (" + robot + ": " + reason.get<std::string>() + ")";
  return "there is no truth";
}

// A share in percent; near a tenth with so many decimals that it shows on which side it lies.
std::string percent(double share) { return fixed(100 * share, std::abs(share - 0.1) < 0.001 ? 3 : 1) + " %"; }

}  // namespace

std::vector<std::pair<std::string, json>> rowsOf(const json& input) {
  std::string published = "paper";
  for (const json& fix : input.at("paper").at("fixes")) published += " + " + fix.get<std::string>();
  std::vector<std::pair<std::string, json>> rows = {{"graph", input.at("graph")}, {published, input.at("paper")}};
  for (const json& remedy : input.at("remedies"))
    rows.emplace_back("+ " + remedy.at("name").get<std::string>(), remedy.at("numbers"));
  return rows;
}

std::string framesText(const json& numbers) {
  std::string text;
  for (const auto& [robot, frames] : numbers.at("frames_of").items())
    text += (text.empty() ? "" : " ") + robot + ":" + cell(numbers.at("ate_pairs").value(robot, json()), 1, 0) + "/" +
            cell(frames, 1, 0);
  return text;
}

json compareJson(const std::vector<ComparedInput>& inputs) {
  json comparison = {{"inputs", json::array()}, {"not_so", json::array()}, {"notes", json::array()}};
  bool accurate = true, known = false, tenth = true;
  for (const ComparedInput& input : inputs) {
    const json graph = numbersOf(input.graph), paper = numbersOf(input.paper);
    Said said;
    constexpr double kSame_m = 1e-4;
    for (const auto& [robot, ate] : paper["ate_rmse_m"].items())
      compareOne(input.name + ", ATE of " + robot + " (m)", graph["ate_rmse_m"].value(robot, json()), ate, kSame_m,
                 said);
    compareOne(input.name + ", surface (m)", graph["surface_mean_m"], paper["surface_mean_m"], kSame_m, said);
    constexpr double kSameShare = 5e-4;
    if (graph["largest_map"] == paper["largest_map"])
      compareOne(input.name + ", doubles (share)", graph["double_surface"], paper["double_surface"], kSameShare, said);
    // Maps that only a wrong match has put together are no merit, and an error across them no standard.
    const auto falseMerges = [](const json& numbers) {
      return numbers["false_merges"].is_number() ? numbers["false_merges"].get<double>() : 0.0;
    };
    if (falseMerges(paper) <= falseMerges(graph)) {
      if (paper["ate_rmse_m"].size() > 1)  // else it is the own one
        compareOne(input.name + ", joint ATE (m)", graph["joint_ate_rmse_m"], paper["joint_ate_rmse_m"], kSame_m, said);
      compareOne(input.name + ", maps", graph["maps"], paper["maps"], 0, said);
    }
    compareOne(input.name + ", false merges", graph["false_merges"], paper["false_merges"], 0, said);
    const double share = graph["uplink_bytes"].get<double>() / std::max(1.0, paper["uplink_bytes"].get<double>());
    if (share > 0.1) {
      tenth = false;
      said.words.push_back(input.name + ", bytes sent: the graph mode sends " + percent(share) +
                           " of what the paper mode sends, not a tenth");
    }
    accurate = accurate && said.accurate;
    for (const json* mode : {&graph, &paper})
      for (const auto& [robot, ate] : (*mode)["ate_rmse_m"].items()) known = known || ate.is_number();
    for (const auto& [robot, ate] : paper["ate_rmse_m"].items())
      noteRobot(input.name, robot, graph, paper, comparison["notes"]);
    noteRow(input.name, graph, paper, comparison["notes"]);
    json remedies = json::array();
    for (const auto& [name, report] : input.remedies)
      remedies.push_back({{"name", name}, {"numbers", numbersOf(report)}});
    comparison["inputs"].push_back(
        {{"name", input.name}, {"graph", graph}, {"paper", paper}, {"remedies", remedies}, {"bytes_share", share}});
    for (const std::string& word : said.words) comparison["not_so"].push_back(word);
  }
  if (const json fixes = inputs.empty() ? json::array() : fixesOf(inputs.front().paper); !fixes.empty())
    comparison["notes"].push_back("the paper mode is not as published, but with " + listText(fixes));
  comparison["not_known_because"] = known ? json(nullptr) : json(whyUnknown(comparison["inputs"]));
  comparison["at_least_as_accurate"] = known ? json(accurate) : json(nullptr);
  comparison["a_tenth_of_the_bytes"] = tenth;
  return comparison;
}

std::string compareText(const json& comparison) {
  TextTable table({"input", "mode", "ATE own (m)", "ATE joint", "surface", "doubles %", "maps", "merges", "false",
                   "poses/frames", "MB sent", "kB/frame", "ms/frame"});
  for (const json& input : comparison.at("inputs"))
    for (const auto& [mode, n] : rowsOf(input)) {
      std::string own;
      for (const auto& [robot, ate] : n.at("ate_rmse_m").items())
        own += (own.empty() ? "" : " ") + robot + ":" + cell(ate, 1, 4);
      table.add({printable(input.at("name").get<std::string>()), mode, printable(own),
                 cell(n["joint_ate_rmse_m"], 1, 4), cell(n["surface_mean_m"], 1, 4), cell(n["double_surface"], 100, 2),
                 cell(n["maps"], 1, 0), cell(n["merges"], 1, 0), cell(n["false_merges"], 1, 0),
                 printable(framesText(n)), cell(n["uplink_bytes"], 1e-6, 1), cell(n["uplink_bytes_per_frame"], 1e-3, 1),
                 cell(n["wall_ms_per_frame"], 1, 0)});
    }
  std::string text = table.text();
  const json& accurate = comparison.at("at_least_as_accurate");
  text +=
      "graph mode at least as accurate in each row: " +
      std::string(accurate.is_null() ? "not known, " + printable(comparison.at("not_known_because").get<std::string>())
                  : accurate.get<bool>() ? "yes"
                                         : "no") +
      "\n";
  text += "graph mode sends at most a tenth of the bytes: " +
          std::string(comparison.at("a_tenth_of_the_bytes").get<bool>() ? "yes" : "no") + "\n";
  for (const json& word : comparison.at("not_so")) text += "  " + printable(word.get<std::string>()) + "\n";
  for (const json& note : comparison.at("notes")) text += "note: " + printable(note.get<std::string>()) + "\n";
  return text;
}

}  // namespace comap
