# One set of warnings and floating-point rules for every target of the project.
# Goldens depend on the bits: no -march=native, no -ffast-math, no contraction.
add_library(flexframe_options INTERFACE)
target_compile_options(flexframe_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -ffp-contract=off)
target_include_directories(flexframe_options INTERFACE ${PROJECT_SOURCE_DIR})

set(FLEXFRAME_SANITIZE "" CACHE STRING "sanitizers, for example address,undefined")
if(FLEXFRAME_SANITIZE)
  target_compile_options(flexframe_options INTERFACE
    -fsanitize=${FLEXFRAME_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=undefined)
  target_link_options(flexframe_options INTERFACE -fsanitize=${FLEXFRAME_SANITIZE})
endif()

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()
