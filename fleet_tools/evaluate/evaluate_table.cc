#include "fleet_tools/evaluate/evaluate_table.h"

#include <algorithm>
#include <filesystem>

#include "fleet_tools/command_line/text_table.h"

namespace comap {

namespace fs = std::filesystem;

RunNumbers numbersOf(const RunEvaluation& evaluation) {
  RunNumbers numbers;
  for (const auto& [name, robot] : evaluation.robots)
    numbers[0] = std::max(numbers[0].value_or(0), robot.own.ate.rmse_m);
  if (evaluation.joint) numbers[1] = evaluation.joint->rmse_m;
  if (evaluation.surface) {
    numbers[2] = evaluation.surface->accuracy_mean_m;
    numbers[3] = evaluation.surface->completeness_2cm;
  }
  if (evaluation.closures) {
    numbers[4] = evaluation.closures->precision();
    numbers[5] = evaluation.closures->queryRecall();
    numbers[6] = static_cast<double>(evaluation.closures->false_merges);
    numbers[7] = evaluation.closures->first_merge_s;
  }
  return numbers;
}

RunSummary summarise(const std::vector<RunNumbers>& runs) {
  RunSummary summary;
  for (size_t column = 0; column < kRunColumns.size(); ++column) {
    std::vector<double> values;
    for (const RunNumbers& run : runs)
      if (run[column]) values.push_back(*run[column]);
    if (values.empty()) continue;
    std::sort(values.begin(), values.end());
    const size_t half = values.size() / 2;
    summary.median[column] = values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
    if (values.size() < runs.size()) continue;
    summary.worst[column] = kRunColumns[column].more_is_worse ? values.back() : values.front();
  }
  return summary;
}

std::string tableOf(const std::vector<std::string>& names, const std::vector<RunNumbers>& runs) {
  std::vector<std::string> head = {"run"};
  for (const RunColumn& column : kRunColumns) head.emplace_back(column.head);
  TextTable table(head);
  const auto add = [&](const std::string& name, const RunNumbers& numbers) {
    std::vector<std::string> cells = {name};
    for (size_t i = 0; i < numbers.size(); ++i)
      cells.push_back(numbers[i] ? fixed(*numbers[i], kRunColumns[i].decimals) : std::string("-"));
    table.add(cells);
  };
  for (size_t i = 0; i < runs.size(); ++i) add(printable(names[i]), runs[i]);
  const RunSummary summary = summarise(runs);
  add("median", summary.median);
  add("worst", summary.worst);
  return table.text();
}

nlohmann::json toJson(const RunNumbers& numbers) {
  nlohmann::json json;
  for (size_t i = 0; i < numbers.size(); ++i)
    json[kRunColumns[i].key] = numbers[i] ? nlohmann::json(*numbers[i]) : nlohmann::json(nullptr);
  return json;
}

Result<std::vector<std::string>> runsIn(const std::string& run) {
  std::error_code problem;
  const fs::path folder(run);
  if (fs::exists(folder / "report.json", problem)) return std::vector<std::string>{run};
  std::vector<std::string> runs;
  for (int seed = 1; fs::exists(folder / ("seed-" + std::to_string(seed)) / "report.json", problem); ++seed)
    runs.push_back((folder / ("seed-" + std::to_string(seed))).string());
  if (runs.empty()) {
    return Error{ErrorCode::kUnreachable, run + ": holds neither report.json nor a run seed-1"};
  }
  return runs;
}

}  // namespace comap
