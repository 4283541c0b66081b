// Reading SID_FEM files: line-oriented grammar, dialects, layout of Gr and Ge. See sid.h.
#include "sim/bodies/sid.h"

#include "sim/base/files_read.h"
#include "sim/base/plain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <set>

namespace flexframe::sim {
namespace {

// As std::isspace in the language of the programs, "C", which a call a character tells no better.
bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

std::string_view trim(std::string_view s) {
  while (!s.empty() && is_space(s.front())) s.remove_prefix(1);
  while (!s.empty() && is_space(s.back())) s.remove_suffix(1);
  return s;
}

// Lower case with single blanks, for comparing keywords.
std::string keyword(std::string_view s) {
  std::string out;
  bool blank = false;
  for (char c : trim(s)) {
    if (is_space(c)) {
      blank = true;
      continue;
    }
    if (blank) out += ' ';
    blank = false;
    out += plain_lower(c);
  }
  return out;
}

// What stands in a message: never more than one screen line of a damaged file, and printable.
std::string shown(std::string_view s) {
  std::string out;
  for (char c : s.substr(0, 60)) out += std::isprint(static_cast<unsigned char>(c)) ? c : '?';
  if (s.size() > 60) out += "...";
  return out;
}

struct Lines {
  std::string_view text;
  std::string name;
  size_t position = 0;
  int number = 0;         // of the line last read
  std::string_view line;  // trimmed

  // The next line that is not blank; false at the end.
  bool next() {
    while (position < text.size()) {
      const size_t end = std::min(text.find('\n', position), text.size());
      line = trim(text.substr(position, end - position));
      position = end + 1;
      ++number;
      if (!line.empty()) return true;
    }
    line = {};
    return false;
  }
  [[noreturn]] void fail(const std::string& message, int at = 0) const {
    throw InputError(fmt::format("{}:{}: {}", name, at ? at : std::max(number, 1), message));
  }
  void need(std::string_view what) {
    if (!next()) fail(fmt::format("the file ends where {} is expected: it is cut short", what));
  }
};

// A real with Fortran's D, E or no exponent letter at all (1.0-100).
bool parse_real(std::string_view s, double& value) {
  s = trim(s);
  if (!s.empty() && s.front() == '+') s.remove_prefix(1);
  if (s.empty() || s.size() > 80) return false;
  // As this language writes them, most of them.
  if (const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
      error == std::errc() && end == s.data() + s.size() && std::isfinite(value))
    return true;
  char buffer[96];
  size_t n = 0;
  bool exponent = false;
  for (size_t i = 0; i < s.size(); ++i) {
    char c = s[i];
    if (c == 'D' || c == 'd' || c == 'E' || c == 'e') {
      c = 'e';
      exponent = true;
    } else if ((c == '-' || c == '+') && i > 0 && !exponent) {
      buffer[n++] = 'e';
      exponent = true;
    }
    if (c == '+') continue;
    if (!((c >= '0' && c <= '9') || c == '.' || c == '-' || c == 'e')) return false;
    buffer[n++] = c;
  }
  const auto [end, error] = std::from_chars(buffer, buffer + n, value);
  if (end != buffer + n) return false;
  if (error == std::errc::result_out_of_range) {
    // Too small is zero, too large is not a number of this file.
    const char* e = std::find(buffer, buffer + n, 'e');
    if (e != buffer + n && e + 1 != buffer + n && e[1] == '-') {
      value = 0.0;
      return true;
    }
    return false;
  }
  return error == std::errc() && std::isfinite(value);
}

bool parse_int(std::string_view s, int& value) {
  s = trim(s);
  if (!s.empty() && s.front() == '+') s.remove_prefix(1);
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  return error == std::errc() && end == s.data() + s.size() && !s.empty();
}

// An entry as written, before it is known what its three indices mean.
struct RawEntry {
  int index[3] = {0, 0, 0};
  int count = 0;
  double value = 0.0;
  int line = 0;
};

struct RawBlock {
  SidTaylor block;
  std::vector<RawEntry> raw;
  int line = 0;
  std::string name;
};

// The right-hand side of "key = value"; false if the line has another key. Blanks are free.
bool key_value(std::string_view line, std::string_view key, std::string_view& value) {
  const size_t equals = line.find('=');
  if (equals == std::string_view::npos || keyword(line.substr(0, equals)) != key) return false;
  value = trim(line.substr(equals + 1));
  return true;
}

class Reader {
 public:
  Reader(std::string_view text, const std::string& name) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    lines.text = text;
    lines.name = name;
  }

