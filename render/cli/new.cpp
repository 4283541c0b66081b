// flexframe new: a commented scene to start from.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"
#include "render/cli/json_text.h"
#include "render/cli/reduce.h"
#include "render/cli/shell_word.h"
#include "render/cli/templates.h"

#include "sim/base/file_output.h"
#include "sim/base/words.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <memory>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

struct Template {
  const char *word, *what;
  std::vector<const char*> files;  // of templates/
};
const std::array<Template, 9> known_templates = {{
    {"pendulum", "a bar on a pin", {"pendulum.toml"}},
    {"slider-crank", "driven crank, elastic rod, piston", {"slider-crank.toml"}},
    {"four-bar", "crank, coupler and rocker with a coupler curve", {"four-bar.toml"}},
    {"rotor", "a disc out of balance on an elastic shaft", {"rotor.toml"}},
    {"robot-arm", "three drives, an elastic fore-arm, a payload", {"robot-arm.toml"}},
    {"beam", "a clamped beam that is let go", {"beam.toml"}},
    {"fe-body", "a finite element model, reduced, as a body", {"fe-body.toml", "fe-body.inp"}},
    {"suspension", "double wishbone over a bump", {"suspension.toml"}},
    {"results", "results of another program, to be drawn", {"results.py"}},
}};

std::string with_name(std::string text, const std::string& name) {
  constexpr std::string_view mark = "@NAME@";
  for (size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at + name.size())) text.replace(at, mark.size(), name);
  return text;
}

struct NewWords {
  std::string name, kind = "pendulum";
  bool json = false;
};

const Template& find_template(const std::string& word) {
  std::vector<std::string> words;
  for (const Template& one : known_templates) {
    if (one.word == word) return one;
    words.emplace_back(one.word);
  }
  throw UsageError(
      fmt::format("--template {} is unknown{}; there are {}", sim::quote(word), sim::did_you_mean(word, words), sim::list_words(words)));
}

int make(const NewWords& words) {
  const Template& chosen = find_template(words.kind);
  fs::path base = words.name;
  if (base.extension() == ".toml") base.replace_extension();
  const std::string name = base.filename().string();
  if (name.empty() || name.find_first_of("\"'\\\n") != std::string::npos)
    throw UsageError(
        fmt::format("{} is no name for a scene: a file name without quotes and backslashes is expected", sim::quote(words.name)));
  std::vector<fs::path> made;
  for (const char* file : chosen.files) made.push_back(fs::path(base.string() + fs::path(file).extension().string()));
  if (words.kind == "fe-body") {
    made.push_back(fs::path(base.string() + ".sid"));
    made.push_back(fs::path(base.string() + ".obj"));
    made.push_back(fs::path(base.string() + ".md"));
  }
  for (const fs::path& path : made)
    if (fs::exists(path)) throw sim::InputError(fmt::format("{}: is there already; choose another name", path.string()));
  make_folder(fs::absolute(base).parent_path());
  for (size_t i = 0; i < chosen.files.size(); ++i) sim::write_whole_file(made[i], with_name(template_texts().at(chosen.files[i]), name));
  if (words.kind == "fe-body") reduce_model(made[1].string(), made[2].string(), {"root=rigid:ROOT", "tip=rigid:TIP"}, 8, 0.01);
  const std::string next =
      words.kind == "results"
          ? fmt::format("python3 {} && flexframe render {} -o {}", shell_word(made[0].string()), shell_word(name + ".h5"), shell_word(name))
          : fmt::format("flexframe run {} -o {}", shell_word(made[0].string()), shell_word(name + "-run"));
  nlohmann::ordered_json json = {{"made", nlohmann::ordered_json::array()}, {"next", next}};
  for (const fs::path& path : made) json["made"].push_back(path.string());
  if (words.json) {
    fmt::print("{}\n", json_text(json));
    return 0;
  }
  for (const fs::path& path : made) fmt::print("made         {}\n", path.string());
  fmt::print("next         {}\n", next);
  return 0;
}

}  // namespace

Command add_new(Program& program) {
  const auto w = std::make_shared<NewWords>();
  Subcommand app = program.subcommand("new", "a commented scene to start from");
  app.option("NAME", w->name, "name of the scene: NAME.toml is made").required();
  app.option("-t,--template", w->kind, "what to start from, see below").as("WORD").show_default();
  app.flag("--json", w->json, "what was made, and what to run next, as JSON");
  static std::string list;
  list = "Templates:";
  for (const Template& one : known_templates) list += fmt::format("\n  {:<13} {}", one.word, one.what);
  app.footer(list.c_str());
  app.example("swing", "swing.toml: a bar on a pin");
  app.example("press --template slider-crank", "press.toml: driven crank, elastic rod, piston");
  return {app, [w] { return make(*w); }};
}

}  // namespace flexframe::cli
