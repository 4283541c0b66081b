// The words of the command line: what CLI11 does for the program.
#include "render/cli/command.h"

#include "render/cli/terminal.h"
#include "sim/base/words.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <type_traits>
#include <vector>

#include <sys/ioctl.h>
#include <unistd.h>

namespace flexframe::cli {
namespace {

// The lists among the options, by name: what takes an item of each.
std::map<std::string, std::function<bool(const std::string&)>>& lists() {
  static std::map<std::string, std::function<bool(const std::string&)>> all;
  return all;
}

// Lines no longer than the terminal is wide, that begin `left` columns in. What goes to a file or program keeps its lines.
std::string wrapped(const std::string& text, std::size_t left) {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col < left + 20) return text;
  const std::size_t room = size.ws_col - left;
  std::string out;
  std::size_t line = 0;
  std::istringstream words(text);
  for (std::string word; words >> word; line += word.size()) {
    if (line > 0 && line + 1 + word.size() > room) {
      out += '\n';
      line = 0;
    } else if (line > 0) {
      out += ' ';
      ++line;
    }
    out += word;
  }
  return out;
}

// 1e-9 and 1e12 as people write them.
std::string number_words(double value) {
  std::string text = fmt::format("{:g}", value);
  if (const std::size_t e = text.find('e'); e != std::string::npos) {
    const int power = std::atoi(text.c_str() + e + 1);
    text = text.substr(0, e + 1) + std::to_string(power);
  }
  return text;
}

// Help in words: "--tolerance N   relative local error; 1e-13 to 0.1; not with --accuracy".
class Help final : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    return option->get_type_size() != 0 && !option->get_type_name().empty() ? " " + option->get_type_name() : "";
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    std::string out = option->get_description();
    if (!option->get_default_str().empty() && out.find("default") == std::string::npos)
      out += fmt::format("; default: {}", option->get_default_str());
    if (!option->get_envname().empty()) out += fmt::format("; or the variable {}", option->get_envname());
    std::string beside;
    for (const CLI::Option* other : option->get_excludes()) beside += (beside.empty() ? "; not with " : ", ") + other->get_name();
    if (option->get_required() && !option->get_positional()) beside += "; must be given";
    return wrapped(out + beside, get_column_width());
  }
  std::string make_usage(const CLI::App* app, std::string name) const override { return "\n" + Formatter::make_usage(app, name); }
  std::string make_subcommand(const CLI::App* command) const override {
    std::ostringstream out;
    CLI::detail::format_help(out, command->get_name(), wrapped(command->get_description(), get_column_width()), get_column_width());
    return out.str();
  }
};

void say_range(CLI::Option* option, const std::string& words) { option->description(option->get_description() + "; " + words); }

// Comparisons are all false for NaN: what holds is asked, not what is broken.
template <class Number>
CLI::Validator number_check(const std::string& words, std::function<bool(Number)> holds) {
  return CLI::Validator(
      [words, holds](std::string& text) {
        Number value{};
        if (CLI::detail::lexical_cast(text, value) && std::isfinite(static_cast<double>(value)) && holds(value)) return std::string();
        return fmt::format("must be {}, found {}", words, sim::quote(text));
      },
      "");
}

// A check whose words stand in the description already.
CLI::Validator silent(CLI::Validator check) {
  check.description("");
  return check;
}

// CLI11's sentences of options that are given too often or without what follows them: "--size: At Most 1 required but received 2",
// "--size: 1 required WxH missing".
std::string in_words(const std::string& sentence) {
  static constexpr std::string_view often = "At Most 1 required but received ", lacking = "1 required ", missing = " missing";
  const std::size_t colon = sentence.find(": ");
  if (colon == std::string::npos) return sentence;
  const std::string name = sentence.substr(0, colon), rest = sentence.substr(colon + 2);
  if (rest.starts_with(often)) return fmt::format("{} is given {} times, where one is expected", name, rest.substr(often.size()));
  if (rest.starts_with(lacking) && rest.ends_with(missing))
    return fmt::format("{} needs {} behind it", name, rest.substr(lacking.size(), rest.size() - lacking.size() - missing.size()));
  return sentence;
}

}  // namespace

bool Option::is_number(const std::string& item) {
  char* end = nullptr;
  std::strtod(item.c_str(), &end);
  return !item.empty() && *end == '\0';
}

Option& Option::as(const char* form) {
  option_->type_name(form);
  return *this;
}

Option& Option::list(std::function<bool(const std::string& item)> item) {
  lists()[option_->get_name()] = std::move(item);
  return one_word();
}

Option& Option::required() {
  option_->required();
  return *this;
}

Option& Option::range(int low, int high) {
  const std::string words = high >= 1 << 30 ? fmt::format("{} or more", low) : fmt::format("{} to {}", low, high);
  option_->check(number_check<int>("a whole number, " + words, [low, high](int v) { return v >= low && v <= high; }));
  say_range(option_, words);
  return *this;
}

Option& Option::range(double low, double high) {
  const std::string words = fmt::format("{} to {}", number_words(low), number_words(high));
  option_->check(number_check<double>(words, [low, high](double v) { return v >= low && v <= high; }));
  say_range(option_, words);
  return *this;
}

