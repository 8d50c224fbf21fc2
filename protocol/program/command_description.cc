#include "protocol/program/command_description.h"

#include <algorithm>
#include <cctype>
#include <sstream>

namespace comap {
namespace {

// "TEXT:{a,b}" or "TEXT in {a,b}": how CLI11 shows a set of values.
std::vector<std::string> choicesIn(const std::string& type) {
  const size_t open = type.find('{'), close = type.find('}', open);
  if (open == std::string::npos || close == std::string::npos) return {};
  std::vector<std::string> choices;
  std::istringstream in(type.substr(open + 1, close - open - 1));
  for (std::string one; std::getline(in, one, ',');) choices.push_back(one.substr(0, one.find("->")));
  return choices;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

std::vector<std::string> namesOf(const CLI::App& command) {
  std::vector<std::string> names;
  for (const OptionWords& option : optionsOf(command))
    names.insert(names.end(), option.names.begin(), option.names.end());
  return names;
}

bool takesPositional(const CLI::App& command) {
  const auto options = optionsOf(command);
  return std::any_of(options.begin(), options.end(), [](const OptionWords& option) { return option.names.empty(); });
}

std::vector<std::string> verbNamesOf(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* verb : command.get_subcommands({})) names.push_back(verb->get_name());
  return names;
}

// Within single quotes of a shell.
std::string quoted(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return "'" + result + "'";
}

std::string zshText(std::string text) {
  for (char& c : text)
    if (c == '[' || c == ']' || c == ':') c = ' ';
  return text;
}

// Text of a manual page: no line may begin with a control character, backslashes and hyphens are themselves.
std::string troff(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if ((result.empty() || result.back() == '\n') && (c == '.' || c == '\'')) result += "\\&";
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else {
      result += c;
    }
  }
  return result;
}

}  // namespace

std::vector<OptionWords> optionsOf(const CLI::App& command) {
  std::vector<OptionWords> options;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_group().empty()) continue;  // hidden
    OptionWords words;
    for (const std::string& name : option->get_lnames()) words.names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) words.names.push_back("-" + name);
    if (words.names.empty()) words.positional = option->get_name(true);
    words.text = option->get_description();
    words.choices = choicesIn(option->get_type_name());
    words.takes_value = option->get_items_expected_max() > 0;
    words.required = option->get_required();
    options.push_back(std::move(words));
  }
  return options;
}

std::vector<std::pair<std::string, const CLI::App*>> verbsOf(const CLI::App& command) {
  std::vector<std::pair<std::string, const CLI::App*>> verbs;
  for (const CLI::App* verb : command.get_subcommands({})) {
    verbs.emplace_back(verb->get_name(), verb);
    for (const auto& [path, below] : verbsOf(*verb)) verbs.emplace_back(verb->get_name() + " " + path, below);
  }
  return verbs;
}

std::string bashCompletion(const CLI::App& app) {
  const std::string name = app.get_name();
  std::ostringstream out;
  out << "# bash completion of " << name << "; made by '" << name << " completion bash'\n_" << name << "() {\n"
      << "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} path= words= i\n"
      << "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
      << "    case \"$path ${COMP_WORDS[i]}\" in\n";
  for (const auto& [path, verb] : verbsOf(app)) {
    // The path so far, and the word that leads on from it.
    const size_t last = path.rfind(' ');
    const std::string above = last == std::string::npos ? std::string() : path.substr(0, last);
    const std::string own = last == std::string::npos ? path : path.substr(last + 1);
    out << "      " << quoted(above + " " + own) << ") path=" << quoted(path) << " ;;\n";
  }
  out << "    esac\n  done\n  case \"$path $before\" in\n";
  auto all = verbsOf(app);
  all.insert(all.begin(), {"", &app});
  for (const auto& [path, verb] : all) {
    for (const OptionWords& option : optionsOf(*verb)) {
      if (!option.takes_value || option.names.empty()) continue;
      for (const std::string& one : option.names) {
        out << "    " << quoted(path + " " + one) << ") ";
        if (option.choices.empty()) {
          out << "COMPREPLY=($(compgen -f -- \"$word\"))";
        } else {
          out << "COMPREPLY=($(compgen -W " << quoted(joined(option.choices, " ")) << " -- \"$word\"))";
        }
        out << "; return ;;\n";
      }
    }
  }
  out << "  esac\n  case \"$path\" in\n";
  for (const auto& [path, verb] : all) {
    auto words = verbNamesOf(*verb);
    const auto names = namesOf(*verb);
    words.insert(words.end(), names.begin(), names.end());
    out << "    " << quoted(path) << ") words=" << quoted(joined(words, " ")) << " ;;\n";
  }
  out << "  esac\n"
      << "  COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
      << "  case \"$path\" in\n";
  for (const auto& [path, verb] : all)
    if (takesPositional(*verb))
      out << "    " << quoted(path) << ") [[ $word == -* ]] || COMPREPLY+=($(compgen -f -- \"$word\")) ;;\n";
  out << "  esac\n"
      << "}\ncomplete -o filenames -F _" << name << " " << name << "\n";
  return out.str();
}

