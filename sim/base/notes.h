// What a run has to say beside its numbers, by how much it matters.
#pragma once

#include <string>
#include <vector>

namespace flexframe::sim {

// note: what was chosen or done. warning: a number may be wrong by more than what was asked; --strict fails on it.
enum class Severity { note, warning };

struct Note {
  Severity severity = Severity::note;
  std::string owner;  // "body 'rod'", "joint 'pin'", or empty: the whole scene
  std::string text;   // one sentence without a full stop, in lower case where an owner stands before it
  bool operator==(const Note&) const = default;
};

class Notes {
 public:
  // A note, a warning.
  void tell(std::string owner, std::string text) { all_.push_back({Severity::note, std::move(owner), std::move(text)}); }
  void warn(std::string owner, std::string text) { all_.push_back({Severity::warning, std::move(owner), std::move(text)}); }
  // Notes of the whole scene, one a text.
  void tell(const std::vector<std::string>& texts);
  void warn(const std::vector<std::string>& texts);
  void append(const Notes& other);
  void prepend(const Notes& other);

  const std::vector<Note>& all() const { return all_; }
  // Is there one of this severity?
  bool has(Severity severity) const;
  std::size_t size() const { return all_.size(); }
  bool operator==(const Notes&) const = default;

  // "body 'rod': bending_xz is off, ..." in order of first appearance; equal texts of several owners are one line with all of them:
  // "body 'a', 'b' and 'c': ...".
  std::vector<std::string> texts(Severity severity) const;

 private:
  std::vector<Note> all_;
};

}  // namespace flexframe::sim
