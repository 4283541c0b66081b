// A subcommand of the program: the words it reads from the command line, and what it does with them.
//
// One file a subcommand (run.cpp, check.cpp, ...): `Command add_NAME(CLI::App&)` declares the words and returns the action.
// A new one is declared in commands.h and listed in main.cpp. Actions print results to stdout and progress to stderr (terminal.h);
// they return the exit code (0 done, 1 failed or different) and let every exception through: main has the only catch.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <stdexcept>

namespace flexframe::cli {

struct Command {
  CLI::App* words = nullptr;
  std::function<int()> action;  // called when these words were given
};

// Words that parse but make no sense together: exit 2, with a hint at --help.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace flexframe::cli
