#!/usr/bin/env bash
# Runs every scene of this folder, puts its picture into pictures/ and writes the page: examples/mechanisms/make.sh [FLEXFRAME [NAME...]]
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
flexframe=${1:-$here/../../build/clang/flexframe}
names=" ${*:2} "
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$here/pictures"
page=$work/README.md
{
  echo "# Mechanisms"
  echo
  echo -n "Small scenes of textbook mechanisms, with numbers of three digits. \`tests/regression/test_textbook.py\` "
  echo "runs each of them and compares"
  echo "it with the formula in its first line or with an own integration. The page is made by \`examples/mechanisms/make.sh\`."
  echo
  echo "| | | |"
  echo "|---|---|---|"
} >"$page"
column=0
row="|"
for scene in "$here"/*.toml; do
  name=$(basename "$scene" .toml)
  title=$(sed -n 's/^title = "\(.*\)"$/\1/p' "$scene")
  note=$(sed -n '1s/^# //p' "$scene")
  if [[ $names == "  " || $names == *" $name "* ]]; then
    # A fifth of the way through: most show more there than at their start.
    duration=$(sed -n 's/^duration = \(.*\)$/\1/p' "$scene")
    picture=$(awk -v d="$duration" 'BEGIN { print int(30 * d / 5) }')
    [[ $name == cantilever ]] && picture=2 # half a period after it was let go: farthest down
    "$flexframe" run "$scene" -o "$work/out" --no-video --no-error-estimate --no-effect-check --size 480x360 --no-overlay \
      --speed 1 --frames "$picture:$((picture + 1))" >/dev/null 2>"$work/said" || { cat "$work/said" >&2; exit 1; }
    cp "$work/out/frames/$(printf 'frame_%05d.png' "$picture")" "$here/pictures/$name.png"
    rm -r "$work/out"
  fi
  row+=" ![$title](pictures/$name.png)<br>**$title** [\`$name\`]($name.toml)<br>$note |"
  column=$((column + 1))
  if ((column % 3 == 0)); then
    echo "$row" >>"$page"
    row="|"
  fi
done
if [[ $row != "|" ]]; then
  while ((column % 3 != 0)); do row+=" |" column=$((column + 1)); done
  echo "$row" >>"$page"
fi
mv "$page" "$here/README.md"
