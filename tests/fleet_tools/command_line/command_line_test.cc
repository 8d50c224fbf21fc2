// The whole command line of `fleet`: examples, completion, manual pages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <set>
#include <sstream>

#include "fleet_tools/command_line/fleet_app.h"
#include "protocol/program/command_description.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::Not;

class CommandLine : public testing::Test {
 protected:
  // What a command prints, and its exit code.
  static std::pair<int, std::string> shell(const std::string& command) {
    FILE* pipe = popen((command + " 2>&1").c_str(), "r");
    std::string out;
    std::array<char, 4096> buffer;
    for (size_t got = 0; (got = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) out.append(buffer.data(), got);
    const int status = pclose(pipe);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, out};
  }
  // What bash offers for the last of these words.
  std::set<std::string> offered(const std::string& words) {
    const std::string script = folder_.write("completion.bash", bashCompletion(*app_));
    const auto [code, out] = shell("bash -c 'source " + script + "; COMP_WORDS=(" + words +
                                   "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _fleet; printf \"%s\\n\" "
                                   "\"${COMPREPLY[@]}\"'");
    EXPECT_EQ(code, 0) << out;
    std::istringstream in(out);
    std::set<std::string> found;
    for (std::string line; std::getline(in, line);) found.insert(line);
    return found;
  }

  int exit_code_ = 0;
  std::unique_ptr<CLI::App> app_ = makeFleetApp(exit_code_);
  const TemporaryFolder folder_;
};

TEST_F(CommandLine, EveryVerbSaysWhatItDoesAndGivesAnExample) {
  size_t verbs = 0;
  for (const auto& [path, verb] : verbsOf(*app_)) {
    ++verbs;
    EXPECT_FALSE(verb->get_description().empty()) << path;
    // A verb with verbs of its own may leave the example to them, or give one for all.
    const std::string top = path.substr(0, path.find(' '));
    const std::string help = app_->get_subcommand(top)->help() + verb->help();
    const size_t example = help.find("\nExample");
    ASSERT_NE(example, std::string::npos) << path;
    EXPECT_THAT(help.substr(example), HasSubstr("fleet " + top)) << path;
    for (const OptionWords& option : optionsOf(*verb))
      EXPECT_FALSE(option.text.empty()) << path << " " << option.positional;
  }
  EXPECT_GT(verbs, 15u);
}

TEST_F(CommandLine, BashCompletesVerbsOptionsAndValues) {
  std::set<std::string> verbs;
  for (const CLI::App* verb : app_->get_subcommands({})) verbs.insert(verb->get_name());
  EXPECT_THAT(offered("fleet \"\""), IsSupersetOf(verbs));
  EXPECT_EQ(offered("fleet exp"), std::set<std::string>{"export"});
  EXPECT_EQ(offered("fleet export map.comap --form"), std::set<std::string>{"--format"});
  EXPECT_EQ(offered("fleet export map.comap --format \"\""),
            (std::set<std::string>{"glb", "mcap", "ply", "tiles3d", "tum"}));
  EXPECT_EQ(offered("fleet export map.comap --format g"), std::set<std::string>{"glb"});
  folder_.write("my.comap", "");
  EXPECT_THAT(offered("fleet info " + folder_.path("my")), Contains(folder_.path("my.comap")));
  const CLI::App* keys = app_->get_subcommand("keys");
  ASSERT_FALSE(keys->get_subcommands({}).empty());
  const CLI::App* below = keys->get_subcommands({}).front();
  EXPECT_THAT(offered("fleet keys \"\""), Contains(below->get_name()));
  EXPECT_THAT(offered("fleet keys " + below->get_name() + " --"), Not(Contains("--format")));
  EXPECT_THAT(offered("fleet keys " + folder_.path("my")), Not(Contains(folder_.path("my.comap")))) << "a verb comes";
  EXPECT_THAT(offered("fleet keys " + below->get_name() + " " + folder_.path("my")),
              Contains(folder_.path("my.comap")));
  EXPECT_EQ(offered("fleet synth --scene fl"), std::set<std::string>{"flat"});
}

TEST_F(CommandLine, TheZshScriptNamesEveryVerbAndParses) {
  const std::string script = zshCompletion(*app_);
  EXPECT_TRUE(script.starts_with("#compdef fleet\n"));
  for (const auto& [path, verb] : verbsOf(*app_)) EXPECT_THAT(script, HasSubstr(verb->get_name() + ":")) << path;
  if (shell("command -v zsh").first != 0) GTEST_SKIP() << "no zsh here to parse it";
  const auto [code, out] = shell("zsh -n " + folder_.write("_fleet", script));
  EXPECT_EQ(code, 0) << out;
}

TEST_F(CommandLine, ManualPagesHoldEveryOption) {
  for (const auto& [path, verb] : verbsOf(*app_)) {
    const std::string page = manPage(*verb, "fleet " + path);
    EXPECT_TRUE(page.starts_with(".TH FLEET-")) << path;
    for (const char* section : {".SH NAME\n", ".SH SYNOPSIS\n", ".SH OPTIONS\n"}) EXPECT_THAT(page, HasSubstr(section));
    for (const OptionWords& option : optionsOf(*verb))
      for (std::string name : option.names) {
        for (size_t at = 0; (at = name.find('-', at)) != std::string::npos; at += 2) name.insert(at, 1, '\\');
        EXPECT_THAT(page, HasSubstr(name)) << path;
      }
  }
  EXPECT_THAT(manPage(*app_, "fleet"), HasSubstr(".SH VERBS"));
}

}  // namespace
}  // namespace comap
