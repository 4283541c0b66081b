#!/usr/bin/env bash
# Sobol's indices of Ishigami's function, whose values are known: examples/studies/ishigami/make.sh [FLEXFRAME]; four CPU seconds.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
flexframe=${1:-$here/../../../build/clang/flexframe}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$flexframe" sweep "$here/ishigami.toml" -o "$work" --sensitivity sobol:4096 --no-error-estimate --no-effect-check \
  --set x1=-pi:pi --set x2=-pi:pi --set x3=-pi:pi --response "ishigami=sin(x1) + 7*sin(x2)^2 + 0.1*x3^4*sin(x1)"
cp "$work/sensitivity_ishigami.svg" "$here/"
