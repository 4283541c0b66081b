// Summaries as JSON.
#pragma once

#include <string>

namespace flexframe::cli {

// A nlohmann::json or ordered_json as text. Bytes of names of files that are no UTF-8 come out as U+FFFD.
template <class Json>
std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace flexframe::cli
