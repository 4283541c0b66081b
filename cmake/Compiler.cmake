# One set of warnings and floating-point rules for every target of the project.
# Goldens depend on the bits: no -march=native, no -ffast-math, no contraction.
add_library(flexframe_options INTERFACE)
target_compile_options(flexframe_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -ffp-contract=off)
target_include_directories(flexframe_options INTERFACE ${PROJECT_SOURCE_DIR})

# g++ 12 sees overlaps and bounds that are not there in inlined std::string and Eigen code at -O3 (GCC bugs 105329, 105651, 106199);
# clang checks the same code without them.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 14)
  target_compile_options(flexframe_options INTERFACE
    -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread -Wno-maybe-uninitialized)
endif()

set(FLEXFRAME_SANITIZE "" CACHE STRING "sanitizers, for example address,undefined")
if(FLEXFRAME_SANITIZE)
  target_compile_options(flexframe_options INTERFACE
    -fsanitize=${FLEXFRAME_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=undefined)
  target_link_options(flexframe_options INTERFACE -fsanitize=${FLEXFRAME_SANITIZE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    target_compile_options(flexframe_options INTERFACE -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/tests/sanitizers/eigen.txt)
  endif()
endif()

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

# Parsing Eigen, the standard library and the project's own headers takes most of a build's time. Where no ccache keeps objects, each
# library parses once what most of its files include.
if(CCACHE)
  set(precompile OFF)
else()
  set(precompile ON)
endif()
option(FLEXFRAME_PRECOMPILE "precompiled headers" ${precompile})
# g++ that collects garbage less often takes a sixth less time for a file full of Eigen, and a seventh more memory (1 GB at most).
if(FLEXFRAME_PRECOMPILE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(flexframe_options INTERFACE "SHELL:--param ggc-min-expand=400" "SHELL:--param ggc-min-heapsize=400000")
endif()
# flexframe_precompile(TARGET HEADER...): these, fmt and the usual ones of the standard library.
function(flexframe_precompile target)
  if(FLEXFRAME_PRECOMPILE)
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <charconv> <cmath> <filesystem> <fstream> <functional> <limits> <map>
      <memory> <numeric> <optional> <set> <span> <sstream> <stdexcept> <string> <string_view> <unordered_map> <variant> <vector>
      <fmt/format.h> ${ARGN})
    # CMake 3.25 gives its list of these headers an old date: without this a changed list leaves the old result, which clang refuses.
    set_source_files_properties(${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${target}.dir/cmake_pch.hxx.cxx PROPERTIES
      OBJECT_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/CMakeLists.txt;${PROJECT_SOURCE_DIR}/cmake/Compiler.cmake")
  endif()
endfunction()

# tests/coverage.sh: which lines of a library run. Tests and what draws are compiled as ever.
option(FLEXFRAME_COVERAGE "count the runs of every line of sim and interp (gcc)" OFF)
function(flexframe_count_lines target)
  if(FLEXFRAME_COVERAGE)
    target_compile_options(${target} PRIVATE --coverage -fprofile-update=atomic -O1)
    target_link_options(${target} PUBLIC --coverage)
  endif()
endfunction()
