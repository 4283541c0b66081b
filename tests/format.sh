#!/usr/bin/env bash
# The house's format, .clang-format with 140 columns, over every source.
#   tests/format.sh [FILE...]      names what differs; exit 1 if a file does
#   tests/format.sh --fix          formats all of them in place
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 2
command -v clang-format >/dev/null || { echo "clang-format is missing (section [compilers] of the package list)" >&2; exit 2; }
fix=0
[[ ${1:-} == --fix ]] && { fix=1; shift; }
files=("$@")
((${#files[@]})) || mapfile -t files < <(find sim interp render tests \( -name '*.h' -o -name '*.cpp' \) -not -path '*/build/*' | sort)
if ((fix)); then
  printf '%s\0' "${files[@]}" | xargs -0 -n 20 -P "$(nproc)" clang-format -i
  exit 0
fi
# Two checks: what clang-format would write, and what it leaves beyond the limit (a text that cannot be broken).
bad=$(printf '%s\0' "${files[@]}" | xargs -0 -n 20 -P "$(nproc)" clang-format --dry-run 2>&1 | sed -n 's/^\([^:]*\):[0-9]*:.*code should be clang-formatted.*/\1/p' | sort | uniq -c)
long=$(awk 'length($0) > 140 { print FILENAME ":" FNR ": " length($0) " columns" }' "${files[@]}")
[[ -n $bad ]] && echo "not in the house's format (places, file):" && echo "$bad"
[[ -n $long ]] && echo "beyond 140 columns:" && echo "$long"
echo "${#files[@]} files, $(grep -c . <<<"$bad") to format, $(grep -c . <<<"$long") lines too long"
[[ -z $bad && -z $long ]]
