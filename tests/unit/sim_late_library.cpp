// Libraries that are opened when their first function is called.
#include "sim/base/late_library.h"

#include "sim/base/error.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flexframe::sim::test_late_library {
namespace {

std::string message_of(auto&& call) {
  try {
    call();
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(LateLibrary, FunctionsAreThoseOfTheLibrary) {
  const LateLibrary mathematics("libm.so.6", "roots");
  double (*const cube_root)(double) = mathematics.function("cbrt");
  EXPECT_DOUBLE_EQ(cube_root(27.0), 3.0);
}

TEST(LateLibrary, SaysWhatIsMissingAndWhatForItIsNeeded) {
  const std::string library = message_of([] { LateLibrary("libnobody_has.so.7", "files of nobody"); });
  EXPECT_NE(library.find("files of nobody"), std::string::npos) << library;
  EXPECT_NE(library.find("libnobody_has.so.7"), std::string::npos) << library;
  const std::string function = message_of([] { LateLibrary("libm.so.6", "roots").function("nobody_has"); });
  EXPECT_NE(function.find("libm.so.6 has no function nobody_has"), std::string::npos) << function;
}

}  // namespace
}  // namespace flexframe::sim::test_late_library
