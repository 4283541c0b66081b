// What a study tells, as its report (study.md) and its page (study.html) have it. Private to the files study_*.cpp.
#pragma once

#include "render/film/diagram.h"
#include "render/film/study.h"

#include <string>
#include <vector>

namespace flexframe::film {

// Headings, sentences, the command that made the study, tables (the first row their heads), and places of diagrams by name.
struct StudyBlock {
  enum class Kind { heading, text, command, table, diagram };
  Kind kind = Kind::text;
  std::string text = {};
  std::vector<std::vector<std::string>> rows = {};
};
std::vector<StudyBlock> study_blocks(const Study& study);

struct NamedDiagram {
  std::string name;
  Diagram diagram;
};
// One an axis, front, pictures.
std::vector<NamedDiagram> study_diagrams(const Study& study);

}  // namespace flexframe::film
