#include "render/cli/overwrite.h"

#include "render/cli/command.h"

#include "sim/base/file_output.h"
#include "sim/base/files_read.h"

#include <fmt/format.h>

namespace flexframe::cli {
namespace {

namespace fs = std::filesystem;

// The entry of a folder that a name is.
fs::path entry(const fs::path& name) {
  std::error_code error;
  const fs::path whole = fs::absolute(name, error).lexically_normal();
  return fs::weakly_canonical(whole.parent_path(), error) / whole.filename();
}

// Whether writing to `output` takes the place of `input` or of the file that it leads to. A link at the output's name is replaced itself.
bool takes_place(const fs::path& output, const fs::path& input) {
  std::error_code error;
  if (!fs::is_regular_file(input, error)) return false;
  return entry(output) == entry(input) || entry(output) == fs::canonical(input, error);
}

}  // namespace

void require_not_read(const std::vector<fs::path>& outputs, const std::vector<fs::path>& inputs) {
  std::vector<fs::path> read = inputs;
  if (const sim::FilesRead* files = sim::FilesRead::outermost())
    for (const sim::FilesRead::File& file : files->files()) read.push_back(file.path);
  for (auto out = outputs.begin(); out != outputs.end(); ++out) {
    if (out->empty()) continue;
    for (const fs::path& file : read)
      if (!file.empty() && takes_place(*out, file))
        throw UsageError(fmt::format("{} is a file that is read and would be overwritten: give the output another name", out->string()));
    for (auto other = outputs.begin(); other != out; ++other)
      if (!other->empty() && !sim::output_file(*out).stream && entry(*out) == entry(*other))
        throw UsageError(fmt::format("{} would be written twice, as {}: give one of them another name", out->string(),
                                     other->string() == out->string() ? "two outputs" : other->string()));
  }
}

}  // namespace flexframe::cli
