#!/usr/bin/env bash
# Makes the pictures, plots and figures of examples/engine/README.md again: examples/engine/make.sh [FLEXFRAME]
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
flexframe=${1:-$top/build/clang/flexframe}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$flexframe" simulate "$top/examples/engine.toml" -o "$work/engine.h5" --csv "$work/engine.csv" | tee "$work/log"
grep '^simulation' "$work/log" >"$here/cost.txt"
python3 "$here/plots.py" "$work/engine.csv" "$here/start_up.svg"

# Near the rod, larger and without plots.
sed -e "s|\.\./assets|$top/assets|" -e 's|, plot = .*\]|, plot = []|' \
  -e 's|^camera = .*|camera = { position = [-0.05, 0.17, 0.5], target = [0.072, -0.008, 0], fov = 25 }|' \
  "$top/examples/engine.toml" >"$work/engine.toml"
"$flexframe" render "$work/engine.h5" --scene "$work/engine.toml" -o "$work" --no-video --size 960x540 --frames 1130:1131 >/dev/null
cp "$work/frames/frame_01130.png" "$here/rod.png"
