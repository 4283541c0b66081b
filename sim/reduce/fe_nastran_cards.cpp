// Cards of Nastran bulk data. See fe_nastran_cards.h.
#include "sim/reduce/fe_nastran_cards.h"

#include "sim/base/files_read.h"
#include "sim/base/plain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

namespace flexframe::sim {
namespace {

std::string trimmed(std::string_view s) {
  while (!s.empty() && std::isspace(static_cast<unsigned char>(s.front()))) s.remove_prefix(1);
  while (!s.empty() && std::isspace(static_cast<unsigned char>(s.back()))) s.remove_suffix(1);
  return std::string(s);
}

std::string upper(std::string s) {
  for (char& c : s) c = plain_upper(c);
  return s;
}

// Columns with tabs as stops every eight.
std::string expanded(const std::string& line) {
  std::string out;
  for (char c : line) {
    if (c == '\r') continue;
    if (c != '\t') out += c;
    else out.append(8 - out.size() % 8, ' ');
  }
  return out;
}

class CardReader {
 public:
  NastranDeck deck;

  // named_by: FILE:LINE of the INCLUDE that names it
  void read(const std::filesystem::path& path, int depth, const std::string& named_by) {
    std::error_code error;
    std::ifstream in(path);
    if (!in || std::filesystem::is_directory(path, error)) {
      if (depth == 0) throw InputError(fmt::format("{}: cannot be opened", path.string()));
      deck.incomplete = true;
      return complain(fmt::format("{}: INCLUDE: '{}' cannot be opened", named_by, path.string()));
    }
    const int file = static_cast<int>(deck.files.size());
    deck.files.push_back(path.string());
    note_file_read(path);
    skip_byte_order_mark(in);
    std::string raw;
    for (int number = 1; std::getline(in, raw) && !ended; ++number) {
      std::string line = expanded(raw.substr(0, raw.find('$')));
      while (!line.empty() && line.back() == ' ') line.pop_back();
      if (line.empty()) continue;
      const std::string words = upper(trimmed(line));
      if (words.starts_with("INCLUDE")) {
        std::string target = trimmed(std::string_view(line).substr(line.find_first_of("eE", line.find_first_of("dD")) + 1));
        std::erase_if(target, [](char c) { return c == '\'' || c == '"'; });
        std::replace(target.begin(), target.end(), '\\', '/');
        // A name in quotes may run over lines.
        const auto quotes = [](const std::string& s) {
          return std::count_if(s.begin(), s.end(), [](char c) { return c == '\'' || c == '"'; });
        };
        for (long open = quotes(line); open % 2 == 1 && std::getline(in, raw); ++number) {
          open += quotes(raw);
          std::string more = trimmed(raw);
          std::erase_if(more, [](char c) { return c == '\'' || c == '"'; });
          std::replace(more.begin(), more.end(), '\\', '/');
          target += more;
        }
        if (depth >= 8 || target.empty()) {
          deck.incomplete = true;
          complain(fmt::format("{}:{}: INCLUDE needs a file, and nests at most 8 deep", path.string(), number));
          continue;
        }
        // Beside the file that names it, else beside the first.
        const std::filesystem::path beside = path.parent_path() / target,
                                    first = std::filesystem::path(deck.files[0]).parent_path() / target;
        read(!std::filesystem::exists(beside, error) && std::filesystem::exists(first, error) ? first : beside, depth + 1,
             fmt::format("{}:{}", path.string(), number));
        continue;
      }
      if (words.starts_with("BEGIN") && (words.find("SUPER") != std::string::npos || words.find("AUXM") != std::string::npos)) {
        complain(fmt::format("{}:{}: {}: superelements and auxiliary models cannot be read: give the whole model behind one BEGIN BULK",
                             path.string(), number, trimmed(line)));
        continue;
      }
      if (words.starts_with("BEGIN") && words.find("BULK") != std::string::npos) {
        // What stood before was executive and case control.
        deck.cards.clear();
        deck.complaints.clear();
        open_cards.clear();
        goes_on.clear();
        tenth = {};
        continue;
      }
      if (words.starts_with("ENDDATA")) {
        ended = true;
        break;
      }
      case_control(words);
      take(line, file, number);
    }
    if (depth == 0) complain_of_tenth("");
    require_whole(in, path);
  }

 private:
  bool ended = false;
  std::string goes_on;                        // what the last line says its continuation begins with
  std::pair<std::string, std::string> tenth;  // of the last line in free fields, where it is a number, and FILE:LINE
  std::map<std::string, size_t> open_cards;   // cards that have such a name and were not followed by their continuation

  void complain(const std::string& text) { deck.complaints.push_back(text); }

  void case_control(const std::string& words) {
    const size_t equals = words.find('=');
    if (equals == std::string::npos) return;
    const std::string key = trimmed(words.substr(0, equals));
    int value = 0;
    const std::string rest = trimmed(words.substr(equals + 1));
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    if ((key != "SPC" && key != "MPC" && key != "NSM") || error != std::errc()) return;
    if (const auto [first, fresh] = deck.chosen.try_emplace(key, value); !fresh && first->second != value)
      deck.also_chosen[key].insert(value);
  }

