#!/usr/bin/env bash
# Installs what flexframe needs, builds the program and runs the elastic slider-crank. A second run builds nothing.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$top"
mkdir -p build
# shellcheck source=../tests/packages.sh
source tests/packages.sh

# clang compiles the program in 60 % of the time that g++ takes: it comes along where packages are to be installed anyway.
# Whoever has all the others builds with what there is. A warning of another compiler version is no reason to stop here.
if [[ -n $(missing_packages build) ]]; then install_packages build clang; else install_packages build; fi

# A build that is there already is kept, with its compiler and the tests that it may have.
preset=release
if [[ ! -f build/release/build.ninja ]] && command -v clang++ >/dev/null && [[ -z $(missing_packages clang) ]]; then preset=clang; fi
if [[ ! -f build/$preset/build.ninja ]]; then
  echo "configuring"
  if ! cmake --preset "$preset" -D FLEXFRAME_TESTS=OFF -D FLEXFRAME_BENCHMARKS=OFF -D FLEXFRAME_UNITY=ON \
    -D CMAKE_COMPILE_WARNING_AS_ERROR=OFF >build/configure.log 2>&1; then
    echo "configuring failed; its last words (all of them: build/configure.log):" >&2
    tail -n 20 build/configure.log >&2
    exit 1
  fi
fi
cmake --build --preset "$preset" --target flexframe

out=out/slider_crank
"build/$preset/flexframe" run examples/slider_crank.toml -o "$out"

echo
echo "program:  $top/build/$preset/flexframe"
echo "pictures: $top/$out/frames"
if [[ -f $out/slider_crank.mp4 ]]; then echo "video:    $top/$out/slider_crank.mp4"; fi
echo "results:  $top/$out/results.h5 and histories.csv"
