// The words of the command line: what CLI11 does for the program.
#include "render/cli/command.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <optional>
#include <vector>

namespace flexframe::cli {

Option& Option::required() {
  option_->required();
  return *this;
}

Option& Option::range(int low, int high) {
  option_->check(CLI::Range(low, high));
  return *this;
}

Option& Option::range(double low, double high) {
  option_->check(CLI::Range(low, high));
  return *this;
}

Option& Option::positive() {
  option_->check(CLI::PositiveNumber);
  return *this;
}

Option& Option::not_negative() {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}

Option& Option::one_of(std::initializer_list<const char*> words) {
  option_->check(CLI::IsMember(std::vector<std::string>(words.begin(), words.end())));
  return *this;
}

Option& Option::one_of(std::initializer_list<int> numbers) {
  option_->check(CLI::IsMember(std::vector<int>(numbers)));
  return *this;
}

Option& Option::excludes(const char* name) {
  option_->excludes(name);
  return *this;
}

Option& Option::value_or(const char* value) {
  option_->expected(0, 1)->default_str(value);
  return *this;
}

Option& Option::separated_by(char between) {
  option_->delimiter(between);
  return *this;
}

Option& Option::one_word() {
  option_->allow_extra_args(false);
  return *this;
}

Option& Option::environment(const char* variable) {
  option_->envname(variable);
  return *this;
}

Option& Option::show_default() {
  option_->capture_default_str();
  return *this;
}

template <class T>
Option Subcommand::option(const char* names, T& value, const std::string& text) {
  return Option(app_->add_option(names, value, text));
}
template Option Subcommand::option(const char*, std::string&, const std::string&);
template Option Subcommand::option(const char*, int&, const std::string&);
template Option Subcommand::option(const char*, double&, const std::string&);
template Option Subcommand::option(const char*, std::optional<int>&, const std::string&);
template Option Subcommand::option(const char*, std::optional<double>&, const std::string&);
template Option Subcommand::option(const char*, std::vector<int>&, const std::string&);
template Option Subcommand::option(const char*, std::vector<std::string>&, const std::string&);

void Subcommand::flag(const char* names, bool& value, const std::string& text) { app_->add_flag(names, value, text); }

void Subcommand::footer(const char* text) { app_->footer(text); }

bool Subcommand::given() const { return app_->parsed(); }

bool Subcommand::given(const char* option) const { return app_->count(option) > 0; }

Program::Program(const char* name, const char* description, const std::function<std::string()>& version)
    : app_(std::make_unique<CLI::App>(description)) {
  app_->name(name);
  app_->require_subcommand(1);
  app_->set_help_flag("-h,--help", fmt::format("this text; {} COMMAND --help for a command", name));
  app_->set_version_flag("--version", version, "version, compiler, renderer and libraries");
  app_->get_formatter()->column_width(34);
}

Program::~Program() = default;

Subcommand Program::subcommand(const char* name, const char* text) { return Subcommand(app_->add_subcommand(name, text)); }

bool Program::parse(int argc, char** argv) {
  try {
    app_->parse(argc, argv);
    return true;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {  // --help, --version
      app_->exit(e);
      return false;
    }
    const std::vector<CLI::App*> given = app_->get_subcommands();
    throw UsageError(fmt::format("{}\nsee: {}{} --help", e.what(), app_->get_name(), given.empty() ? "" : " " + given.front()->get_name()));
  }
}

}  // namespace flexframe::cli
