// What is wrong with a finite element model, collected so that all of it is told at once.
#pragma once

#include "sim/base/error.h"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace flexframe::sim {

inline void add_once(std::vector<std::string>& texts, const std::string& text) {
  if (std::find(texts.begin(), texts.end(), text) == texts.end()) texts.push_back(text);
}

struct FeComplaints {
  std::vector<std::string> texts;

  // Runs what may throw InputError; its message is kept, once.
  template <class Work>
  void guarded(const Work& work) {
    try {
      work();
    } catch (const InputError& e) {
      add_once(texts, e.what());
    }
  }

  // Throws InputError with the first thirty, a line each; nothing where there are none.
  void raise(const std::string& file) const {
    constexpr std::size_t most = 30;
    if (texts.empty()) return;
    std::vector<std::string> shown(texts.begin(), texts.begin() + static_cast<std::ptrdiff_t>(std::min(most, texts.size())));
    if (texts.size() > most) shown.push_back(fmt::format("{}: and {} more", file, texts.size() - most));
    throw InputError(fmt::format("{}", fmt::join(shown, "\n")));
  }
};

}  // namespace flexframe::sim
