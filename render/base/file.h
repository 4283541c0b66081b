// Files written whole or not at all. Errors are FileError with the path and the system's reason.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace flexframe::render {

// The bytes appear under the name at once, complete, replacing what was there. Until then they have no name (O_TMPFILE)
// or, where the file system knows no nameless files, a temporary one in the same folder that is removed on failure.
void write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

// Removes the temporary files that killed processes left in a folder for files whose names begin with start.
void remove_parts(const std::filesystem::path& folder, std::string_view start);

// All bytes of a file. Throws FileError.
std::vector<std::uint8_t> read_file(const std::filesystem::path& path);

}  // namespace flexframe::render
