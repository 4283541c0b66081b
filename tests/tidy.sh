#!/usr/bin/env bash
# clang-tidy with the checks of .clang-tidy over sim, interp and render, every finding an error.
#   tests/tidy.sh [FILE...]      all sources, or these
# Nothing is built. Prints the findings and 'N files, N with findings'; exit 1 if there are any.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 2
for tool in clang++ clang-tidy cmake; do
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
check() {
  local log
  log=build/tidy/logs/$(tr / _ <<<"$1")
  clang-tidy -p build/tidy --quiet "$1" >"$log" 2>/dev/null || { echo "findings in $1"; touch "$log.bad"; return; }
}
export -f check
printf '%s\n' "${files[@]}" | xargs -P "$(nproc)" -I{} bash -c 'check {}'
cat "$out"/logs/*.cpp 2>/dev/null
bad=$(find "$out/logs" -name '*.bad' | wc -l)
echo "${#files[@]} files, $bad with findings"
((bad == 0))
