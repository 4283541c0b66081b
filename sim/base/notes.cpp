#include "sim/base/notes.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// More than a person reads: the others are counted.
constexpr std::size_t most_owners = 12;

// "body 'a'", "body 'b'" -> "body 'a' and 'b'": the kind is said once where it is the same.
std::string join_owners(const std::vector<std::string>& owners) {
  const auto kind = [](const std::string& owner) { return owner.substr(0, owner.find(' ')); };
  std::string out = owners.front();
  for (std::size_t i = 1; i < owners.size(); ++i) {
    if (i == most_owners && owners.size() > most_owners + 1) return out + " and " + std::to_string(owners.size() - most_owners) + " more";
    const bool same = kind(owners[i]) == kind(owners[i - 1]) && owners[i].find(' ') != std::string::npos;
    out += i + 1 == owners.size() ? " and " : ", ";
    out += same ? owners[i].substr(owners[i].find(' ') + 1) : owners[i];
  }
  return out;
}

}  // namespace

void Notes::tell(const std::vector<std::string>& texts) {
  for (const std::string& text : texts) tell("", text);
}

void Notes::warn(const std::vector<std::string>& texts) {
  for (const std::string& text : texts) warn("", text);
}

void Notes::append(const Notes& other) { all_.insert(all_.end(), other.all_.begin(), other.all_.end()); }

void Notes::prepend(const Notes& other) { all_.insert(all_.begin(), other.all_.begin(), other.all_.end()); }

bool Notes::has(Severity severity) const {
  return std::any_of(all_.begin(), all_.end(), [&](const Note& n) { return n.severity == severity; });
}

std::vector<std::string> Notes::texts(Severity severity) const {
  struct Line {
    std::vector<std::string> owners;
    const std::string* text;
  };
  std::vector<Line> lines;
  for (const Note& note : all_) {
    if (note.severity != severity) continue;
    const auto same = std::find_if(lines.begin(), lines.end(), [&](const Line& l) { return *l.text == note.text; });
    if (same == lines.end()) lines.push_back({{note.owner}, &note.text});
    else if (std::find(same->owners.begin(), same->owners.end(), note.owner) == same->owners.end()) same->owners.push_back(note.owner);
  }
  std::vector<std::string> out;
  for (Line& line : lines) {
    std::erase(line.owners, std::string());
    out.push_back(line.owners.empty() ? *line.text : join_owners(line.owners) + ": " + *line.text);
  }
  return out;
}

}  // namespace flexframe::sim
