#include "render/cli/cache.h"

#include "interp/disk_cache.h"
#include "sim/base/error.h"
#include "sim/base/file_output.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <utility>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t check_length = 64;

}  // namespace

const char* const cache_help =
    "folder for mapped modes and reduced bodies, used again by later runs, or none; default: flexframe in the user's cache (~/.cache)";

fs::path cache_folder(const std::string& word) {
  if (word == "none") return {};
  if (!word.empty()) return word;
  const char *cache = std::getenv("XDG_CACHE_HOME"), *home = std::getenv("HOME");
  // Relative ones are to be ignored (XDG base directory specification).
  if (cache && *cache == '/') return fs::path(cache) / "flexframe";
  if (home && *home == '/') return fs::path(home) / ".cache" / "flexframe";
  return {};
}

KeptWork::KeptWork(const fs::path& folder, const std::string& kind, const std::string& question)
    : folder_(folder), file_(folder.empty() ? fs::path() : folder / (sim::sha256(question).substr(0, 32) + "." + kind)) {}

std::optional<KeptTexts> KeptWork::read() const {
  if (file_.empty()) return std::nullopt;
  std::ifstream in(file_, std::ios::binary);
  if (!in) return std::nullopt;
  // What cannot be read (a folder, a disk that fails) ends early: it has another checksum.
  std::ostringstream text;
  text << in.rdbuf();
  const std::string data = std::move(text).str();
  if (data.size() <= check_length) return std::nullopt;
  const std::string content = data.substr(check_length);
  if (sim::sha256(content) != data.substr(0, check_length)) return std::nullopt;
  const std::vector<std::uint8_t> bytes(content.begin(), content.end());
  const nlohmann::json kept = nlohmann::json::from_cbor(bytes, true, false);
  if (!kept.is_object()) return std::nullopt;
  for (const auto& [path, hash] : kept.at("files").items())
    if (sim::sha256_of_file(path) != hash.get<std::string>()) return std::nullopt;
  interp::mark_used(file_);
  return kept.at("texts").get<KeptTexts>();
}

void KeptWork::keep(const KeptTexts& texts, const std::vector<sim::FilesRead::File>& files) const {
  if (file_.empty()) return;
  nlohmann::json kept = {{"texts", texts}, {"files", nlohmann::json::object()}};
  for (const sim::FilesRead::File& file : files) {
    if (file.sha256.empty()) return;  // a pipe: it could not be looked at again
    kept["files"][file.path.string()] = file.sha256;
  }
  const std::vector<std::uint8_t> bytes = nlohmann::json::to_cbor(kept);
  const std::string content(bytes.begin(), bytes.end());
  std::error_code error;
  fs::create_directories(folder_, error);
  try {
    sim::write_whole_file(file_, sim::sha256(content) + content);
  } catch (const FileError&) {
    return;  // a cache that cannot be written costs time, not the work
  }
  interp::bound_cache(folder_, file_.extension());
}

}  // namespace flexframe::cli
