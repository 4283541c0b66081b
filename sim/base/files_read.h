// Which files a piece of work read, with what was in them: for those who keep what came of it and must know when it no longer holds.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace flexframe::sim {

// While it lives, files that the readers of this thread open and name by note_file_read() are kept, each once, in their order.
class FilesRead {
 public:
  enum class Keep { paths, contents };
  explicit FilesRead(Keep keep = Keep::contents);
  ~FilesRead();
  FilesRead(const FilesRead&) = delete;
  FilesRead& operator=(const FilesRead&) = delete;
  struct File {
    std::filesystem::path path;  // absolute
    std::string sha256;          // when it was opened; empty: it cannot be read twice, or paths only are kept
  };
  const std::vector<File>& files() const { return files_; }
  // The one that has lived longest, of this thread. nullptr: none lives.
  static const FilesRead* outermost();

 private:
  friend void note_file_read(const std::filesystem::path& path);
  std::vector<File> files_;
  Keep keep_;
  FilesRead* outer_;
};

// Every reader of models calls it for every file that it opens. Costs nothing where nobody asks.
void note_file_read(const std::filesystem::path& path);

// Passes over the mark of UTF-8 (EF BB BF) that some editors put before a text, and that would make its first word another.
void skip_byte_order_mark(std::istream& in);

// After the last line that std::getline gave: throws InputError where the disk or the net gave no more, which is no end of the file.
void require_whole(const std::istream& in, const std::filesystem::path& path);
// All that a stream still gives. Throws as require_whole.
std::string read_rest(std::istream& in, const std::filesystem::path& path);

}  // namespace flexframe::sim
