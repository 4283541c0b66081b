// Files that appear under their final name whole or not at all, and the fingerprints of inputs.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace flexframe::sim {

// What a name stands for where files are written: a file that appears under it, in place of a link that may lie there, or a stream.
struct OutputFile {
  std::filesystem::path path;
  bool stream = false;  // a pipe, a terminal or the like, or an open file of this process (/dev/stdout): written to, never replaced
  int descriptor = -1;  // of the open file
};
OutputFile output_file(const std::filesystem::path& name);

// Adds to what a stream was given. 0, or the errno of the failure.
int write_to_stream(const OutputFile& output, std::string_view content);

// A file in the making, beside its final name; removed unless committed.
class PendingFile {
 public:
  // Makes it, empty and by nobody else's hand. Throws FileError when the folder is missing or refuses, or the name is a directory. That of
  // a stream lies among the system's temporary files.
  explicit PendingFile(std::filesystem::path final_path);
  ~PendingFile();
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;

  const std::filesystem::path& path() const { return temporary_; }
  // Flushes to the disk and renames; copies what is for a stream. Throws FileError.
  void commit();

 private:
  std::filesystem::path final_, temporary_;
  OutputFile output_;
  bool committed_ = false;
};

// Throws FileError naming the path and the reason (no folder, no permission, disk full).
void write_whole_file(const std::filesystem::path& path, std::string_view content);

// SHA-256 (FIPS 180-4) in hexadecimal.
std::string sha256(std::string_view bytes);
// The same of a file; empty when it cannot be read.
std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace flexframe::sim