  SidReading read() {
    read_header();
    lines.need("'new modal'");
    read_new_modal();
    bool refmod = false, frame = false;
    for (;;) {
      lines.need("'end modal'");
      const std::string word = keyword(lines.line);
      if (word == "end modal") break;
      if (word == "refmod") {
        if (refmod) lines.fail("a second 'refmod'; one is allowed");
        refmod = true;
        read_refmod();
      } else if (word == "frame") {
        if (frame) lines.fail("a second 'frame'; one is allowed");
        frame = true;
        read_frame();
      } else if (begins_node(word)) {
        read_new_node(word);
      } else {
        read_modal_block(word);
      }
    }
    if (!refmod) lines.fail("'end modal' without a 'refmod' block (mass, nelastq)");
    lines.need("'end part'");
    if (keyword(lines.line) != "end part") lines.fail(fmt::format("'end part' is expected, found '{}'", shown(lines.line)));
    if (lines.next()) {
      if (keyword(lines.line).starts_with("further shapes =")) read_further();
      else read_as(fmt::format("text behind 'end part' (line {}) is left out", lines.number));
    }

    if (declared_nodes && *declared_nodes != static_cast<int>(sid.nodes.size()))
      lines.fail(fmt::format("the first line announces {} nodes, the file has {}", *declared_nodes, sid.nodes.size()), 1);
    if (declared_modes && *declared_modes != sid.nelastq)
      lines.fail(fmt::format("the first line announces {} modes, nelastq is {}", *declared_modes, sid.nelastq), 1);
    settle_indices();
    settle_inertia();
    return std::move(result);
  }

 private:
  Lines lines;
  SidReading result;
  SidFile& sid = result.file;
  std::optional<int> declared_nodes, declared_modes;  // none: the file has no counts
  std::set<std::string> node_ids;
  struct Place {
    int node;  // -1: of the body
    std::string name;
    RawBlock raw;
  };
  std::vector<Place> blocks;

  void note(std::string text) { result.notes.push_back(std::move(text)); }
  void read_as(std::string text) { result.dialect.push_back(std::move(text)); }

  // "NODES MODES [:] text", or lines of text without counts, up to 'part'.
  void read_header() {
    lines.need("the first line 'NODES MODES : text' or 'part'");
    if (keyword(lines.line) == "part") return read_as("dialect: no first line with the counts of nodes and modes");
    int nodes = 0, modes = 0;
    std::string_view rest = lines.line;
    if (take_count(rest, nodes) && take_count(rest, modes)) {
      if (nodes < 0 || modes < 0) refuse_header();
      declared_nodes = nodes;
      declared_modes = modes;
      rest = trim(rest);
      if (rest.starts_with(':')) rest.remove_prefix(1);
      sid.comment = trim(rest);
      lines.need("'part'");
      if (keyword(lines.line) != "part") lines.fail(fmt::format("'part' is expected, found '{}'", shown(lines.line)));
      return;
    }
    // A title: as many lines as a title may have, so that another kind of file is told of at once.
    constexpr int longest_title = 20;
    const std::string_view first = lines.line;
    sid.comment = first;
    for (int i = 0; i < longest_title && lines.next(); ++i)
      if (keyword(lines.line) == "part") return read_as("dialect: the lines before 'part' have no counts of nodes and modes");
    lines.number = 1;
    lines.line = first;
    refuse_header();
  }

  [[noreturn]] void refuse_header() const {
    lines.fail(fmt::format("no SID file: the first line must be 'NODES MODES : text', or 'part' stand in one of the next, found '{}'",
                           shown(lines.line)));
  }

  // A whole number at the head of the text, taken off it; after it comes a blank, a colon or the end.
  static bool take_count(std::string_view& text, int& value) {
    text = trim(text);
    const size_t end = std::find_if(text.begin(), text.end(), [](char c) { return c == ':' || is_space(c); }) - text.begin();
    if (!parse_int(text.substr(0, end), value)) return false;
    text.remove_prefix(end);
    return true;
  }

  void read_new_modal() {
    const size_t equals = lines.line.find('=');
    if (keyword(lines.line.substr(0, equals)) != "new modal")
      lines.fail(fmt::format("'new modal' is expected, found '{}'", shown(lines.line)));
    if (equals != std::string_view::npos) sid.name = trim(lines.line.substr(equals + 1));
  }

