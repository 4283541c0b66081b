#include "sim/base/words.h"

#include <algorithm>

#include <fmt/format.h>

namespace flexframe::sim {

namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// Words of textbooks and other programs, and what is called so here. Where several are, the first one that is known.
struct OtherWord {
  std::string_view word, ours;
};
constexpr OtherWord other_words[]{
    // joints
    {"fixed", "weld"},
    {"rigid", "weld"},
    {"clamp", "weld"},
    {"hinge", "revolute"},
    {"pin", "revolute"},
    {"continuous", "revolute"},
    {"rotational", "revolute"},
    {"slider", "prismatic"},
    {"sliding", "prismatic"},
    {"translational", "prismatic"},
    {"ball", "spherical"},
    {"cardan", "universal"},
    {"hooke", "universal"},
    {"floating", "free"},
    {"helical", "screw"},
    // bodies and their matter
    {"flexible", "beam"},
    {"elastic", "beam"},
    {"fe", "finite-element"},
    {"fem", "finite-element"},
    {"e", "youngs_modulus"},
    {"young", "youngs_modulus"},
    {"modulus", "youngs_modulus"},
    {"nu", "poisson"},
    {"poisson_ratio", "poisson"},
    {"poissons_ratio", "poisson"},
    {"rho", "density"},
    {"com", "centre_of_mass"},
    {"cog", "centre_of_mass"},
    {"round", "circle"},
    {"rect", "rectangle"},
    {"pipe", "tube"},
    // runs
    {"t_end", "duration"},
    {"tend", "duration"},
    {"end_time", "duration"},
    {"stop_time", "duration"},
    {"final_time", "duration"},
    {"dt", "output_rate"},
    {"time_step", "output_rate"},
    {"timestep", "output_rate"},
    {"step", "output_rate"},
    {"fps", "frame_rate"},
    {"rtol", "tolerance"},
    {"solver", "method"},
    {"integrator", "method"},
    {"static_start", "start"},
    // forces and outputs
    {"magnitude", "value"},
    {"amplitude", "value"},
    {"moment", "torque"},
    {"spring", "spring-damper"},
    {"damper", "spring-damper"},
    {"type", "kind"},
    {"angle", "value"},
};

constexpr std::size_t longest_compared = 64;  // names longer than that are no misspelt keys, and the cost is quadratic

// Length of the UTF-8 sequence at the front of `text`, 0 if it is malformed.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xC0) != 0x80) return 0;
  return length;
}

}  // namespace

int word_distance(std::string_view a, std::string_view b) {
  const std::size_t n = b.size();
  std::vector<int> before(n + 1), previous(n + 1), current(n + 1);
  for (std::size_t j = 0; j <= n; ++j) previous[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= n; ++j) {
      const int replace = previous[j - 1] + (lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1);
      current[j] = std::min({replace, previous[j] + 1, current[j - 1] + 1});
      if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]))
        current[j] = std::min(current[j], before[j - 2] + 1);
    }
    std::swap(before, previous);
    std::swap(previous, current);
  }
  return previous[n];
}

std::string nearest_word(std::string_view word, std::span<const std::string> known) {
  if (word.size() > longest_compared) return {};
  const std::string* best = nullptr;
  int best_distance = 0;
  for (const std::string& candidate : known) {
    if (candidate.size() > longest_compared) continue;
    const int distance = word_distance(word, candidate);
    const int allowed = std::max<int>(1, static_cast<int>(std::max(word.size(), candidate.size())) / 3);
    if (distance > allowed || distance >= static_cast<int>(candidate.size())) continue;
    if (!best || distance < best_distance) best = &candidate, best_distance = distance;
  }
  return best ? *best : std::string{};
}

std::string did_you_mean(std::string_view word, std::span<const std::string> known) {
  std::string near = nearest_word(word, known);
  for (const OtherWord& other : other_words)
    if (near.empty() && word_distance(word, other.word) == 0 && std::find(known.begin(), known.end(), other.ours) != known.end())
      near = other.ours;
  return near.empty() ? std::string{} : fmt::format("; did you mean '{}'?", near);
}

std::string list_words(std::span<const std::string> words, std::size_t most) {
  if (words.empty()) return "none";
  std::string list;
  for (std::size_t i = 0; i < std::min(most, words.size()); ++i) {
    if (i > 0) list += ", ";
    list += words[i];
  }
  if (words.size() > most) list += fmt::format(", ... ({} in all)", words.size());
  return list;
}

std::string how_many(int count, std::string_view many) {
  if (count == 1) many.remove_suffix(1);
  return fmt::format("{} {}", count, many);
}

std::string quote(std::string_view text) {
  constexpr std::size_t longest = 60;
  std::string shown = "'";
  while (!text.empty()) {
    if (shown.size() > longest) {
      shown += "...";
      break;
    }
    const std::size_t length = utf8_length(text);
    const auto first = static_cast<unsigned char>(text[0]);
    if (length == 0 || first < 0x20 || first == 0x7F) {
      shown += fmt::format("\\x{:02x}", first);
      text.remove_prefix(1);
    } else {
      shown += text.substr(0, length);
      text.remove_prefix(length);
    }
  }
  return shown + "'";
}

}  // namespace flexframe::sim
