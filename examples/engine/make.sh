#!/usr/bin/env bash
# Makes the pictures, plots and figures of examples/engine/README.md again: examples/engine/make.sh [FLEXFRAME]
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
flexframe=${1:-$top/build/release/flexframe}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$flexframe" simulate "$top/examples/engine.toml" -o "$work/engine.h5" --csv "$work/engine.csv" | tee "$work/log"
grep '^simulation' "$work/log" >"$here/cost.txt"
python3 "$here/plots.py" "$work/engine.csv" "$here/start_up.svg"

# The rod in scale, dark red; and exaggerated, its mesh in blue.
scene() {
  sed -e "s|\.\./assets|$top/assets|" -e "s|kind = \"modal\"|&\ncolor = \"$1\"|" -e "s|^scales = .*|scales = [$2]\nedges = $3|" -e 's|^color_by = .*|color_by = "none"|' \
    -e 's|, plot = .*\]|, plot = []|' "$top/examples/engine.toml" >"$work/$4.toml"
  "$flexframe" run "$work/$4.toml" -o "$work/$4" --no-video --no-error-estimate --no-effect-check --size 640x360 --frames 1130:1131 >/dev/null
  cp "$work/$4/frames/frame_01130.png" "$here/$4.png"
}
scene "#8c1a1a" 1 false solid
scene "#2255cc" 20000 true exaggerated