  void read_refmod() {
    const int begin = lines.number;
    bool mass = false, count = false;
    std::vector<std::pair<int, std::string>> labels;
    for (;;) {
      lines.need("'end refmod'");
      if (keyword(lines.line) == "end refmod") break;
      std::string_view value;
      const std::string word = keyword(lines.line);
      if (key_value(lines.line, "mass", value)) {
        if (mass) lines.fail("mass is given twice");
        mass = true;
        if (!parse_real(value, sid.mass) || sid.mass < 0.0) lines.fail(fmt::format("mass = '{}': a number >= 0 is expected", shown(value)));
      } else if (key_value(lines.line, "nelastq", value)) {
        if (count) lines.fail("nelastq is given twice");
        count = true;
        if (!parse_int(value, sid.nelastq) || sid.nelastq < 0)
          lines.fail(fmt::format("nelastq = '{}': an integer >= 0 is expected", shown(value)));
      } else if (word.starts_with("ielastq")) {
        const size_t open = lines.line.find('('), close = lines.line.find(')'), equals = lines.line.find('=');
        int mode = 0;
        if (open == std::string_view::npos || close == std::string_view::npos || close < open || equals == std::string_view::npos ||
            equals < close || !parse_int(lines.line.substr(open + 1, close - open - 1), mode) || mode < 1)
          lines.fail(fmt::format("'{}': 'ielastq (MODE) = text' is expected", shown(lines.line)));
        labels.emplace_back(mode, std::string(trim(lines.line.substr(equals + 1))));
      } else if (word.starts_with("end ") || word == "frame") {
        lines.fail(fmt::format("'end refmod' is expected, found '{}'", shown(lines.line)));
      } else {
        sid.refmod_others.emplace_back(lines.line);
        read_as(fmt::format("line {}: '{}' of refmod is kept, not used", lines.number, shown(lines.line)));
      }
    }
    if (!mass) lines.fail("refmod has no mass", begin);
    if (!count) lines.fail("refmod has no nelastq", begin);
    // Every mode has at least a stiffness, 20 characters: a count beyond that is damage; dense matrices of more modes fit nowhere.
    if (sid.nelastq > 100000 || static_cast<size_t>(sid.nelastq) > lines.text.size() / 20)
      lines.fail(fmt::format("nelastq = {}: more than the data of this file can be", sid.nelastq), begin);
    // Only as many labels as are given are stored, then padded if the count is plausible.
    for (auto& [mode, text] : labels) {
      if (mode > sid.nelastq) lines.fail(fmt::format("ielastq ({}) but nelastq = {}", mode, sid.nelastq), begin);
      if (static_cast<int>(sid.labels.size()) < mode && mode <= static_cast<int>(labels.size())) sid.labels.resize(mode);
      if (mode <= static_cast<int>(sid.labels.size())) sid.labels[mode - 1] = std::move(text);
    }
  }

  // A node is 'new node = ID ... end node' within 'frame'; some makers write 'new frame = ID ... end frame', with a 'frame' around them
  // or without.
  static bool begins_node(std::string_view word) { return word.starts_with("new node") || word.starts_with("new frame"); }

  void read_frame() {
    for (;;) {
      lines.need("'end frame'");
      const std::string word = keyword(lines.line);
      if (word == "end frame") return;
      if (!begins_node(word)) lines.fail(fmt::format("'new node = ID' or 'end frame' is expected, found '{}'", shown(lines.line)));
      read_new_node(word);
    }
  }

  void read_new_node(const std::string& word) {
    const bool named_frame = word.starts_with("new frame");
    if (named_frame && node_ids.empty()) read_as(fmt::format("dialect: 'new frame' (line {}) read as 'new node'", lines.number));
    const size_t equals = lines.line.find('=');
    SidNode node;
    node.id = std::string(trim(lines.line.substr(equals != std::string_view::npos ? equals + 1 : named_frame ? 9 : 8)));
    if (node.id.empty()) lines.fail("a node without number: 'new node = ID' is expected");
    if (!node_ids.insert(node.id).second) lines.fail(fmt::format("node {} is there twice", shown(node.id)));
    sid.nodes.push_back(std::move(node));
    read_node(static_cast<int>(sid.nodes.size()) - 1, named_frame ? "end frame" : "end node");
  }

  void read_node(int index, const std::string& end) {
    const int begin = lines.number;
    const std::string needed = fmt::format("'{}'", end);
    for (;;) {
      lines.need(needed);
      const std::string word = keyword(lines.line);
      if (word == end) break;
      std::string_view value;
      if (key_value(lines.line, "rframe", value)) {
        sid.nodes[index].rframe = value;
      } else if (word == "origin" || word == "phi" || word == "psi" || word == "ap" || word == "sigma") {
        add_block(index, word == "ap" ? "AP" : word);
      } else if (word.starts_with("end ") || word.starts_with("new ")) {
        lines.fail(fmt::format("'{}' is expected (node {} begins in line {}), found '{}'", end, shown(sid.nodes[index].id), begin,
                               shown(lines.line)));
      } else {
        note(fmt::format("node {}: block '{}' (line {}) is not known: kept, not used", sid.nodes[index].id, shown(lines.line),
                         lines.number));
        sid.nodes[index].others.push_back(read_unknown());
      }
    }
  }

