// Readers that want a file: bytes as a file in memory (/dev/shm), one a process, rewritten for each input.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
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

// A refusal is an answer: lines that each name the file, one unless the reader tells all that is wrong at once.
inline void require_answer(const std::string& message, const char* word, int most_lines = 1) {
  std::istringstream lines(message);
  int count = 0;
  bool named = true;
  for (std::string line; std::getline(lines, line); ++count) named = named && line.find(word) != std::string::npos;
  if (count == 0 || count > most_lines || !named) {
    std::fprintf(stderr, "not an answer: %s\n", message.c_str());
    std::abort();
  }
}

}  // namespace fuzz
