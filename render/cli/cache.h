// Where the program keeps what saves work the next time, and the bodies that it reduced.
//
// --cache DIR, or the variable FLEXFRAME_CACHE: a folder, or "none"; else the user's: $XDG_CACHE_HOME/flexframe or ~/.cache/flexframe. It
// holds files named by the content that they follow from, so that nothing in it can be out of date: mapped modes (interp/modes.h) and
// reduced bodies. It may be removed at any time; where it cannot be written nothing is kept, and nothing else changes.
#pragma once

#include "sim/base/files_read.h"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::cli {

extern const char* const cache_help;

// The folder that the word (of --cache) stands for; empty: none.
std::filesystem::path cache_folder(const std::string& word);

// What was kept of a piece of work: texts by name.
using KeptTexts = std::map<std::string, std::string>;

// A file of the cache, named by `question`: all that decides the work but for the files that it reads, which are told when it is kept and
// must then have the content they had. kind: its ending, "body".
class KeptWork {
 public:
  KeptWork(const std::filesystem::path& folder, const std::string& kind, const std::string& question);

  // None where there is nothing, it is damaged, or a file changed.
  std::optional<KeptTexts> read() const;
  // files: that the work read. Never throws for a folder that refuses.
  void keep(const KeptTexts& texts, const std::vector<sim::FilesRead::File>& files) const;
  const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path folder_, file_;
};

}  // namespace flexframe::cli
