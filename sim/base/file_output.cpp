#include "sim/base/file_output.h"

#include "sim/base/error.h"
#include "sim/base/files_read.h"

#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>

namespace flexframe::sim {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& reason) {
  throw FileError(fmt::format("{}: cannot be written: {}", path.string(), reason));
}

// FIPS 180-4, section 6.2, on 64-byte blocks.
class Sha256 {
 public:
  void add(std::string_view bytes) {
    for (const char c : bytes) {
      block_[filled_++] = static_cast<std::uint8_t>(c);
      if (filled_ == block_.size()) mix();
    }
    length_ += bytes.size();
  }

  std::string digest() {
    const std::uint64_t bits = length_ * 8;
    block_[filled_++] = 0x80;
    if (filled_ > 56) {
      while (filled_ < 64) block_[filled_++] = 0;
      mix();
    }
    while (filled_ < 56) block_[filled_++] = 0;
    for (int i = 7; i >= 0; --i) block_[filled_++] = static_cast<std::uint8_t>(bits >> (8 * i));
    mix();
    std::string text;
    for (const std::uint32_t word : state_) text += fmt::format("{:08x}", word);
    return text;
  }

 private:
  static std::uint32_t turn(std::uint32_t x, int n) { return (x >> n) | (x << (32 - n)); }

  void mix() {
    // the first 32 bits of the fractional parts of the cube roots of the first 64 primes
    static constexpr std::array<std::uint32_t, 64> k{
        0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5, 0xd807aa98, 0x12835b01, 0x243185be,
        0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174, 0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa,
        0x5cb0a9dc, 0x76f988da, 0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967, 0x27b70a85,
        0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85, 0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3,
        0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070, 0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f,
        0x682e6ff3, 0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};
    std::array<std::uint32_t, 64> w;
    for (std::size_t i = 0; i < 16; ++i)
      w[i] = static_cast<std::uint32_t>(block_[4 * i]) << 24 | static_cast<std::uint32_t>(block_[4 * i + 1]) << 16 |
             static_cast<std::uint32_t>(block_[4 * i + 2]) << 8 | block_[4 * i + 3];
    for (std::size_t i = 16; i < 64; ++i) {
      const std::uint32_t s0 = turn(w[i - 15], 7) ^ turn(w[i - 15], 18) ^ (w[i - 15] >> 3);
      const std::uint32_t s1 = turn(w[i - 2], 17) ^ turn(w[i - 2], 19) ^ (w[i - 2] >> 10);
      w[i] = w[i - 16] + s0 + w[i - 7] + s1;
    }
    auto [a, b, c, d, e, f, g, h] = state_;
    for (std::size_t i = 0; i < 64; ++i) {
      const std::uint32_t t1 = h + (turn(e, 6) ^ turn(e, 11) ^ turn(e, 25)) + ((e & f) ^ (~e & g)) + k[i] + w[i];
      const std::uint32_t t2 = (turn(a, 2) ^ turn(a, 13) ^ turn(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
      h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
    }
    const std::array<std::uint32_t, 8> worked{a, b, c, d, e, f, g, h};
    for (std::size_t i = 0; i < 8; ++i) state_[i] += worked[i];
    filled_ = 0;
  }

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, 64> block_{};
  std::size_t filled_ = 0;
  std::uint64_t length_ = 0;
};

// 0, or the errno of the failure.
int write_all(int file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(file, content.data(), content.size());
    if (written >= 0) content.remove_prefix(static_cast<std::size_t>(written));
    else if (errno != EINTR) return errno;
  }
  return 0;
}

// Temporary files of processes of this machine that were killed: "STEM4711" where no process 4711 lives.
void remove_left_over(const std::filesystem::path& folder, const std::string& stem) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(stem)) continue;
    pid_t process = 0;
    const char *begin = name.data() + stem.size(), *end = name.data() + name.size();
    const auto [at, wrong] = std::from_chars(begin, end, process);
    if (wrong != std::errc() || at != end || process <= 0 || ::kill(process, 0) == 0 || errno != ESRCH) continue;
    std::error_code ignored;
    std::filesystem::remove(entry.path(), ignored);
  }
}

}  // namespace

