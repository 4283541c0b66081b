#!/usr/bin/env bash
# Installs what the tests need, builds everything and runs all tests.
#   tests/run.sh          the preset clang, which builds in 60 % of the time that g++ takes
#   tests/run.sh --all    the presets release (g++) and asan besides (asan: unit tests), and format and lint of every source
# The last line is 'N passed, N failed', counted from what ctest reports; exit 1 if a test failed, none ran or a build broke.
set -uo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$top" || exit 1
mkdir -p build
# shellcheck source=packages.sh
source tests/packages.sh

presets=(clang)
sections=(build test clang)
case "${1:-}" in
  "") ;;
  --all) presets+=(release asan); sections+=(compilers) ;;
  *) echo "usage: tests/run.sh [--all]" >&2; exit 2 ;;
esac

passed=0 failed=0 broken=0
finish() {
  echo "$passed passed, $failed failed"
  ((passed > 0 && failed == 0 && broken == 0)) && exit 0
  exit 1
}

install_packages "${sections[@]}" || { broken=1; finish; }

jobs=$(nproc)
for preset in "${presets[@]}"; do
  echo "== $preset: configure and build"
  log=build/$preset.log
  # The shortest build there is, a quarter less than at -O3, and its programs give the same bits; the other presets compile each file alone.
  short=()
  [[ $preset == clang ]] && short=(-D FLEXFRAME_UNITY=ON "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG")
  if ! { cmake --preset "$preset" -D FLEXFRAME_TESTS=ON "${short[@]}" &&
    cmake --build --preset "$preset" -j "$jobs"; } >"$log" 2>&1; then
    echo "the build of preset $preset failed; its last words (all of them: $log):"
    tail -n 40 "$log"
    broken=1
    continue
  fi
  echo "== $preset: tests"
  report=$top/build/$preset/tests.xml
  rm -f "$report"
  only=()
  # Sanitizers are for the units: the regression tests time and kill the program as it is shipped.
  [[ $preset == asan ]] && only=(-LE 'regression|stability|nightly')
  ctest --preset "$preset" -j "$jobs" --no-tests=error "${only[@]}" --output-junit "$report" || true
  if [[ ! -f $report ]]; then
    echo "preset $preset: no test ran"
    broken=1
    continue
  fi
  # Whatever did not run and pass has failed: a test that is skipped or whose program is missing shows nothing.
  all=$(grep -c '<testcase ' "$report")
  good=$(grep -c '<testcase .* status="run"' "$report")
  ((passed += good, failed += all - good))
  ((all > 0)) || { echo "preset $preset: no test ran"; broken=1; }
done
# With all of it, each of these counts as a test.
if ((${#presets[@]} > 1)); then
  for check in "tests/format.sh" "tests/tidy.sh" "tests/sizes.py"; do
    echo "== $check"
    if "$check"; then ((++passed)); else ((++failed)); fi
  done
fi
finish
