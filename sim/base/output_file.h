// Where the bytes of an output go: a file by whatever name, or a stream. Nothing but this header, so that the renderer, which is no part of
// the simulation, has it too.
#pragma once

#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace flexframe::sim {

// What a name stands for where files are written: the file that a link leads to, not the link.
struct OutputFile {
  std::filesystem::path path;
  bool stream = false;  // a pipe, a device or an open file of this process (/dev/stdout): written to, never replaced
  int descriptor = -1;  // of the open file
};

inline OutputFile output_file(const std::filesystem::path& name) {
  namespace fs = std::filesystem;
  std::error_code error;
  OutputFile out{name};
  const fs::path open_files = "/proc/" + std::to_string(::getpid()) + "/fd";
  constexpr int longest = 40;  // links one after the other, as Linux follows
  for (int links = 0; links <= longest; ++links) {
    const fs::path folder = fs::canonical(out.path.has_parent_path() ? out.path.parent_path() : fs::path("."), error);
    if (!error && folder == open_files) {
      const std::string number = out.path.filename().string();
      std::from_chars(number.data(), number.data() + number.size(), out.descriptor);
      out.stream = true;
      return out;
    }
    if (!fs::is_symlink(out.path, error)) break;
    out.path = out.path.parent_path() / fs::read_symlink(out.path, error);
  }
  const fs::file_type type = fs::status(out.path, error).type();
  out.stream = type == fs::file_type::character || type == fs::file_type::fifo || type == fs::file_type::socket ||
               type == fs::file_type::block;
  return out;
}

// 0, or the errno of the failure.
inline int write_all(int file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(file, content.data(), content.size());
    if (written >= 0) content.remove_prefix(static_cast<std::size_t>(written));
    else if (errno != EINTR) return errno;
  }
  return 0;
}

// Adds to what a stream was given. 0, or the errno of the failure.
inline int write_to_stream(const OutputFile& output, std::string_view content) {
  // Opened anew, a file that stdout goes to would be written from its beginning.
  std::fflush(nullptr);
  const int file = output.descriptor >= 0 ? ::dup(output.descriptor) : ::open(output.path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) return errno;
  int reason = write_all(file, content);
  if (::close(file) != 0 && reason == 0) reason = errno;
  return reason;
}

}  // namespace flexframe::sim
