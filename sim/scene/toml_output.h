// TOML text of a document that was read (toml_input.h).
#pragma once

#include "sim/scene/toml_input.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace flexframe::sim {

// Reads back to the same values, bit for bit. Keys of the root become tables [a] and [[a]]; all below is written inline. Dates are left
// out: the words of scene files have none.
std::string write_toml(const TomlValue& root);

// Values and tables of one's own, to be written.
TomlValue toml_text(std::string text);
TomlValue toml_number(double number);
TomlValue toml_count(std::int64_t count);
TomlValue toml_truth(bool truth);
TomlValue toml_list(std::vector<TomlValue> items);
TomlValue toml_texts(std::span<const std::string> texts);
// At the end of a table; the key must be new.
void toml_put(TomlValue& table, const std::string& key, TomlValue value);

}  // namespace flexframe::sim
