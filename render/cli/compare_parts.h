// What the tasks of a comparison found, kept in a folder: the comparison of all of them then need not look at these pictures again.
#pragma once

#include "render/image/compare_pairs.h"

#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string>

namespace flexframe::cli {

// Files part_I_of_N.json of a folder. A pair is known again by the SHA-256 of its pictures and masks, the rule and the program, so that a
// picture that has changed since is compared anew. Texts that are damaged or of something else are passed over.
class CompareParts {
 public:
  // Reads what is there; a folder that is missing holds nothing. request: of which rule, regions and mask count.
  CompareParts(std::filesystem::path folder, const render::CompareRequest& request);

  // For CompareRequest::recall.
  bool recall(render::ComparedPair& pair, std::span<const std::filesystem::path> baselines);

  // Writes what was compared, whole or not at all. Throws FileError.
  void write(int shard, int shards, const render::Comparison& comparison) const;

  int recalled() const { return recalled_; }  // pairs

 private:
  std::filesystem::path folder_;
  std::string question_;  // all that decides a verdict but the pictures
  std::filesystem::path mask_;
  std::map<std::string, std::string> known_;  // key -> a row of JSON
  std::map<std::string, std::string> keys_;   // name -> key, of the pairs that were asked for
  std::mutex guard_;
  int recalled_ = 0;
};

}  // namespace flexframe::cli
