#include "interp/disk_cache.h"
#include "scratch.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <set>
#include <string>

namespace flexframe::interp::test_disk_cache {
namespace {

namespace fs = std::filesystem;

void make(const fs::path& file, std::size_t bytes, int age) {
  std::ofstream(file) << std::string(bytes, 'x');
  fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(age));
}

std::set<std::string> names(const fs::path& folder) {
  std::set<std::string> out;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) out.insert(entry.path().filename().string());
  return out;
}

TEST(InterpDiskCache, WhatWasNotUsedForLongestGoesFirst) {
  const Scratch scratch;
  const fs::path folder = scratch.path();
  make(folder / "a.modes", 100, 5);
  make(folder / "b.modes", 100, 4);
  make(folder / "c.modes", 100, 3);
  make(folder / "d.modes", 100, 2);
  make(folder / "old.txt", 1000, 9);
  bound_cache(folder, ".modes", {.bytes = 400, .files = 4});
  EXPECT_EQ(names(folder).size(), 5u);
  mark_used(folder / "a.modes");
  bound_cache(folder, ".modes", {.bytes = 250, .files = 4});
  EXPECT_EQ(names(folder), (std::set<std::string>{"a.modes", "d.modes", "old.txt"}));
  bound_cache(folder, ".modes", {.bytes = 1000, .files = 1});
  EXPECT_EQ(names(folder), (std::set<std::string>{"a.modes", "old.txt"}));
  bound_cache(folder / "none", ".modes");
  mark_used(folder / "none");
}

}  // namespace
}  // namespace flexframe::interp::test_disk_cache
