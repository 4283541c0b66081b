#include "sim/scene/fingerprint.h"

#include "sim/base/file_output.h"

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

namespace fs = std::filesystem;

// Fingerprints of the files that a document names (keys "file" and "mesh"), relative to the scene's folder.
void add_files(const TomlValue& value, const fs::path& folder, std::string& out) {
  for (std::size_t k = 0; k < value.items.size(); ++k) {
    const TomlValue& item = value.items[k];
    if (item.type == TomlValue::Type::text && value.type == TomlValue::Type::table && (value.keys[k] == "file" || value.keys[k] == "mesh"))
      out +=
          fmt::format("{} {}\n", item.text, sha256_of_file(fs::path(item.text).is_absolute() ? fs::path(item.text) : folder / item.text));
    else add_files(item, folder, out);
  }
}

}  // namespace

std::string inputs_fingerprint(const SceneDocument& document) {
  std::string all = document.text + "\n";
  add_files(document.root, document.file.parent_path(), all);
  return sha256(all);
}

}  // namespace flexframe::sim
