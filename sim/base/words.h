// Words in messages: the nearest known word for a misspelt one, and lists of what is allowed.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// Damerau-Levenshtein distance (optimal string alignment: insert, delete, replace, swap of neighbours), case ignored, in bytes.
int word_distance(std::string_view a, std::string_view b);

// The known word nearest to `word`, or empty when none is near enough to be what was meant (more than a third of its letters differ).
std::string nearest_word(std::string_view word, std::span<const std::string> known);

// "; did you mean 'length'?" or "".
std::string did_you_mean(std::string_view word, std::span<const std::string> known);

// "a, b, c"; beyond `most` words "a, b, ... (12 in all)".
std::string list_words(std::span<const std::string> words, std::size_t most = 40);

// "1 mode", "2 modes"; `many`: a plural that ends in s.
std::string how_many(int count, std::string_view many);

// The text on one line between single quotes, control characters and bytes that are no UTF-8 shown as \xNN, cut after 60 bytes.
std::string quote(std::string_view text);

}  // namespace flexframe::sim
