#!/usr/bin/env bash
# Makes the study pages again: examples/studies/make.sh [NAME ...]. Table, Markdown and diagrams are kept, the runs are not.
# Needs build/release/flexframe; a few minutes a scene on an idle core. An interrupted study goes on where it stopped.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
work=${TMPDIR:-/tmp}/flexframe-studies
cd "$top"
for name in "${@:-pendulum slider_crank}"; do
  for one in $name; do
    build/release/flexframe study "examples/$one.toml" -o "$work/$one" --axes tolerance,elements,kept,modes,volumes,model,stiffening,method \
      --longest 1.5 --reference-seconds 12 --repeats 2 --resume
    mkdir -p "$here/$one"
    cp "$work/$one"/study.md "$work/$one"/study.csv "$work/$one"/*.svg "$here/$one/"
  done
done
