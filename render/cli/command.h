// A subcommand of the program: the words it reads from the command line, and what it does with them.
//
// One file a subcommand (run.cpp, check.cpp, ...): `Command add_NAME(Program&)` declares the words and returns the action.
// A new one is declared in commands.h and listed in main.cpp. Actions print results to stdout and progress to stderr (terminal.h);
// they return the exit code (0 done, 1 failed or different) and let every exception through: main has the only catch.
// CLI11 parses. It has headers only, 4 to 6 CPU seconds of compiler in every file that includes them: command.cpp alone does.
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace flexframe::cli {

// An option or file that has been declared. A value that breaks a rule is refused when the words are parsed.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}
  static bool is_number(const std::string& item);

  Option& required();
  Option& as(const char* form);  // what stands behind the option in --help: WxH, FILE; default: N for numbers, TEXT
  Option& range(int low, int high);
  Option& range(double low, double high);
  Option& positive();
  Option& not_negative();
  Option& one_of(std::initializer_list<const char*> words);
  Option& one_of(std::initializer_list<int> numbers);
  Option& excludes(const char* name);   // one declared before that must not be given beside it
  Option& value_or(const char* value);  // the value may be left out, which means this one
  Option& separated_by(char between);   // a list in one word
  // A list by comma or space alike: words that follow belong to it as long as `item` takes them. The value is one word, by commas.
  Option& list(std::function<bool(const std::string& item)> item);
  Option& one_word();                         // words behind it are not part of the list
  Option& environment(const char* variable);  // the value where the option is not given
  Option& show_default();                     // the variable's value as it is now, in --help

 private:
  CLI::Option* option_;
};

class Subcommand {
 public:
  explicit Subcommand(CLI::App* app) : app_(app) {}

  // "-o,--out", or "FILE" for one without dashes; its value goes to `value`, which must outlive parsing. T: std::string, int, double,
  // std::optional of a number, std::vector of int or std::string.
  template <class T>
  Option option(const char* names, T& value, const std::string& text);
  void flag(const char* names, bool& value, const std::string& text);
  void footer(const char* text);                      // below the options in --help
  void example(const char* words, const char* what);  // below that: what stands behind "flexframe COMMAND", and what it does

  bool given() const;
  bool given(const char* option) const;  // false for an option that it has not

 private:
  CLI::App* app_;
};

// The program's own words: one subcommand, --help, --version.
class Program {
 public:
  // version: what --version prints, made when it is asked for.
  Program(const char* name, const char* description, const std::function<std::string()>& version);
  ~Program();
  Subcommand subcommand(const char* name, const char* text);

  // False where --help or --version asked for no more than what is now printed. Throws UsageError. Sets verbosity (terminal.h).
  bool parse(int argc, char** argv);

 private:
  [[noreturn]] void refuse(const std::string& problem, const std::string& command) const;
  std::vector<std::string> with_joined_lists(int argc, char** argv) const;

  std::unique_ptr<CLI::App> app_;
  bool quiet_ = false, verbose_ = false;
};

struct Command {
  Subcommand words;
  std::function<int()> action;  // called when these words were given
  bool answers = false;         // what it prints is all that it does: printed under --quiet too
};

// Words that cannot be parsed or make no sense together: exit 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace flexframe::cli
