#include <cstdio>
#include <memory>

#include "fleet_tools/command_line/verb.h"
#include "protocol/program/command_description.h"

namespace comap {

void addCompletionVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("completion", "A script that completes fleet's verbs and options in a shell");
  verb->footer(
      "For zsh, put it into a folder of $fpath as _fleet.\n"
      "Example: source <(fleet completion bash)");
  auto shell = std::make_shared<std::string>();
  verb->add_option("SHELL", *shell, "Which shell")->required()->check(CLI::IsMember({"bash", "zsh"}));
  verb->callback([&app, shell, &exit_code] {
    const std::string script = *shell == "bash" ? bashCompletion(app) : zshCompletion(app);
    std::fputs(script.c_str(), stdout);
    exit_code = 0;
  });
}

}  // namespace comap