  void read_modal_block(const std::string& word) {
    static constexpr std::pair<const char*, const char*> known[] = {
        {"mdcm", "mdCM"}, {"mcm", "mdCM"}, {"j", "J"},   {"mmi", "J"},         {"ct", "Ct"}, {"cr", "Cr"}, {"me", "Me"},
        {"gr", "Gr"},     {"ge", "Ge"},    {"oe", "Oe"}, {"ksigma", "ksigma"}, {"ke", "Ke"}, {"de", "De"}};
    for (const auto& [file_word, name] : known)
      if (word == file_word) {
        if (word == "mcm" || word == "mmi")
          read_as(fmt::format("dialect: block '{}' (line {}) read as {}", std::string(lines.line), lines.number, name));
        add_block(-1, name);
        return;
      }
    if (word.starts_with("end ") || word.starts_with("new ") || word == "part")
      lines.fail(fmt::format("a block or 'end modal' is expected, found '{}'", shown(lines.line)));
    note(fmt::format("block '{}' (line {}) is not known: kept and written again, not used", shown(lines.line), lines.number));
    sid.others.push_back(read_unknown());
  }

  // Rows of as many numbers as there are shapes, under their name.
  void read_rows(const char* name, Eigen::Index columns, Eigen::Index rows, MatX& into) {
    lines.need(fmt::format("'{}'", name));
    if (lines.line != name) lines.fail(fmt::format("'{}' is expected, found '{}'", name, shown(lines.line)));
    std::vector<double> values;  // as many as the file has
    for (Eigen::Index i = 0; i < rows; ++i) {
      lines.need(fmt::format("row {} of {} of '{}'", i + 1, rows, name));
      std::string_view rest = lines.line;
      for (Eigen::Index k = 0; k < columns; ++k) {
        const size_t end = std::find_if(rest.begin(), rest.end(), is_space) - rest.begin();
        if (double& value = values.emplace_back(); !parse_real(rest.substr(0, end), value))
          lines.fail(fmt::format("{} numbers are expected, found '{}'", columns, shown(lines.line)));
        rest = trim(rest.substr(end));
      }
      if (!rest.empty()) lines.fail(fmt::format("{} numbers are expected, found '{}' more", columns, shown(rest)));
    }
    into = Eigen::Map<const RowsX>(values.data(), rows, columns);
  }

  // further_shapes.h: behind the end of the part.
  void read_further() {
    std::string_view value;
    int count = 0;
    if (!key_value(lines.line, "further shapes", value) || !parse_int(value, count) || count < 1 || count > 20000)
      lines.fail(fmt::format("'further shapes = COUNT' is expected, found '{}'", shown(lines.line)));
    FurtherShapes& further = sid.further;
    MatX stiffness, md, J, Cr;
    read_rows("stiffness", count, 1, stiffness);
    read_rows("mass in common", count, sid.nelastq, further.coupling);
    read_rows("mdCM", count, 3, md);
    read_rows("J", count, 6, J);
    read_rows("Cr", count, 3, Cr);
    read_rows("phi psi", count, 6 * std::ssize(sid.nodes), further.motion);
    lines.need("'end further shapes'");
    if (keyword(lines.line) != "end further shapes")
      lines.fail(fmt::format("'end further shapes' is expected, found '{}'", shown(lines.line)));
    further.stiffness = stiffness.transpose();
    further.md = md;
    further.J = J;
    further.Cr = Cr;
    if (!(further.stiffness.minCoeff() > 0.0)) lines.fail("the stiffness of a further shape must be > 0");
    if (lines.next()) read_as(fmt::format("text behind 'end further shapes' (line {}) is left out", lines.number));
  }

  SidText read_unknown() {
    SidText text;
    const int begin = lines.number;
    std::string name = keyword(lines.line);
    if (const size_t equals = name.find('='); equals != std::string::npos) name = std::string(trim(name.substr(0, equals)));
    if (name.starts_with("new ")) name = name.substr(4);
    text.lines.emplace_back(lines.line);
    do {
      if (!lines.next())
        lines.fail(fmt::format("'{}' is no block of a SID file, or lacks its 'end {}'", shown(text.lines.front()), shown(name)), begin);
      const std::string word = keyword(lines.line);
      if (word == "end modal" || word == "end part" || word == "end node" || word == "end frame")
        lines.fail(fmt::format("'{}' is no block of a SID file, or lacks its 'end {}'", shown(text.lines.front()), shown(name)), begin);
      text.lines.emplace_back(lines.line);
      if (word == "end " + name) return text;
    } while (true);
  }

