// Many pictures of a sequence in one.
#pragma once

#include <filesystem>

namespace flexframe::film {

// Reads `count` pictures, evenly spread over folder/frame_%05d.png number first..first+pictures-1 with the first and the last among them,
// reduces each so that the sheet is at most 1920 pixels wide (no less than 160 each), and writes them row by row into one PNG.
// Fewer pictures than asked for: all. Throws FileError with path and reason if one cannot be read or the sheet not written.
void write_contact_sheet(const std::filesystem::path& folder, int first, int pictures, int count, const std::filesystem::path& path);

}  // namespace flexframe::film
