#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/keys/keys_folder.h"

namespace comap {
namespace {

constexpr int kAuthorityYears = 20, kKeyDays = 730;

struct KeysArguments {
  std::string dir, site, name;
  int days = kKeyDays;
};

Validity validFor(int days) {
  const std::time_t now = std::time(nullptr);
  return {now - 3600, now + std::time_t{86400} * days};  // clocks of other machines may be late
}

int init(const KeysArguments& arguments) {
  if (auto made = makeKeysFolder(arguments.dir, arguments.site, validFor(365 * kAuthorityYears)); !made)
    return failWith(made.error());
  std::printf("%s: authority of site %s. Keep %s/authority/key.pem to yourself: who has it can make any key.\n",
              arguments.dir.c_str(), arguments.site.c_str(), arguments.dir.c_str());
  return 0;
}

int add(const KeysArguments& arguments, KeyRole role) {
  if (auto added = addParticipant(arguments.dir, role, arguments.name, validFor(arguments.days)); !added)
    return failWith(added.error());
  std::printf("%s/%s: keys of %s '%s', for %d days. Copy this folder to its machine and name it there: %s\n",
              arguments.dir.c_str(), arguments.name.c_str(), keyRoleName(role).c_str(), arguments.name.c_str(),
              arguments.days,
              role == KeyRole::kRobot  ? "edge_agent --keys FOLDER"
              : role == KeyRole::kCore ? "mapping_core --keys FOLDER"
                                       : "fleet watch --keys FOLDER, fleet view --live --keys FOLDER");
  return 0;
}

int revoke(const KeysArguments& arguments) {
  const auto others = revokeParticipant(arguments.dir, arguments.name);
  if (!others) return failWith(others.error());
  std::printf(
      "'%s' is revoked. Copy revoked.pem from these folders to the keys of their machines, the core's first; programs "
      "that run notice it within seconds:\n",
      arguments.name.c_str());
  for (const std::string& folder : *others) std::printf("  %s/revoked.pem\n", folder.c_str());
  return 0;
}

// One participant's own folder, or all of an authority's.
int show(const KeysArguments& arguments) {
  std::vector<std::string> folders;
  std::error_code ignored;
  if (std::filesystem::exists(credentialsIn(arguments.dir).certificate, ignored)) {
    folders = {arguments.dir};
  } else {
    const auto names = participantsIn(arguments.dir);
    if (!names) return failWith(names.error());
    for (const std::string& name : *names) folders.push_back(arguments.dir + "/" + name);
  }
  if (!arguments.name.empty()) {
    folders = {arguments.dir + "/" + arguments.name};
    if (!std::filesystem::exists(folders.front(), ignored))
      return failWith({ErrorCode::kWrongUse, arguments.dir + ": there are no keys of '" + arguments.name + "'"});
  }
  int worst = 0;
  for (const std::string& folder : folders) {
    const std::time_t now = std::time(nullptr);
    const auto facts = factsOf(credentialsIn(folder), now);
    if (!facts) {
      worst = std::max(worst, failWith(facts.error()));
      continue;
    }
    std::printf("%s: %s, valid from %s until %s, serial %s\n", folder.c_str(),
                printable(describe(facts->participant)).c_str(), facts->valid_from.c_str(), facts->valid_until.c_str(),
                facts->serial.c_str());
    if (const auto checked = checkCredentials(credentialsIn(folder), now); !checked) {
      std::printf("  does not count: %s\n", checked.error().text.c_str());
      if (!folder.starts_with(arguments.dir + "/revoked/")) worst = std::max(worst, 1);
    }
  }
  if (!folders.empty()) return worst;
  if (const auto site = siteOfKeys(arguments.dir); !site) return failWith(site.error());
  std::printf("%s: no keys yet\n", arguments.dir.c_str());
  return worst;
}

}  // namespace

void addKeysVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("keys", "Make the keys with which robots and core encrypt and know each other");
  verb->require_subcommand(1);
  verb->footer(
      "Example: fleet keys init site-keys --site flat\n"
      "         fleet keys add-core site-keys\n"
      "         fleet keys add-robot site-keys a\n"
      "         mapping_core --keys site-keys/core --core-site flat --interface eth0\n"
      "A folder of a participant is all its machine needs; site-keys/authority stays where it is.");
  auto arguments = std::make_shared<KeysArguments>();
  const auto part = [&](const char* name, const char* what) {
    auto* each = verb->add_subcommand(name, what);
    each->add_option("DIR", arguments->dir, "Folder of the site's keys")->required();
    return each;
  };
  const auto days = [&](CLI::App* each) {
    each->add_option("--days", arguments->days, "For so long the key is good")
        ->check(CLI::Range(1, 7300))
        ->capture_default_str();
  };
  auto* make = part("init", "Make an authority for a site");
  make->add_option("--site", arguments->site, "Name of the site, as in link.site: 1-64 of A-Z a-z 0-9 _ - .")
      ->required();
  make->callback([arguments, &exit_code] { exit_code = init(*arguments); });
  auto* robot = part("add-robot", "Make the keys of a robot");
  robot->add_option("NAME", arguments->name, "The robot's name")->required();
  days(robot);
  robot->callback([arguments, &exit_code] { exit_code = add(*arguments, KeyRole::kRobot); });
  for (const auto& [name, role, what] :
       {std::tuple("add-core", KeyRole::kCore, "Make the keys of the mapping core"),
        std::tuple("add-tool", KeyRole::kTool, "Make the keys of a tool that watches")}) {
    auto* each = part(name, what);
    each->add_option("NAME", arguments->name, "Its name; as its role unless given");
    days(each);
    each->callback([arguments, &exit_code, role] {
      if (arguments->name.empty()) arguments->name = keyRoleName(role);
      exit_code = add(*arguments, role);
    });
  }
  auto* gone = part("revoke", "A key counts no longer");
  gone->add_option("NAME", arguments->name, "Whose key")->required();
  gone->callback([arguments, &exit_code] { exit_code = revoke(*arguments); });
  auto* tell = part("show", "Whose keys there are, how long they are good, and whether they will do");
  tell->add_option("NAME", arguments->name, "Only this one");
  tell->callback([arguments, &exit_code] { exit_code = show(*arguments); });
}

}  // namespace comap