Option& Option::positive() {
  option_->check(number_check<double>("a number above 0", [](double v) { return v > 0.0; }));
  return *this;
}

Option& Option::not_negative() {
  option_->check(number_check<double>("0 or more", [](double v) { return v >= 0.0; }));
  return *this;
}

Option& Option::one_of(std::initializer_list<const char*> words) {
  option_->check(silent(CLI::IsMember(std::vector<std::string>(words.begin(), words.end()))));
  return *this;
}

Option& Option::one_of(std::initializer_list<int> numbers) {
  option_->check(silent(CLI::IsMember(std::vector<int>(numbers))));
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
  constexpr bool text_value = std::is_same_v<T, std::string> || std::is_same_v<T, std::vector<std::string>>;
  CLI::Option* option = app_->add_option(names, value, text);
  option->type_name(option->get_positional() && !option->nonpositional() ? "" : text_value ? "TEXT" : "N");
  return Option(option);
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

void Subcommand::example(const char* words, const char* what) {
  const std::string before = app_->get_footer();
  const std::string line = fmt::format("  flexframe {} {}\n      {}", app_->get_name(), words, what);
  app_->footer(before.find("Examples:\n") == std::string::npos ? before + (before.empty() ? "" : "\n\n") + "Examples:\n" + line
                                                               : before + "\n" + line);
}

bool Subcommand::given() const { return app_->parsed(); }

bool Subcommand::given(const char* option) const { return app_->get_option_no_throw(option) && app_->count(option) > 0; }

Program::Program(const char* name, const char* description, const std::function<std::string()>& version)
    : app_(std::make_unique<CLI::App>(description)) {
  app_->name(name);
  app_->require_subcommand(1);
  app_->set_help_flag("-h,--help", fmt::format("this text; {} COMMAND --help for a command", name));
  app_->set_version_flag("--version", version, "version, compiler, renderer and libraries");
  const auto help = std::make_shared<Help>();
  help->column_width(34);
  app_->formatter(help);
}

Program::~Program() = default;

Subcommand Program::subcommand(const char* name, const char* text) {
  CLI::App* app = app_->add_subcommand(name, text);
  app->add_flag("-q,--quiet", quiet_, "no progress and no notes: warnings and errors only, on stderr");
  app->add_flag("-v,--verbose", verbose_, "say more: every stage of the work with its time, counts of the solver");
  return Subcommand(app);
}

void Program::refuse(const std::string& problem, const std::string& command) const {
  throw UsageError(fmt::format("{}\nsee: {}{} --help", problem, app_->get_name(), command.empty() ? "" : " " + command));
}

// The words with the items of each list joined by commas.
std::vector<std::string> Program::with_joined_lists(int argc, char** argv) const {
  std::vector<std::string> out;
  for (int i = 1; i < argc; ++i) {
    out.emplace_back(argv[i]);
    const auto list = lists().find(out.back());
    if (list == lists().end() || i + 1 >= argc) continue;
    std::string joined = argv[++i];
    const auto takes = [&](std::string word) {
      while (word.ends_with(',')) word.pop_back();
      return !word.empty() && list->second(word.substr(0, word.find(',')));
    };
    while (i + 1 < argc && takes(argv[i + 1])) joined += (joined.ends_with(',') ? "" : ",") + std::string(argv[++i]);
    while (joined.ends_with(',')) joined.pop_back();
    out.push_back(std::move(joined));
  }
  return out;
}

bool Program::parse(int argc, char** argv) {
  std::vector<std::string> words = with_joined_lists(argc, argv), commands;
  for (const CLI::App* command : app_->get_subcommands({})) commands.push_back(command->get_name());
  const auto first = std::find_if(words.begin(), words.end(), [](const std::string& word) { return !word.starts_with('-'); });
  if (first != words.end() && std::find(commands.begin(), commands.end(), *first) == commands.end()) {
    const std::string hint = sim::did_you_mean(*first, commands);
    refuse(fmt::format("{} is no command{}{} there are {}", sim::quote(*first), hint, hint.empty() ? ";" : "", sim::list_words(commands)),
           "");
  }
  try {
    std::reverse(words.begin(), words.end());  // as CLI11 wants them
    app_->parse(words);
    set_verbosity(quiet_ ? Verbosity::quiet : verbose_ ? Verbosity::verbose : Verbosity::usual);
    return true;
  } catch (const CLI::ExtrasError& e) {
    CLI::App* command = app_->get_subcommands().empty() ? app_.get() : app_->get_subcommands().front();
    std::vector<std::string> known;
    for (const CLI::Option* option : command->get_options())
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    for (const std::string& word : app_->remaining(true))
      if (word.starts_with("--"))
        refuse(fmt::format("{} is no option of {}{}", sim::quote(word), command->get_name(), sim::did_you_mean(word, known)),
               command->get_name());
    refuse(e.what(), command->get_name());
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {  // --help, --version
      app_->exit(e);
      return false;
    }
    const std::vector<CLI::App*> given = app_->get_subcommands();
    refuse(in_words(e.what()), given.empty() ? "" : given.front()->get_name());
  }
}

}  // namespace flexframe::cli