  void add_block(int node, const std::string& name) {
    for (auto it = blocks.rbegin(); it != blocks.rend() && it->node == node; ++it)
      if (it->name == name) lines.fail(fmt::format("block {} is there twice (first in line {})", name, it->raw.line));
    if (node < 0)
      for (const Place& place : blocks)
        if (place.node < 0 && place.name == name)
          lines.fail(fmt::format("block {} is there twice (first in line {})", name, place.raw.line));
    const std::string word = keyword(lines.line);
    blocks.push_back({node, name, read_taylor(word)});
  }

  RawBlock read_taylor(const std::string& word) {
    RawBlock raw;
    raw.line = lines.number;
    raw.name = std::string(lines.line);
    SidTaylor& t = raw.block;
    t.rows = t.columns = -1;
    const std::string end = fmt::format("'end {}'", raw.name);
    raw.raw.reserve(16);
    for (;;) {
      lines.need(end);
      const std::string_view line = lines.line;
      if (line.size() > 2 && (line[0] == 'm' || line[0] == 'M') && (line[1] == '0' || line[1] == '1' || line[1] == 'n' || line[1] == 'N') &&
          trim(line.substr(2)).starts_with('(')) {
        if (line[1] == 'n' || line[1] == 'N') {
          t.higher.emplace_back(line);
          continue;
        }
        raw.raw.push_back(read_entry(line));
        continue;
      }
      if (const size_t equals = line.find('='); equals != std::string_view::npos) {
        const std::pair<const char*, int*> keys[] = {{"order", &t.order}, {"nrow", &t.rows},     {"ncol", &t.columns},
                                                     {"nq", &t.modes},    {"nqn", &t.nonlinear}, {"structure", &t.structure}};
        const std::string given = keyword(line.substr(0, equals));
        const auto key = std::find_if(std::begin(keys), std::end(keys), [&](const auto& known) { return given == known.first; });
        if (key != std::end(keys)) {
          const std::string_view value = trim(line.substr(equals + 1));
          if (!parse_int(value, *key->second) || *key->second < 0)
            lines.fail(fmt::format("{} = '{}' of block {}: an integer >= 0 is expected", key->first, shown(value), raw.name));
          continue;
        }
      }
      if (keyword(line) == "end " + word) break;
      lines.fail(fmt::format(
          "block {} (line {}): an entry m0(r, c), m1(r, mode, c), mn(...), a key (order nrow ncol nq nqn structure) or 'end {}' is "
          "expected, found '{}'",
          raw.name, raw.line, raw.name, shown(line)));
    }
    if (t.rows < 0 || t.columns < 0) lines.fail(fmt::format("block {} lacks nrow or ncol", raw.name), raw.line);
    if (t.structure > 4)
      lines.fail(
          fmt::format("block {}: structure = {}; 0 zero, 1 diagonal, 2 symmetric, 3 full, 4 unit are allowed", raw.name, t.structure),
          raw.line);
    if (t.order > 1 && !t.higher.empty())
      note(fmt::format("block {} (line {}) has terms of order {}: kept, not used", raw.name, raw.line, t.order));
    return raw;
  }

  RawEntry read_entry(std::string_view line) {
    RawEntry entry;
    entry.line = lines.number;
    const int wanted = line[1] == '0' ? 2 : 3;
    const size_t open = line.find('('), close = line.find(')');
    const size_t equals = close == std::string_view::npos ? std::string_view::npos : line.find('=', close);
    bool good = equals != std::string_view::npos && trim(line.substr(close + 1, equals - close - 1)).empty();
    if (good) {
      std::string_view inside = line.substr(open + 1, close - open - 1);
      while (good && entry.count < wanted) {
        const size_t comma = inside.find(',');
        const bool last = entry.count + 1 == wanted;
        good = (comma == std::string_view::npos) == last && parse_int(inside.substr(0, comma), entry.index[entry.count]) &&
               entry.index[entry.count] >= 1;
        ++entry.count;
        if (!last && good) inside.remove_prefix(comma + 1);
      }
    }
    if (!good)
      lines.fail(fmt::format("'{}': {} = value is expected, indices from 1", shown(line),
                             wanted == 2 ? "m0(row, column)" : "m1(row, mode, column)"));
    if (!parse_real(line.substr(equals + 1), entry.value))
      lines.fail(fmt::format("'{}': '{}' is no finite number", shown(line.substr(0, equals)), shown(trim(line.substr(equals + 1)))));
    return entry;
  }

