// Finite element decks written down in a test: read, reduced to their modes, and what was told of them.
#pragma once

#include "scratch.h"
#include "sim/reduce/fe_model.h"
#include "sim/reduce/reduce.h"

#include <algorithm>
#include <string>
#include <vector>

namespace flexframe::sim {

// Nastran bulk data.
inline FeModel bulk(const std::string& text) {
  const Scratch scratch;
  return read_nastran(scratch.put("deck.bdf", text));
}

// What the reader says against a deck of bulk data; empty: it takes it.
inline std::string bulk_refusal(const std::string& text) {
  try {
    bulk(text);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

// The lowest modes, held where the deck holds it.
inline Reduction reduced(const FeModel& m, int modes) {
  ReduceOptions o;
  o.method = ReduceMethod::eigenmodes;
  o.modes = modes;
  o.held = m.constraints;
  o.stiffening = false;
  return reduce(m, o);
}

inline bool says(const std::vector<std::string>& texts, const std::string& part) {
  return std::any_of(texts.begin(), texts.end(), [&](const std::string& t) { return t.find(part) != std::string::npos; });
}

}  // namespace flexframe::sim
