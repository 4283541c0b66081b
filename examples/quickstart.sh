#!/usr/bin/env bash
# Installs what flexframe needs, builds the program and runs the elastic slider-crank. A second run builds nothing.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$top"
mkdir -p build
# shellcheck source=../cmake/packages.sh
source cmake/packages.sh

install_packages build

# The tests need further packages; whoever has configured them already keeps them.
if [[ ! -f build/release/build.ninja ]]; then
  echo "configuring"
  if ! cmake --preset release -D FLEXFRAME_TESTS=OFF -D FLEXFRAME_BENCHMARKS=OFF >build/configure.log 2>&1; then
    echo "configuring failed; its last words (all of them: build/configure.log):" >&2
    tail -n 20 build/configure.log >&2
    exit 1
  fi
fi
cmake --build --preset release --target flexframe

out=out/slider_crank
build/release/flexframe run examples/slider_crank.toml -o "$out"

echo
echo "pictures: $top/$out/frames"
if [[ -f $out/slider_crank.mp4 ]]; then echo "video:    $top/$out/slider_crank.mp4"; fi
echo "results:  $top/$out/results.h5 and histories.csv"
