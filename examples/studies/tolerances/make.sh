#!/usr/bin/env bash
# Makes the diagrams and figures of this page again: examples/studies/tolerances/make.sh [PART ...], parts: worst search spread indices map.
# Needs build/clang/flexframe; two minutes on two idle cores. An interrupted sweep goes on where it stopped.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../../.." && pwd)
work=${TMPDIR:-/tmp}/flexframe-tolerances
flexframe=${FLEXFRAME:-build/clang/flexframe}
cd "$top"
# The modes and the method that `simulate --accuracy` chooses for a few thousandths.
same=(--set body.rod.keep_modes=12 --set body.rod.keep_static=false --set body.crank.keep_modes=3 --set body.crank.keep_static=false
  --method exponential --tolerance 2e-6 --no-effect-check --resume
  --response "stroke=range(slider.x)" --response "deflection=max(abs(rod_middle.y))" --response "return=time_of_min(slider.x)")
scene=examples/slider_crank.toml
for part in "${@:-worst search spread indices map}"; do
  for one in $part; do
    case $one in
      worst) # all corners of what the drawing allows
        $flexframe sweep $scene -o "$work/worst" "${same[@]}" --set body.crank.length=0.1519,0.1521 \
          --set body.rod.length=0.3038,0.3042 --set body.crank.section.diameter=0.0099,0.0101 \
          --set body.rod.section.diameter=0.0099,0.0101 --set body.rod.material.youngs_modulus=4.75e7,5.25e7 \
          --set body.rod.material.density=2714.6,2825.4 --sheet 1.25 --sheet-points 9 ;;
      search) # is anything inside the limits worse than the corners?
        $flexframe sweep $scene -o "$work/search" "${same[@]}" --set body.crank.length=0.1519:0.1521 \
          --set body.rod.length=0.3038:0.3042 --set body.crank.section.diameter=0.0099:0.0101 \
          --set body.rod.section.diameter=0.0099:0.0101 --set body.rod.material.youngs_modulus=4.75e7:5.25e7 \
          --set body.rod.material.density=2714.6:2825.4 --maximise deflection --searches 2 --runs 150 ;;
      spread) # made parts: the same limits are three standard deviations
        $flexframe sweep $scene -o "$work/spread" "${same[@]}" --sample lhs:200 --set "body.crank.length=normal(0.152,3.333e-5)" \
          --set "body.rod.length=normal(0.304,6.667e-5)" --set "body.crank.section.diameter=normal(0.01,3.333e-5)" \
          --set "body.rod.section.diameter=normal(0.01,3.333e-5)" --set "body.rod.material.youngs_modulus=normal(5e7,8.333e5)" \
          --set "body.rod.material.density=normal(2770,18.47)" ;;
      indices) # who decides how far the rod bends
        $flexframe sweep $scene -o "$work/indices" "${same[@]}" --sensitivity sobol:64 --set body.crank.length=0.1519:0.1521 \
          --set body.rod.length=0.3038:0.3042 --set body.crank.section.diameter=0.0099:0.0101 \
          --set body.rod.section.diameter=0.0099:0.0101 --set body.rod.material.youngs_modulus=4.75e7:5.25e7 \
          --set body.rod.material.density=2714.6:2825.4 ;;
      map) # beyond tolerances: a map of the design
        $flexframe sweep $scene -o "$work/map" "${same[@]}" --set body.rod.length=0.26:0.36:9 \
          --set body.rod.section.diameter=0.008:0.012:9 ;;
    esac
    if [[ $one != indices && $one != search ]]; then cp "$work/$one/table.csv" "$here/$one.csv"; fi
    for diagram in "$work/$one"/*.svg "$work/$one"/matrix.png; do
      case $one-$(basename "$diagram") in
        spread-matrix.png | spread-histogram_2.svg | indices-sensitivity_deflection.svg | map-map_deflection.svg)
          cp "$diagram" "$here/" ;;
      esac
    done
    if [[ $one == worst ]]; then cp "$work/worst/sheet.png" "$here/"; fi
  done
done
