// Lines of Abaqus / CalculiX input files. See fe_inp_lines.h.
#include "sim/reduce/fe_inp_lines.h"

#include "sim/base/files_read.h"
#include "sim/base/plain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <utility>

namespace flexframe::sim {

std::string inp_upper(std::string_view s) {
  std::string out;
  for (char c : s) out += plain_upper(c);
  return out;
}

std::string_view inp_trim(std::string_view s) {
  while (!s.empty() && std::isspace(static_cast<unsigned char>(s.front()))) s.remove_prefix(1);
  while (!s.empty() && std::isspace(static_cast<unsigned char>(s.back()))) s.remove_suffix(1);
  return s;
}

std::vector<std::string_view> inp_fields(std::string_view line) {
  std::vector<std::string_view> out;
  for (;;) {
    const size_t comma = line.find(',');
    out.push_back(inp_trim(line.substr(0, comma)));
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  while (!out.empty() && out.back().empty()) out.pop_back();
  return out;
}

bool inp_is_integer(std::string_view s) {
  return !s.empty() && std::all_of(s.begin(), s.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::string InpLines::where(const InpPlace& place) const {
  const std::string& file = files.empty() ? std::string() : files[place.file];
  return place.line > 0 ? fmt::format("{}:{}", file, place.line) : file;
}

void InpLines::fail_at(const InpPlace& place, const std::string& message) const {
  throw InputError(fmt::format("{}: {}", where(place), message));
}

double InpLines::real(std::string_view s, const char* what) const {
  double value = 0.0;
  std::string text(s);
  for (char& c : text)
    if (c == 'D' || c == 'd') c = 'e';
  const char* begin = text.c_str() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, text.c_str() + text.size(), value);
  // Numbers too small for a double are zero.
  const bool tiny = error == std::errc::result_out_of_range && std::abs(value) < 1.0 && text.find("e-") != std::string::npos;
  if ((error != std::errc() && !tiny) || end != text.c_str() + text.size() || !std::isfinite(value))
    fail(fmt::format("{}: a number is expected, found '{}'", what, s.substr(0, 40)));
  return tiny ? 0.0 : value;
}

int InpLines::integer(std::string_view s, const char* what) const {
  int value = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  if (error == std::errc() && end == s.data() + s.size()) return value;
  // "3." and "3.0" are integers to Fortran's readers.
  const std::string_view rest = error == std::errc() ? s.substr(end - s.data()) : std::string_view{};
  if (!rest.empty() && rest[0] == '.' && rest.substr(1).find_first_not_of('0') == std::string_view::npos) return value;
  fail(fmt::format("{}: an integer is expected, found '{}'", what, s.substr(0, 40)));
}

// A file that is nothing but faults is given up.
template <class Work>
void InpLines::guarded(bool keyword, const Work& work) {
  constexpr size_t most = 1000;
  try {
    work();
  } catch (const InputError& e) {
    if (faults.size() >= most) throw;
    faults.emplace_back(e.what());
    abandon(keyword);
  }
}

void InpLines::read(const std::filesystem::path& path) {
  read_file(path, 0);
  guarded(true, [&] { finish_keyword(); });
}

void InpLines::read_file(const std::filesystem::path& path, int depth) {
  if (depth > 8) fail("*INCLUDE is nested more than 8 deep");
  std::error_code error;
  std::ifstream in(path);
  if (!in || std::filesystem::is_directory(path, error)) {
    if (depth == 0) throw InputError(fmt::format("{}: cannot be opened", path.string()));
    incomplete = true;
    fail(fmt::format("'{}' cannot be opened; INPUT=FILE is looked for beside the file that names it", path.string()));
  }
  files.push_back(path.string());
  note_file_read(path);
  skip_byte_order_mark(in);
  const InpPlace outer = std::exchange(at, {static_cast<int>(files.size()) - 1, 0});
  std::string line;
  bool keywords = false;
  while (std::getline(in, line)) {
    ++at.line;
    const std::string_view text = inp_trim(line);
    if (text.empty()) blank();
    if (text.empty() || text.starts_with("**")) continue;
    if (text.front() != '*') {
      guarded(false, [&] { data(text); });
      continue;
    }
    keywords = true;
    guarded(true, [&] { finish_keyword(); });
    const InpKeyword k = parse(in, text);
    if (k.name != "INCLUDE") guarded(true, [&] { keyword(k); });
    std::string target = k.get("INPUT");
    if (k.name == "INCLUDE" && target.empty()) fail("*INCLUDE needs INPUT=...");
    if (target.empty() || (k.name != "INCLUDE" && passed_over())) continue;
    std::replace(target.begin(), target.end(), '\\', '/');
    const InpPlace here = at;
    guarded(true, [&] { read_file(path.parent_path() / target, depth + 1); });
    at = here;
  }
  require_whole(in, path);
  if (depth == 0 && !keywords)
    throw InputError(fmt::format("{}: is no deck of Abaqus or CalculiX: no line begins with a keyword such as *NODE", path.string()));
  at = outer;
}

// In Abaqus a keyword line that ends with a comma goes on in the next line, behind comments and blank lines; in CalculiX it does not. So it
// does where that line has parameters. None: the stream stays where it is.
std::optional<std::string> InpLines::continuation(std::istream& in) {
  static constexpr std::array flags = {"GENERATE", "UNSORTED", "INTERNAL", "COMPOSITE", "NLGEOM", "PERTURBATION", "DIRECT"};
  const std::istream::pos_type here = in.tellg();
  const InpPlace before = at;
  for (std::string line; std::getline(in, line);) {
    ++at.line;
    const std::string_view text = inp_trim(line);
    if (text.empty() || text.starts_with("**")) continue;
    const bool flag = std::any_of(flags.begin(), flags.end(), [&](const char* f) { return inp_upper(inp_fields(text).at(0)) == f; });
    if (text.front() != '*' && (flag || text.find('=') != std::string_view::npos)) return std::string(text);
    break;
  }
  in.clear();
  in.seekg(here);
  at = before;
  return {};
}

InpKeyword InpLines::parse(std::istream& in, std::string_view text) {
  std::string joined(text);
  InpKeyword k;
  while (joined.ends_with(',')) {
    const std::optional<std::string> more = continuation(in);
    if (!more) break;
    joined += *more;
  }
  k.place = at;
  bool first = true;
  for (std::string_view part : inp_fields(joined)) {
    if (first) {
      for (char c : inp_upper(part.substr(1)))
        if (c = c == '\t' ? ' ' : c; !(c == ' ' && (k.name.empty() || k.name.back() == ' '))) k.name += c;
    } else if (!part.empty()) {
      const size_t equals = part.find('=');
      std::string_view value = equals == std::string_view::npos ? std::string_view{} : inp_trim(part.substr(equals + 1));
      if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
      std::string key;
      for (char c : inp_upper(part.substr(0, equals)))
        if (c != ' ' && c != '\t') key += c;
      k.parameters[key] = std::string(value);
    }
    first = false;
  }
  return k;
}

}  // namespace flexframe::sim