  // The indices of first-order entries: (row, mode, column) in real files, (row, column, mode) from two writers. One meaning must fit the
  // whole file.
  void settle_indices() {
    const int n = sid.nelastq;
    bool standard = true, swapped = true;
    int culprit = 0;
    for (const Place& p : blocks) {
      const SidTaylor& t = p.raw.block;
      for (const RawEntry& e : p.raw.raw) {
        if (e.count != 3) continue;
        if (e.index[1] > n || e.index[2] > t.columns) {
          if (standard) culprit = e.line;
          standard = false;
        }
        if (e.index[2] > n || e.index[1] > t.columns) swapped = false;
      }
    }
    if (!standard && !swapped)
      lines.fail(fmt::format("entry m1 is out of range: m1(row, mode, column) with at most {} modes and ncol columns", n), culprit);
    if (!standard) read_as("dialect: first-order entries are indexed (row, column, mode)");
    for (Place& p : blocks) {
      expect_size(p);
      SidTaylor& t = p.raw.block;
      t.entries.reserve(p.raw.raw.size());
      for (const RawEntry& e : p.raw.raw) {
        SidEntry entry{e.index[0], 0, e.index[1], e.value};
        if (e.count == 3) {
          entry.mode = standard ? e.index[1] : e.index[2];
          entry.column = standard ? e.index[2] : e.index[1];
          if (t.order < 1) lines.fail(fmt::format("block {} has order = {} but an entry m1", p.raw.name, t.order), e.line);
        }
        if (entry.row > t.rows || entry.column > t.columns)
          lines.fail(fmt::format("row {}, column {} is outside of block {}, which is {} x {}", entry.row, entry.column, p.raw.name, t.rows,
                                 t.columns),
                     e.line);
        t.entries.push_back(entry);
      }
      refuse_doubles(p);
      p.raw.raw = {};
      // What is unit is the zeroth order: entries of the first stand beside it.
      const bool zeroth = std::any_of(t.entries.begin(), t.entries.end(), [](const SidEntry& e) { return e.mode == 0; });
      if (t.structure == 4 ? zeroth : t.structure == 0 && !t.entries.empty()) {
        note(fmt::format("block {} (line {}) says structure = {} ({}) but has entries: the entries count", p.raw.name, p.raw.line,
                         t.structure, t.structure == 0 ? "zero" : "unit"));
        t.structure = 3;
      }
      if (t.structure == 2 && t.rows != t.columns) {
        note(fmt::format("block {} (line {}) says structure = 2 (symmetric) but is {} x {}: taken as full", p.raw.name, p.raw.line, t.rows,
                         t.columns));
        t.structure = 3;
      }
      if (t.structure == 1 &&
          std::any_of(t.entries.begin(), t.entries.end(), [](const SidEntry& e) { return e.row != e.column && e.value != 0.0; })) {
        note(fmt::format("block {} (line {}) says structure = 1 (diagonal) but has other entries: they count", p.raw.name, p.raw.line));
        t.structure = 3;
      }
      place(p);
    }
    blocks.clear();
  }

  void expect_size(Place& p) {
    const int n = sid.nelastq;
    SidTaylor& t = p.raw.block;
    const auto is = [&](long rows, long columns) { return t.rows == rows && t.columns == columns; };
    bool good = true;
    std::string wanted;
    const auto want = [&](long rows, long columns) {
      good = is(rows, columns);
      wanted = fmt::format("{} x {}", rows, columns);
    };
    const long modes = n;
    if (p.name == "origin" || p.name == "mdCM") want(3, 1);
    else if (p.name == "phi" || p.name == "psi") want(3, modes);
    else if (p.name == "AP") want(3, 3);
    else if (p.name == "J") {
      want(6, 1);
      if (is(3, 3)) good = true;
      wanted += " or 3 x 3";
    } else if (p.name == "Ct" || p.name == "Cr") want(modes, 3);
    else if (p.name == "Me" || p.name == "Ke" || p.name == "De") want(modes, modes);
    else if (p.name == "Gr") want(3, 3 * modes);
    else if (p.name == "Ge") want(modes, 3 * modes);
    else if (p.name == "Oe") want(modes, 6);
    else if (p.name == "ksigma") want(modes, 1);
    else if (p.name == "sigma") {
      good = t.rows == 6 && (t.columns == 1 || t.columns == modes);
      wanted = fmt::format("6 x 1 or 6 x {}", modes);
    }
    // A block of zeros may be written with no size at all.
    if (!good && p.raw.raw.empty() && (t.rows == 0 || t.columns == 0)) {
      good = true;
      t.rows = t.columns = 0;  // also where only one of them was
      read_as(fmt::format("block {} (line {}) is empty: taken as zero", p.raw.name, p.raw.line));
    }
    if (!good)
      lines.fail(fmt::format("block {} is {} x {}; with nelastq = {} it must be {}", p.raw.name, t.rows, t.columns, n, wanted), p.raw.line);
    if (t.order >= 1 && t.modes != n && t.modes != 0)
      lines.fail(fmt::format("block {} has nq = {}, refmod has nelastq = {}", p.raw.name, t.modes, n), p.raw.line);
  }

