// Lines of Abaqus / CalculiX input files: keyword lines with their parameters, data lines, *INCLUDE and INPUT=FILE resolved.
#pragma once

#include "sim/base/types.h"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

struct InpPlace {
  int file = 0;  // index of InpLines::files
  int line = 0;
};

struct InpKeyword {
  std::string name;                               // upper case, single blanks, without the star
  std::map<std::string, std::string> parameters;  // names in upper case without blanks, values as written
  InpPlace place;
  bool has(const std::string& key) const { return parameters.contains(key); }
  std::string get(const std::string& key) const {
    const auto it = parameters.find(key);
    return it == parameters.end() ? "" : it->second;
  }
};

std::string inp_upper(std::string_view s);
std::string_view inp_trim(std::string_view s);
// Fields between commas, without blanks around them; empty ones at the end are dropped.
std::vector<std::string_view> inp_fields(std::string_view line);
bool inp_is_integer(std::string_view s);

// Calls keyword() and data() in the order of the file. Throws InputError "FILE:LINE: ..." for files that cannot be opened.
class InpLines {
 public:
  virtual ~InpLines() = default;

  std::vector<std::string> files;   // as opened
  InpPlace at;                      // of the present line
  std::vector<std::string> faults;  // lines that cannot be read; the file is read on behind them
  bool incomplete = false;          // a file that is named is not there

  void read(const std::filesystem::path& path);
  std::string where(const InpPlace& place) const;  // "FILE:LINE"
  [[noreturn]] void fail(const std::string& message) const { fail_at(at, message); }
  [[noreturn]] void fail_at(const InpPlace& place, const std::string& message) const;

  // Numbers of a data line. Throw InputError that names the line and `what`.
  double real(std::string_view s, const char* what) const;
  int integer(std::string_view s, const char* what) const;

 protected:
  virtual void keyword(const InpKeyword& k) = 0;
  virtual void data(std::string_view text) = 0;
  virtual void blank() {}                  // a line without anything
  virtual bool passed_over() const = 0;    // the present keyword: its data may stay unread
  virtual void finish_keyword() = 0;       // before the next keyword and at the end
  virtual void abandon(bool keyword) = 0;  // what was begun when a line of data, or a keyword, was at fault

 private:
  void read_file(const std::filesystem::path& path, int depth);
  template <class Work>
  void guarded(bool keyword, const Work& work);
  std::optional<std::string> continuation(std::istream& in);
  InpKeyword parse(std::istream& in, std::string_view text);
};

}  // namespace flexframe::sim