OutputFile output_file(const std::filesystem::path& name) {
  namespace fs = std::filesystem;
  std::error_code error;
  OutputFile out{name};
  const fs::path open_files = fmt::format("/proc/{}/fd", ::getpid());
  constexpr int longest = 40;  // links one after the other, as Linux follows
  fs::path at = name;
  for (int links = 0; links <= longest; ++links) {
    const fs::path folder = fs::canonical(at.has_parent_path() ? at.parent_path() : fs::path("."), error);
    if (!error && folder == open_files) {
      const std::string number = at.filename().string();
      std::from_chars(number.data(), number.data() + number.size(), out.descriptor);
      out.stream = true;
      return out;
    }
    if (!fs::is_symlink(at, error)) break;
    at = at.parent_path() / fs::read_symlink(at, error);
  }
  // Other links are replaced: who planted one shall not lead the writing elsewhere.
  const fs::file_type type = fs::symlink_status(name, error).type();
  out.stream = type == fs::file_type::character || type == fs::file_type::fifo || type == fs::file_type::socket;
  return out;
}

int write_to_stream(const OutputFile& output, std::string_view content) {
  // Opened anew, a file that stdout goes to would be written from its beginning.
  std::fflush(nullptr);
  const int file = output.descriptor >= 0 ? ::dup(output.descriptor) : ::open(output.path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) return errno;
  int reason = write_all(file, content);
  if (::close(file) != 0 && reason == 0) reason = errno;
  return reason;
}

PendingFile::PendingFile(std::filesystem::path final_path) {
  std::error_code error;
  output_ = output_file(final_path);
  final_ = output_.path;
  if (final_.filename().empty() || std::filesystem::is_directory(final_, error)) fail(final_, "it is a directory; a file name is expected");
  if (std::filesystem::is_block_file(std::filesystem::symlink_status(final_, error)))
    fail(final_, "it is a device that holds a file system");
  const std::filesystem::path folder = output_.stream             ? std::filesystem::temp_directory_path(error)
                                       : final_.has_parent_path() ? final_.parent_path()
                                                                  : std::filesystem::path(".");
  if (!std::filesystem::is_directory(folder, error)) fail(final_, fmt::format("the folder {} does not exist", folder.string()));
  char host[256] = {};
  ::gethostname(host, sizeof host - 1);
  const std::string stem = fmt::format(".{}.part-{}-", final_.filename().string(), host);
  temporary_ = folder / fmt::format("{}{}", stem, ::getpid());
  remove_left_over(folder, stem);
  // Ours alone: a link that somebody laid there under this name would lead the writing elsewhere.
  ::unlink(temporary_.c_str());
  const int file = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file < 0) fail(final_, std::strerror(errno));
  ::close(file);
}

PendingFile::~PendingFile() {
  std::error_code ignored;
  if (!committed_) std::filesystem::remove(temporary_, ignored);
}

void PendingFile::commit() {
  if (output_.stream) {
    std::ifstream in(temporary_, std::ios::binary);
    if (const int reason = write_to_stream(output_, read_rest(in, temporary_))) fail(final_, std::strerror(reason));
    return;
  }
  // a rename may reach the disk before the content does
  const int file = ::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) fail(final_, std::strerror(errno));
  const bool synced = ::fsync(file) == 0 || errno == EINVAL || errno == EROFS;
  const int reason = errno;
  ::close(file);
  if (!synced) fail(final_, std::strerror(reason));
  std::error_code error;
  std::filesystem::rename(temporary_, final_, error);
  if (error) fail(final_, error.message());
  committed_ = true;
}

void write_whole_file(const std::filesystem::path& path, std::string_view content) {
  if (const OutputFile output = output_file(path); output.stream) {
    if (const int reason = write_to_stream(output, content)) fail(path, std::strerror(reason));
    return;
  }
  PendingFile pending(path);
  const int file = ::open(pending.path().c_str(), O_WRONLY | O_NOFOLLOW | O_CLOEXEC);
  if (file < 0) fail(path, std::strerror(errno));
  int reason = write_all(file, content);
  if (::close(file) != 0 && reason == 0) reason = errno;
  if (reason != 0) fail(path, std::strerror(reason));
  pending.commit();
}

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.digest();
}

std::string sha256_of_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return {};
  std::ifstream in(path, std::ios::binary);
  if (!in) return {};
  Sha256 hash;
  std::vector<char> block(1 << 16);
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())), in.gcount() > 0)
    hash.add({block.data(), static_cast<std::size_t>(in.gcount())});
  return in.bad() ? std::string{} : hash.digest();
}

}  // namespace flexframe::sim