  void take(const std::string& line, int file, int number) {
    std::vector<std::string> parts;
    const bool free = line.find(',') != std::string::npos;
    std::string head, tail;
    bool large = false;
    if (free) {
      size_t from = 0;
      for (;;) {
        const size_t comma = line.find(',', from);
        parts.push_back(trimmed(std::string_view(line).substr(from, comma == std::string::npos ? comma : comma - from)));
        if (comma == std::string::npos) break;
        from = comma + 1;
      }
      head = parts[0];
      parts.erase(parts.begin());
      large = !head.empty() && (head.back() == '*' || head[0] == '*');
      const size_t room = large ? 4 : 8;
      // One more may name the next line.
      for (size_t k = room + 1; k < parts.size(); ++k)
        if (!parts[k].empty()) {
          complain(fmt::format("{}:{}: {} fields, at most {} are allowed in a line; the next line goes on", deck.files[file], number,
                               parts.size(), room));
          break;
        }
      tail = parts.size() > room ? parts[room] : "";
      parts.resize(room);
    } else {
      head = trimmed(line.substr(0, 8));
      large = !head.empty() && (head.back() == '*' || head[0] == '*');
      const size_t width = large ? 16 : 8, count = large ? 4 : 8;
      for (size_t k = 0; k < count; ++k) {
        const size_t at = 8 + k * width;
        parts.push_back(at < line.size() ? trimmed(std::string_view(line).substr(at, width)) : "");
      }
      if (line.size() > 72) tail = trimmed(std::string_view(line).substr(72, 8));
    }
    head = upper(head);
    tail = upper(tail);
    for (std::string& part : parts) part = upper(part);
    const bool more = head.empty() || head[0] == '+' || head[0] == '*';
    complain_of_tenth(more ? head : "");
    if (free && is_number(tail)) tenth = {tail, fmt::format("{}:{}", deck.files[file], number)};
    if (more) {
      if (deck.cards.empty()) return;
      // It belongs to the line before, unless both have names and these differ: then to the one that names it.
      size_t whose = deck.cards.size() - 1;
      if (head.size() > 1 && !same_name(goes_on, head)) {
        const auto named = open_cards.find(bare(head));
        if (named != open_cards.end()) whose = named->second;
        else if (!goes_on.empty())
          return complain(fmt::format("{}:{}: the line '{}' goes on from no line before it", deck.files[file], number, head));
      }
      NastranCard& card = deck.cards[whose];
      card.fields.insert(card.fields.end(), parts.begin(), parts.end());
      return leave_open(tail, whose);
    }
    NastranCard card;
    card.name = upper(head);
    if (card.name.back() == '*') card.name.pop_back();
    card.fields = std::move(parts);
    card.file = file;
    card.line = number;
    deck.cards.push_back(std::move(card));
    leave_open(tail, deck.cards.size() - 1);
  }

  static bool is_number(const std::string& s) { return !s.empty() && s.find_first_not_of("0123456789.-") == std::string::npos; }

  // In free fields a tenth one that is a number was meant as data, unless the next line (its head, or none) begins with it.
  void complain_of_tenth(const std::string& head) {
    if (!tenth.first.empty() && bare(head) != bare(tenth.first))
      complain(fmt::format("{}: '{}' is the tenth field, which names the line that goes on and is no data: put it into the next line",
                           tenth.second, tenth.first));
    tenth = {};
  }

  // "+A" and "*A" are the same name, and so are "A" in the tenth field and "++A", which names "+A".
  static std::string bare(const std::string& name) { return name.substr(std::min(name.find_first_not_of("+*"), name.size())); }
  static bool same_name(const std::string& tail, const std::string& head) { return bare(tail) == bare(head); }

  void leave_open(const std::string& tail, size_t card) {
    goes_on = tail;
    if (!bare(tail).empty()) open_cards[bare(tail)] = card;
  }
};

}  // namespace

std::string NastranDeck::where(const NastranCard& c) const { return fmt::format("{}:{}", files[c.file], c.line); }

void NastranDeck::fail(const NastranCard& c, const std::string& text) const {
  throw InputError(fmt::format("{}: {}: {}", where(c), c.name, text));
}

double NastranDeck::real(const NastranCard& c, size_t field, double otherwise) const {
  if (blank(c, field)) return otherwise;
  // "1.5-3" is 1.5e-3.
  std::string text;
  const std::string& given = c.fields[field];
  for (size_t i = 0; i < given.size(); ++i) {
    const char ch = given[i];
    const bool sign = ch == '-' || ch == '+';
    if (ch == 'D' || ch == 'd' || ch == 'E') text += 'e';
    else if (sign && i > 0 && !std::isalpha(static_cast<unsigned char>(given[i - 1]))) text += std::string("e") + ch;
    else if (!(ch == '+' && i == 0)) text += ch;
  }
  if (const size_t plus = text.find("e+"); plus != std::string::npos) text.erase(plus + 1, 1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    fail(c, fmt::format("field {}: a number is expected, found '{}'", field + 2, given.substr(0, 20)));
  return value;
}

bool NastranDeck::is_integer(const NastranCard& c, size_t field) const {
  return !blank(c, field) && std::all_of(c.fields[field].begin(), c.fields[field].end(), [](char ch) { return ch >= '0' && ch <= '9'; });
}

int NastranDeck::integer(const NastranCard& c, size_t field, int otherwise) const {
  if (blank(c, field)) return otherwise;
  const std::string& s = c.fields[field];
  int value = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  if (error != std::errc() || end != s.data() + s.size())
    fail(c, fmt::format("field {}: an integer is expected, found '{}'", field + 2, s.substr(0, 20)));
  return value;
}

std::vector<int> NastranDeck::components(const NastranCard& c, size_t field) const {
  std::vector<int> out;
  if (blank(c, field)) return out;
  for (char ch : c.fields[field]) {
    if (ch == '0' || ch == ' ') continue;
    if (ch < '1' || ch > '6')
      fail(c, fmt::format("field {}: motions 1 to 6 are expected, found '{}'", field + 2, c.fields[field].substr(0, 20)));
    out.push_back(ch - '1');
  }
  return out;
}

NastranDeck read_nastran_cards(const std::filesystem::path& path) {
  CardReader reader;
  reader.read(path, 0, path.string());
  return std::move(reader.deck);
}

}  // namespace flexframe::sim
