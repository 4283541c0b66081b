#include "sim/base/files_read.h"

#include "sim/base/error.h"
#include "sim/base/file_output.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <istream>

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

thread_local FilesRead* innermost = nullptr;

}  // namespace

FilesRead::FilesRead(Keep keep) : keep_(keep), outer_(innermost) { innermost = this; }
FilesRead::~FilesRead() { innermost = outer_; }

const FilesRead* FilesRead::outermost() {
  const FilesRead* out = innermost;
  while (out && out->outer_) out = out->outer_;
  return out;
}

void note_file_read(const std::filesystem::path& path) {
  if (!innermost) return;
  std::error_code error;
  const std::filesystem::path whole = std::filesystem::absolute(path, error);
  std::string hash;
  for (FilesRead* each = innermost; each; each = each->outer_) {
    const bool there = std::any_of(each->files_.begin(), each->files_.end(), [&](const FilesRead::File& f) { return f.path == whole; });
    if (there) continue;
    const bool hashed = each->keep_ == FilesRead::Keep::contents;
    if (hashed && hash.empty() && std::filesystem::is_regular_file(whole, error)) hash = sha256_of_file(whole);
    each->files_.push_back({whole, hashed ? hash : ""});
  }
}

void skip_byte_order_mark(std::istream& in) {
  for (const int byte : {0xEF, 0xBB, 0xBF}) {
    if (in.peek() != byte) {
      in.clear();
      in.seekg(0);
      return;
    }
    in.get();
  }
}

void require_whole(const std::istream& in, const std::filesystem::path& path) {
  if (in.bad()) throw InputError(fmt::format("{}: cannot be read to its end: {}", path.string(), std::strerror(errno)));
}

std::string read_rest(std::istream& in, const std::filesystem::path& path) {
  // Character by character through the stream's iterators it took half of the time of setting up a body.
  std::string text;
  std::vector<char> piece(1 << 16);
  while (in.read(piece.data(), static_cast<std::streamsize>(piece.size())), in.gcount() > 0)
    text.append(piece.data(), static_cast<std::size_t>(in.gcount()));
  require_whole(in, path);
  return text;
}

}  // namespace flexframe::sim
