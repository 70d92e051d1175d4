#include "harness/cli/shell_help.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <map>

#include "harness/cli/commands.h"

namespace nullmark {
namespace {

/// Words that a command takes in place of a file.
const std::map<std::string, std::string>& words_of_commands() {
  const auto joined = [](const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); };
  static const std::map<std::string, std::string> kWords = {
      {"list", joined(kLists)}, {"schema", joined(kSchemas)}, {"completion", joined(completed_shells())}};
  return kWords;
}

std::string replaced(std::string text, const std::map<char, std::string>& by) {
  std::string result;
  for (const char c : text) {
    const auto at = by.find(c);
    result += at == by.end() ? std::string(1, c) : at->second;
  }
  return result;
}

std::vector<const CLI::App*> commands_of(const CLI::App& program) {
  std::vector<const CLI::App*> commands;
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; })) commands.push_back(command);
  return commands;
}

/// All but what stands by its place.
std::vector<const CLI::Option*> options_of(const CLI::App& command) {
  std::vector<const CLI::Option*> options;
  for (const CLI::Option* option : command.get_options())
    if (!option->get_lnames().empty()) options.push_back(option);
  return options;
}

bool takes_value(const CLI::Option& option) { return option.get_type_size() != 0; }

std::string names_of(const std::vector<const CLI::App*>& commands) {
  std::vector<std::string> names;
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  return fmt::format("{}", fmt::join(names, " "));
}

std::string bash_script(const CLI::App& program) {
  std::string cases;
  for (const CLI::App* command : commands_of(program)) {
    std::vector<std::string> names;
    for (const CLI::Option* option : options_of(*command)) names.push_back("--" + option->get_lnames()[0]);
    const auto words = words_of_commands().find(command->get_name());
    cases += fmt::format("    {}) options='{}' words='{}' ;;\n", command->get_name(), fmt::join(names, " "),
                         words == words_of_commands().end() ? "" : words->second);
  }
  return fmt::format(R"(# nullmark in bash: source <(nullmark completion bash)
_nullmark() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} options= words=
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W '{}' -- "$word"))
    return
  fi
  case ${{COMP_WORDS[1]}} in
{}  esac
  case $word in
    -*) COMPREPLY=($(compgen -W "$options" -- "$word")) ;;
    *) COMPREPLY=($(compgen -W "$words" -- "$word") $(compgen -f -- "$word")) ;;
  esac
}}
complete -o filenames -F _nullmark nullmark
)",
                     names_of(commands_of(program)), cases);
}

std::string zsh_script(const CLI::App& program) {
  const auto quoted = [](const std::string& text) {
    return replaced(text, {{'\'', "'\\''"}, {'[', "\\["}, {']', "\\]"}, {':', "\\:"}});
  };
  std::string commands, cases;
  for (const CLI::App* command : commands_of(program)) {
    commands += fmt::format(" '{}:{}'", command->get_name(), quoted(command->get_description()));
    cases += fmt::format("    {}) _arguments", command->get_name());
    for (const CLI::Option* option : options_of(*command))
      cases += fmt::format(" '--{}[{}]{}'", option->get_lnames()[0], quoted(option->get_description()),
                           takes_value(*option) ? ":value:_files" : "");
    const auto words = words_of_commands().find(command->get_name());
    cases += words == words_of_commands().end() ? " '*:file:_files' ;;\n" : fmt::format(" '*:word:({})' ;;\n", words->second);
  }
  return fmt::format(R"(#compdef nullmark
# nullmark in zsh: nullmark completion zsh > a folder of $fpath, as _nullmark
_nullmark() {{
  local -a commands=({})
  if (( CURRENT == 2 )); then
    _describe command commands
    return
  fi
  local command=$words[2]
  shift words
  (( CURRENT-- ))
  case $command in
{}  esac
}}
compdef _nullmark nullmark
)",
                     commands.substr(1), cases);
}

std::string fish_script(const CLI::App& program) {
  const auto quoted = [](const std::string& text) { return replaced(text, {{'\'', "\\'"}, {'\\', "\\\\"}}); };
  std::string text = "# nullmark in fish: nullmark completion fish | source\n";
  for (const CLI::App* command : commands_of(program)) {
    const std::string& name = command->get_name();
    text +=
        fmt::format("complete -c nullmark -n __fish_use_subcommand -f -a {} -d '{}'\n", name, quoted(command->get_description()));
    const auto words = words_of_commands().find(name);
    if (words != words_of_commands().end())
      text += fmt::format("complete -c nullmark -n '__fish_seen_subcommand_from {}' -f -a '{}'\n", name, words->second);
    for (const CLI::Option* option : options_of(*command)) {
      const std::string brief = option->get_snames().empty() ? "" : " -s " + option->get_snames()[0];
      text += fmt::format("complete -c nullmark -n '__fish_seen_subcommand_from {}' -l {}{}{} -d '{}'\n", name,
                          option->get_lnames()[0], brief, takes_value(*option) ? " -r" : "", quoted(option->get_description()));
    }
  }
  return text;
}

/// Text that troff prints as it is.
std::string troff(const std::string& text) {
  const std::string escaped = replaced(text, {{'\\', "\\e"}, {'-', "\\-"}});
  // A dot or an apostrophe at the beginning of a line is a request.
  return !escaped.empty() && (escaped[0] == '.' || escaped[0] == '\'') ? "\\&" + escaped : escaped;
}

std::string troff_options(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : command.get_options()) {
    std::string names = option->get_lnames().empty() ? option->get_name(true) : "";
    for (const std::string& name : option->get_snames()) names += (names.empty() ? "-" : ", -") + name;
    for (const std::string& name : option->get_lnames()) names += (names.empty() ? "--" : ", --") + name;
    text += fmt::format(".TP\n.B {}\n{}\n", troff(names), troff(option->get_description()));
  }
  return text;
}

}  // namespace

const std::vector<std::string>& completed_shells() {
  static const std::vector<std::string> kShells = {"bash", "zsh", "fish"};
  return kShells;
}

std::string completion_script(const CLI::App& program, const std::string& shell) {
  return shell == "bash" ? bash_script(program) : shell == "zsh" ? zsh_script(program) : fish_script(program);
}

std::string manual_page(const CLI::App& program, const std::string& version) {
  std::string commands;
  for (const CLI::App* command : commands_of(program))
    commands += fmt::format(".SS {}\n{}.\n{}", command->get_name(), troff(command->get_description()), troff_options(*command));
  return fmt::format(R"(.TH NULLMARK 1 "" "{}" "User Commands"
.SH NAME
nullmark \- {}
.SH SYNOPSIS
.B nullmark
.I COMMAND
.RI [ OPTIONS ]
.SH COMMANDS
{}.SH EXIT STATUS
.TP
.B 0
success; of
.B check
also: everything asked is proven
.TP
.B 1
an error of the program or of a cell
.TP
.B 2
wrong usage, configuration or input
.TP
.B 3
a bias is proven
.TP
.B 4
a performance regression is proven
.TP
.B 5
nothing ran, or nothing was judged
.TP
.B 77
undecided
.TP
.BR 130 ", " 143
interrupted, terminated
.SH ENVIRONMENT
.TP
.B NULLMARK_ALLOW_FOREIGN
1: configurations may run code from outside, as with \-\-allow\-foreign
)",
                     troff(version), troff(program.get_description()), commands);
}

}  // namespace nullmark
