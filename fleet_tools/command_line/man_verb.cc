#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/export/staged_files.h"
#include "protocol/program/command_description.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

Result<size_t> writePages(const CLI::App& app, const fs::path& folder) {
  auto verbs = verbsOf(app);
  for (auto& [path, verb] : verbs) path.insert(0, app.get_name() + " ");
  verbs.insert(verbs.begin(), {app.get_name(), &app});
  StagedFiles files;
  if (const auto made = files.makeFolder(folder); !made) return made.error();
  for (const auto& [path, verb] : verbs) {
    std::string name = path;
    std::replace(name.begin(), name.end(), ' ', '-');
    const fs::path file = folder / (name + ".1");
    std::ofstream out(files.stage(file));
    out << manPage(*verb, path);
    out.flush();
    if (!out) return Error{ErrorCode::kUnreachable, file.string() + ": cannot be written"};
  }
  if (const auto committed = files.commit(); !committed) return committed.error();
  return verbs.size();
}

}  // namespace

void addManVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("man", "Manual pages of fleet and its verbs, as files");
  verb->footer("Example: fleet man man1 && man man1/fleet-view.1");
  auto folder = std::make_shared<std::string>();
  verb->add_option("DIR", *folder, "Folder to write them to, made if it is not there")->required();
  verb->callback([&app, folder, &exit_code] {
    const auto written = writePages(app, *folder);
    exit_code = written ? 0 : failWith(written.error());
    if (written) std::printf("%zu pages in %s\n", *written, folder->c_str());
  });
}

}  // namespace comap
