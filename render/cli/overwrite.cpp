#include "render/cli/overwrite.h"

#include "render/cli/command.h"

#include "sim/base/file_output.h"
#include "sim/base/files_read.h"

#include <fmt/format.h>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

// By any of its names. Devices and pipes may be read and written at once.
bool is_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::is_regular_file(a, error) && fs::equivalent(a, b, error);
}

// Of files that are not there yet.
bool same_name(const fs::path& a, const fs::path& b) {
  std::error_code error;
  if (sim::output_file(a).stream) return false;
  return fs::weakly_canonical(fs::absolute(a, error), error) == fs::weakly_canonical(fs::absolute(b, error), error);
}

}  // namespace

void require_not_read(const std::vector<fs::path>& outputs, const std::vector<fs::path>& inputs) {
  std::vector<fs::path> read = inputs;
  if (const sim::FilesRead* files = sim::FilesRead::outermost())
    for (const sim::FilesRead::File& file : files->files()) read.push_back(file.path);
  for (auto out = outputs.begin(); out != outputs.end(); ++out) {
    if (out->empty()) continue;
    for (const fs::path& file : read)
      if (!file.empty() && is_file(*out, file))
        throw UsageError(fmt::format("{} is a file that is read and would be overwritten: give the output another name", out->string()));
    for (auto other = outputs.begin(); other != out; ++other)
      if (!other->empty() && (is_file(*out, *other) || same_name(*out, *other)))
        throw UsageError(fmt::format("{} would be written twice, as {}: give one of them another name", out->string(),
                                     other->string() == out->string() ? "two outputs" : other->string()));
  }
}

}  // namespace flexframe::cli
