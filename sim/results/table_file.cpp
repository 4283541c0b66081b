#include "sim/results/table_file.h"

#include "sim/base/error.h"
#include "sim/base/hdf5_file.h"

#include <map>

#include <fmt/format.h>

namespace flexframe::sim {

using namespace hdf5;

void write_table_file(const TableFile& table, const std::filesystem::path& path) {
  for (const TableFile::Numbers& set : table.numbers)
    if (!set.values.allFinite())
      throw SimulationError(fmt::format("the table cannot be written: {}/{} holds a value that is not finite", set.group, set.name));
  write_hdf5(path, [&](hid_t file) {
    for (const auto& [name, text] : table.attributes) write_attribute(file, name, text);
    std::map<std::string, Id> groups;
    const auto group = [&](const std::string& name) -> hid_t {
      const std::size_t slash = name.find('/');
      if (slash != std::string::npos && !groups.contains(name.substr(0, slash)))
        groups.emplace(name.substr(0, slash), make_group(file, name.substr(0, slash)));
      if (!groups.contains(name)) groups.emplace(name, make_group(file, name));
      return groups.at(name);
    };
    for (const TableFile::Numbers& set : table.numbers)
      write_numbers(group(set.group), set.name, set.values, {static_cast<hsize_t>(set.values.size())}, "", set.meaning);
    for (const TableFile::Texts& set : table.texts) write_texts(group(set.group), set.name, set.values);
  });
}

}  // namespace flexframe::sim