  void refuse_doubles(const Place& p) {
    std::vector<SidEntry> sorted = p.raw.block.entries;
    const auto key = [](const SidEntry& e) { return std::tuple(e.mode, e.row, e.column); };
    std::sort(sorted.begin(), sorted.end(), [&](const SidEntry& a, const SidEntry& b) { return key(a) < key(b); });
    for (size_t i = 1; i < sorted.size(); ++i)
      if (key(sorted[i]) == key(sorted[i - 1]) && sorted[i].value != sorted[i - 1].value)
        lines.fail(
            fmt::format("block {} gives m{}({}, {}{}) twice: {} and {}", p.raw.name, sorted[i].mode ? 1 : 0, sorted[i].row,
                        sorted[i].mode ? fmt::format("{}, ", sorted[i].mode) : "", sorted[i].column, sorted[i - 1].value, sorted[i].value),
            p.raw.line);
  }

  void place(Place& p) {
    std::optional<SidTaylor>* target = nullptr;
    if (p.node >= 0) {
      SidNode& node = sid.nodes[p.node];
      target = p.name == "origin" ? &node.origin
               : p.name == "phi"  ? &node.phi
               : p.name == "psi"  ? &node.psi
               : p.name == "AP"   ? &node.AP
                                  : &node.sigma;
    } else {
      const std::pair<const char*, std::optional<SidTaylor>*> slots[] = {
          {"mdCM", &sid.mdCM}, {"J", &sid.J},   {"Ct", &sid.Ct},         {"Cr", &sid.Cr}, {"Me", &sid.Me}, {"Gr", &sid.Gr},
          {"Ge", &sid.Ge},     {"Oe", &sid.Oe}, {"ksigma", &sid.ksigma}, {"Ke", &sid.Ke}, {"De", &sid.De}};
      for (const auto& [name, slot] : slots)
        if (p.name == name) target = slot;
    }
    *target = std::move(p.raw.block);
  }

  // J as 6 x 1; Gr and Ge interleaved.
  void settle_inertia() {
    if (sid.J && sid.J->rows == 3 && sid.J->columns == 3) {
      static constexpr int row_of[3][3] = {{1, 4, 5}, {4, 2, 6}, {5, 6, 3}};
      SidTaylor& J = *sid.J;
      double largest = 0.0;
      for (const SidEntry& e : J.entries) largest = std::max(largest, std::abs(e.value));
      std::vector<SidEntry> six;
      for (SidEntry e : J.entries) {
        e.row = row_of[e.row - 1][e.column - 1];
        e.column = 1;
        const auto same = std::find_if(six.begin(), six.end(), [&](const SidEntry& o) { return o.row == e.row && o.mode == e.mode; });
        if (same == six.end()) six.push_back(e);
        // Both triangles written: they must agree to the digits such files carry.
        else if (std::abs(same->value - e.value) > 1e-6 * largest) throw InputError(fmt::format("{}: J is not symmetric", lines.name));
      }
      J.entries = std::move(six);
      J.rows = 6;
      J.columns = 1;
      J.structure = 3;
      read_as("dialect: J is written 3 x 3");
    }
    result.Gr = settle_gr();
    result.Ge = settle_ge();
  }

  static int other_column(int column, int n) {
    const int mode = (column - 1) / 3, axis = (column - 1) % 3;
    return n * axis + mode + 1;
  }

  // Compares deviations of the two layouts, interleaved and blocked; each is a sum of squares over the same entries.
  static SidLayout decide(const std::array<double, 2>& deviation) {
    if (deviation[0] == deviation[1]) return SidLayout::either;
    return deviation[0] < deviation[1] ? SidLayout::interleaved : SidLayout::blocked;
  }

  // (row, mode, axis) of a 3nq-wide entry under either layout.
  struct Spot {
    int row, mode, axis;
    double value;
  };
  static std::vector<Spot> spots(const SidTaylor& t, int n, bool blocked) {
    std::vector<Spot> out;
    for (const SidEntry& e : t.entries)
      if (e.mode == 0) {
        const int c = e.column - 1;
        out.push_back(blocked ? Spot{e.row - 1, c / 3, c % 3, e.value} : Spot{e.row - 1, c % n, c / n, e.value});
      }
    return out;
  }

  void report(const char* block, SidLayout layout, const char* identity) {
    if (layout == SidLayout::either) read_as(fmt::format("layout of {}: both fit ({}), read as interleaved", block, identity));
    else
      read_as(fmt::format("layout of {}: {} found by {}", block,
                          layout == SidLayout::blocked ? "blocked per mode, held interleaved," : "interleaved", identity));
  }

  void make_interleaved(SidTaylor& t) {
    for (SidEntry& e : t.entries) e.column = other_column(e.column, sid.nelastq);
  }

