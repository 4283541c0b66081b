#!/usr/bin/env bash
# The house's format: .clang-format over every C++ source, black over every Python file, and 140 columns in these, pages, scenes, CMake,
# shell, JavaScript, CSS and HTML. Longer may be: rows of tables in pages, and what programs write (assets, studies, the list of golden
# pictures).
#   tests/format.sh [FILE...]      names what differs; exit 1 if a file does
#   tests/format.sh --fix          formats all C++ and Python in place
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 2
for tool in clang-format black; do
  command -v $tool >/dev/null || { echo "$tool is missing (section [compilers] of the package list)" >&2; exit 2; }
done
fix=0
[[ ${1:-} == --fix ]] && { fix=1; shift; }
files=("$@")
rooms=(sim interp render tests assets examples)
((${#files[@]})) || mapfile -t files < <(
  find "${rooms[@]}" \( -name '*.h' -o -name '*.cpp' -o -name '*.py' -o -name '*.md' -o -name '*.toml' -o -name '*.sh' -o -name '*.cmake' \
    -o -name '*.cmake.in' -o -name CMakeLists.txt -o -name '*.js' -o -name '*.css' -o -name '*.html' \) -not -path '*/build/*' | sort
  echo README.md
  echo CMakeLists.txt
)
mapfile -t cpp < <(printf '%s\n' "${files[@]}" | grep -E '\.(h|cpp)$')
mapfile -t python < <(printf '%s\n' "${files[@]}" | grep '\.py$')
if ((fix)); then
  ((${#cpp[@]})) && printf '%s\0' "${cpp[@]}" | xargs -0 -n 20 -P "$(nproc)" clang-format -i
  ((${#python[@]})) && black -q -l 140 "${python[@]}"
  exit 0
fi
# Two checks: what the tools would write, and what they leave beyond the limit (a text that cannot be broken).
bad=$({
  ((${#cpp[@]})) && printf '%s\0' "${cpp[@]}" | xargs -0 -n 20 -P "$(nproc)" clang-format --dry-run 2>&1 |
    sed -n 's/^\([^:]*\):[0-9]*:.*code should be clang-formatted.*/\1/p'
  ((${#python[@]})) && black -l 140 --check "${python[@]}" 2>&1 | sed -n 's/^would reformat //p'
} | sort | uniq -c)
long=$(LC_ALL=C.UTF-8 grep -nHE '^.{141}' "${files[@]}" | grep -vE '^[^:]*\.md:[0-9]+: *\|' |
  grep -vE '^(assets|examples/studies)/.*\.md:|^tests/golden/CHANGES\.md:' | cut -d: -f1,2)
[[ -n $bad ]] && echo "not in the house's format (places, file):" && echo "$bad"
[[ -n $long ]] && echo "beyond 140 columns:" && echo "$long"
echo "${#files[@]} files, $(grep -c . <<<"$bad") to format, $(grep -c . <<<"$long") lines too long"
[[ -z $bad && -z $long ]]