std::string zshCompletion(const CLI::App& app) {
  const std::string name = app.get_name();
  std::ostringstream out;
  out << "#compdef " << name << "\n# zsh completion of " << name << "; made by '" << name << " completion zsh'\n";
  const auto describe = [&](const CLI::App& command, const std::string& function) {
    const auto verbs = command.get_subcommands({});
    out << function << "() {\n  local context state state_descr line\n  typeset -A opt_args\n  _arguments -C";
    bool positional = false;
    for (const OptionWords& option : optionsOf(command)) {
      const std::string values =
          option.choices.empty() ? std::string("_files") : "(" + joined(option.choices, " ") + ")";
      const std::string text = zshText(option.text);
      for (const std::string& one : option.names)
        out << " \\\n    " << quoted(one + "[" + text + "]" + (option.takes_value ? ":value:" + values : ""));
      if (option.names.empty() && verbs.empty()) {
        out << " \\\n    " << quoted("*:" + zshText(option.positional) + ":" + values);
        positional = true;
      }
      if (positional) break;  // one pattern for all that follow
    }
    if (!verbs.empty()) out << " \\\n    '1:verb:->verb' \\\n    '*::argument:->argument'";
    out << "\n";
    if (!verbs.empty()) {
      out << "  case $state in\n    verb)\n      local -a verbs=(";
      for (const CLI::App* verb : verbs)
        out << "\n        " << quoted(verb->get_name() + ":" + zshText(verb->get_description()));
      out << "\n      )\n      _describe verb verbs ;;\n    argument)\n      case $line[1] in\n";
      for (const CLI::App* verb : verbs)
        out << "        " << verb->get_name() << ") " << function << "_" << verb->get_name() << " ;;\n";
      out << "      esac ;;\n  esac\n";
    }
    out << "}\n";
  };
  for (const auto& [path, verb] : verbsOf(app)) {
    std::string function = "_" + name + "_" + path;
    std::replace(function.begin(), function.end(), ' ', '_');
    describe(*verb, function);
  }
  describe(app, "_" + name);
  out << "_" << name << " \"$@\"\n";
  return out.str();
}

std::string manPage(const CLI::App& command, const std::string& path) {
  std::string title = path;
  std::replace(title.begin(), title.end(), ' ', '-');
  std::ostringstream out;
  std::string upper = title;
  std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) { return std::toupper(c); });
  out << ".TH " << upper << " 1 \"\" \"CoMap " COMAP_VERSION "\" \"CoMap\"\n.ad l\n.SH NAME\n"
      << troff(title) << " \\- " << troff(command.get_description()) << "\n.SH SYNOPSIS\n.B " << troff(path) << "\n";
  const auto options = optionsOf(command);
  const auto verbs = command.get_subcommands({});
  if (!verbs.empty()) out << ".I VERB\n";
  for (const OptionWords& option : options)
    if (option.names.empty())
      out << (option.required ? "" : "[") << option.positional << (option.required ? "" : "]") << "\n";
  out << "[\\fIOPTIONS\\fR]\n";
  if (!verbs.empty()) {
    out << ".SH VERBS\n";
    for (const CLI::App* verb : verbs)
      out << ".TP\n.B " << troff(verb->get_name()) << "\n" << troff(verb->get_description()) << "\n";
  }
  out << ".SH OPTIONS\n";
  for (const OptionWords& option : options) {
    out << ".TP\n\\fB" << troff(option.names.empty() ? option.positional : joined(option.names, ", ")) << "\\fR";
    if (option.takes_value && !option.names.empty()) {
      std::string value = option.choices.empty() ? "VALUE" : "";
      for (const std::string& choice : option.choices)
        value += (value.empty() ? "" : "|\\:") + troff(choice);  // \: lets a line end there
      out << " \\fI" << value << "\\fR";
    }
    out << "\n" << troff(option.text) << "\n";
  }
  if (!command.get_footer().empty()) out << ".SH NOTES\n.nf\n" << troff(command.get_footer()) << "\n.fi\n";
  std::string above = path.substr(0, path.find(' '));
  if (above != path) out << ".SH SEE ALSO\n" << troff(above) << "(1)\n";
  return out.str();
}

}  // namespace comap
