// Readers that want a file: bytes as a file in memory (/dev/shm), one a process, rewritten for each input.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <unistd.h>

namespace fuzz {

inline std::filesystem::path scratch_file(const std::uint8_t* data, std::size_t size, const char* ending) {
  static const std::filesystem::path folder = [] {
    const std::filesystem::path path = "/dev/shm/flexframe_fuzz_" + std::to_string(::getpid());
    std::filesystem::create_directories(path);
    return path;
  }();
  const std::filesystem::path path = folder / (std::string("input") + ending);
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file || (size > 0 && std::fwrite(data, 1, size, file) != size) || std::fclose(file) != 0) std::abort();
  return path;
}

// A refusal is an answer: one line that names the file.
inline void require_answer(const std::string& message, const char* word) {
  if (message.find('\n') != std::string::npos || message.find(word) == std::string::npos) {
    std::fprintf(stderr, "not an answer: %s\n", message.c_str());
    std::abort();
  }
}

}  // namespace fuzz
