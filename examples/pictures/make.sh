#!/usr/bin/env bash
# Makes the pictures of examples/README.md again: examples/pictures/make.sh [FLEXFRAME]
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
flexframe=${1:-$top/build/release/flexframe}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# picture SCENE NUMBER NAME: one picture of a sequence, small.
picture() {
  "$flexframe" run "$top/examples/$1.toml" -o "$work" --no-video --no-error-estimate --size 640x360 --frames "$2:$(($2 + 1))" >/dev/null
  cp "$work/frames/$(printf 'frame_%05d.png' "$2")" "$top/examples/pictures/$3.png"
}
# 240 pictures a second of simulated time.
picture slider_crank 120 slider_crank_1
picture slider_crank 300 slider_crank_2
picture pendulum 48 pendulum_1
picture pendulum 140 pendulum_2
# 600 a second.
picture engine 1130 engine_1