  // Which layout an identity finds, and its block held interleaved. deviations(): of the block as it stands, read interleaved and blocked.
  template <class Deviations>
  SidLayout settle(SidTaylor& t, const char* block, const char* identity, Deviations&& deviations) {
    const SidLayout layout = decide(deviations());
    if (layout == SidLayout::blocked) {
      const std::vector<SidEntry> given = t.entries;
      make_interleaved(t);
      // Where neither layout fits, the block might be turned once more whenever it is read: then it stays as the file has it.
      if (decide(deviations()) == SidLayout::blocked) {
        t.entries = given;
        note(fmt::format("layout of {}: neither fits ({}), read as interleaved", block, identity));
        return SidLayout::either;
      }
    }
    report(block, layout, identity);
    return layout;
  }

  // sym(Gr_j) = J1_j decides.
  SidLayout settle_gr() {
    const int n = sid.nelastq;
    if (!sid.Gr || !sid.J || n < 2) return SidLayout::either;
    static constexpr int row_of[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    // The sizes were checked against entries, n is at most what they justify: 9 n numbers only if some entry reaches that far.
    int reach = 0;
    for (const SidEntry& e : sid.Gr->entries) reach = std::max(reach, e.column);
    for (const SidEntry& e : sid.J->entries) reach = std::max(reach, e.mode);
    if (reach == 0) return SidLayout::either;
    return settle(*sid.Gr, "Gr", "sym(Gr_j) = J1_j", [&] {
      std::array<double, 2> deviation{};
      for (int blocked = 0; blocked < 2; ++blocked) {
        std::vector<std::pair<long, double>> terms;  // (mode, place) -> sum, kept sparse
        for (const Spot& s : spots(*sid.Gr, n, blocked == 1))
          terms.emplace_back(6L * s.mode + row_of[s.row][s.axis], s.row == s.axis ? s.value : 0.5 * s.value);
        for (const SidEntry& e : sid.J->entries)
          if (e.mode > 0) terms.emplace_back(6L * (e.mode - 1) + e.row - 1, -e.value);
        deviation[blocked] = sum_squares(terms);
      }
      return deviation;
    });
  }

  // Ge_j(k, :) = 2 Cr1(k, j, :), with geometric stiffening in Cr only its skew part; without Cr.M1, Ge_j(k, :) = -Ge_k(j, :).
  SidLayout settle_ge() {
    const int n = sid.nelastq;
    if (!sid.Ge || n < 2 || sid.Ge->entries.empty()) return SidLayout::either;
    const bool have = sid.Cr && std::any_of(sid.Cr->entries.begin(), sid.Cr->entries.end(), [](const SidEntry& e) { return e.mode > 0; });
    const auto at = [n](long row, long mode, long axis) { return (row * n + mode) * 3 + axis; };
    return settle(*sid.Ge, "Ge", have ? "Ge_j(k,:) = 2 Cr1(k,j,:)" : "Ge_j(k,:) = -Ge_k(j,:)", [&] {
      std::array<double, 2> deviation{};
      for (int blocked = 0; blocked < 2; ++blocked) {
        deviation[blocked] = std::numeric_limits<double>::max();
        for (int skew = 0; skew < (have ? 2 : 1); ++skew) {
          std::vector<std::pair<long, double>> terms;
          for (const Spot& s : spots(*sid.Ge, n, blocked == 1)) {
            terms.emplace_back(at(s.row, s.mode, s.axis), s.value);
            if (!have) terms.emplace_back(at(s.mode, s.row, s.axis), s.value);
          }
          if (have)
            for (const SidEntry& e : sid.Cr->entries)
              if (e.mode > 0) {
                terms.emplace_back(at(e.row - 1, e.mode - 1, e.column - 1), skew ? -e.value : -2.0 * e.value);
                if (skew) terms.emplace_back(at(e.mode - 1, e.row - 1, e.column - 1), e.value);
              }
          deviation[blocked] = std::min(deviation[blocked], sum_squares(terms));
        }
      }
      return deviation;
    });
  }

  static double sum_squares(std::vector<std::pair<long, double>>& terms) {
    std::sort(terms.begin(), terms.end());
    double total = 0.0;
    for (size_t i = 0; i < terms.size();) {
      double sum = 0.0;
      const long at = terms[i].first;
      for (; i < terms.size() && terms[i].first == at; ++i) sum += terms[i].second;
      total += sum * sum;
    }
    return total;
  }
};

}  // namespace

SidReading read_sid_text(std::string_view text, const std::string& name) { return Reader(text, name).read(); }

SidReading read_sid(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError(fmt::format("{}: is a folder, a SID file is expected", path.string()));
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(fmt::format("{}: cannot be opened", path.string()));
  note_file_read(path);
  return read_sid_text(read_rest(in, path), path.string());
}

}  // namespace flexframe::sim
