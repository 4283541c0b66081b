// Cards of Nastran bulk data: small (8 columns), large (16) and free fields, continuations, INCLUDE.
#pragma once

#include "sim/base/types.h"

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace flexframe::sim {

struct NastranCard {
  std::string name;                 // upper case, without the star of large fields
  std::vector<std::string> fields;  // after the name; eight a line, blank ones kept
  int file = 0, line = 0;
};

struct NastranDeck {
  std::vector<std::string> files;
  std::vector<NastranCard> cards;
  std::map<std::string, int> chosen;                 // SPC, MPC, NSM of case control: set numbers, the first of each
  std::map<std::string, std::set<int>> also_chosen;  // others, of further subcases
  std::vector<std::string> complaints;               // of lines that cannot be read
  bool incomplete = false;                           // a file that is named is not there
  std::string where(const NastranCard& c) const;
  [[noreturn]] void fail(const NastranCard& c, const std::string& text) const;

  bool blank(const NastranCard& c, size_t field) const { return field >= c.fields.size() || c.fields[field].empty(); }
  // Fields count from 0 after the name. A blank one is `otherwise`. Throw InputError with file, line, card and field.
  double real(const NastranCard& c, size_t field, double otherwise = 0.0) const;
  int integer(const NastranCard& c, size_t field, int otherwise = 0) const;
  bool is_integer(const NastranCard& c, size_t field) const;
  // Motions by the digits 1 to 6: 0..5.
  std::vector<int> components(const NastranCard& c, size_t field) const;
};

// Throws InputError where the first file cannot be opened; what is wrong in it stands in the deck's complaints.
NastranDeck read_nastran_cards(const std::filesystem::path& path);

}  // namespace flexframe::sim
