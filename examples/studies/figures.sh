#!/usr/bin/env bash
# Makes the figures of the studies again: examples/studies/figures.sh [NAME ...]. Error in pixels over CPU time, and what one sees of it.
# Needs build/clang/flexframe; up to 40 CPU seconds a scene.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
work=${TMPDIR:-/tmp}/flexframe-figures
cd "$top"
for name in "${@:-slider_crank engine blade pendulum}"; do
  for one in $name; do
    scene=examples/$one.toml
    [[ -f $scene ]] || scene=examples/beams/$one.toml
    build/clang/flexframe study "$scene" -o "$work/$one" --axes tolerance --repeats 1 --seconds 40
    mkdir -p "$here/figures"
    cp "$work/$one/overview.png" "$here/figures/$one.png"
  done
done
