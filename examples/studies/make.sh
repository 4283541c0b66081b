#!/usr/bin/env bash
# Makes the study pages again: examples/studies/make.sh [NAME ...]. Table, Markdown and diagrams are kept, the runs are not.
# Needs build/clang/flexframe; a few minutes a scene on an idle core. An interrupted study goes on where it stopped.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
work=${TMPDIR:-/tmp}/flexframe-studies
cd "$top"
for name in "${@:-pendulum slider_crank dlr_slider_crank spin_up engine}"; do
  for one in $name; do
    scene=examples/$one.toml
    [[ -f $scene ]] || scene=examples/beams/$one.toml
    axes=tolerance,elements,kept,modes,volumes,model,stiffening,method
    [[ $one == dlr_slider_crank || $one == spin_up ]] && axes=tolerance,modes,stiffening,method
    [[ $one == engine ]] && axes=tolerance,method
    # The beam as the paper has it: eigenforms and lumped beams know no shear.
    paper=()
    [[ $one == pendulum ]] && paper=(--set 'body.pendulum.effects=["bending_xy", "stiffening"]' --set simulation.tolerance=1e-6)
    build/clang/flexframe study "$scene" "${paper[@]}" -o "$work/$one" --axes "$axes" --longest 3 \
      --seconds 900 --reference-seconds 30 --repeats 2 --resume
    mkdir -p "$here/$one"
    cp "$work/$one"/{study.md,study.csv,overview.png} "$work/$one"/*.svg "$here/$one/"
  done
done
