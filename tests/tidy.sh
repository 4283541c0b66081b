#!/usr/bin/env bash
# clang-tidy with the checks of .clang-tidy over sim, interp and render, every finding an error.
#   tests/tidy.sh [FILE...]      all sources, or these
# Nothing is built. Sources are put together in units (tests/tidy_groups.py), which takes a tenth of the time.
# Prints the findings and 'N files in M units, K with findings'; exit 1 if there are any, 2 if clang-tidy could not run.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 2
for tool in clang++ clang-tidy cmake python3; do
  command -v "$tool" >/dev/null || { echo "$tool is missing (tests/packages.txt, [clang] and [compilers])" >&2; exit 2; }
done
out=build/tidy
mkdir -p "$out/logs"
cmake --preset clang -B "$out" -D CMAKE_EXPORT_COMPILE_COMMANDS=ON -D FLEXFRAME_PRECOMPILE=OFF -D FLEXFRAME_TESTS=OFF \
  -D FLEXFRAME_BENCHMARKS=OFF >"$out/configure.log" 2>&1 ||
  { tail -n 20 "$out/configure.log"; exit 2; }
files=("$@")
((${#files[@]})) || mapfile -t files < <(find sim interp render -name '*.cpp' | sort)
rm -f "$out"/logs/*
units=$(python3 tests/tidy_groups.py "$out" "${files[@]}") || exit 2
check() {
  local log
  log=build/tidy/logs/$(basename "$1").log
  # A unit includes sources; that is not a finding.
  clang-tidy -p build/tidy/groups --quiet --checks=-bugprone-suspicious-include \
    --header-filter='/(sim|interp|render)/([^/]+/)*[^/]+\.(h|cpp)$' "$1" >"$log" 2>"$log.err" && return
  touch "$log.bad"
  [[ -s $log ]] || cp "$log.err" "$log"
}
export -f check
xargs -P "$(nproc)" -I{} bash -c 'check {}' <<<"$units"
cat "$out"/logs/*.log
bad=$(find "$out/logs" -name '*.bad' | wc -l)
echo "${#files[@]} files in $(wc -l <<<"$units") units, $bad with findings"
((bad == 0))
