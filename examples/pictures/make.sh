#!/usr/bin/env bash
# Makes the pictures of examples/README.md again, each from its scene: examples/pictures/make.sh [FLEXFRAME [NAME...]]
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
flexframe=${1:-$top/build/clang/flexframe}
names=" ${*:2} "
work=$(mktemp -d)
changed=
trap 'rm -rf "$work" ${changed:+"$changed"}' EXIT

# picture NAME SCENE NUMBER [SED...]: one picture of a sequence, small; words of the scene may be changed for it.
picture() {
  [[ $names == "  " || $names == *" $1 "* ]] || return 0
  local scene=$top/examples/$2.toml
  # Beside the scene, whose meshes are named from there.
  changed=$(dirname "$scene")/.$1.toml
  sed "${@:4}" -e '' "$scene" >"$changed"
  "$flexframe" run "$changed" -o "$work" --no-video --no-error-estimate --no-effect-check --size 960x540 \
    --frames "$3:$(($3 + 1))" >/dev/null 2>"$work/said" ||
    { cat "$work/said" >&2; exit 1; }
  rm "$changed"
  cp "$work/frames/$(printf 'frame_%05d.png' "$3")" "$top/examples/pictures/$1.png"
}
# Number of the picture: time in s times frame_rate over speed.
# The camera of a still may be fitted to its moment.
window() { echo "s/^\[render\]/[render]\ncamera = { window = [$1, $2] }/"; }
picture slider_crank_1 slider_crank 150 -e "$(window 0.45 0.75)"
picture slider_crank_2 slider_crank 300 -e "$(window 1.05 1.4)"
picture pendulum_1 pendulum 48
picture pendulum_2 pendulum 140
picture engine_1 engine 1130
picture dlr_slider_crank dlr_slider_crank 60
picture spin_up beams/spin_up 52
picture buckling beams/buckling 198
picture cart beams/cart 22
picture strip beams/strip 100
# Near the blade, which points along x at both moments.
near=(-e 's/^camera = .*/camera = { position = [1.9, -6.4, 0.9], target = [3.15, 0, -0.3], fov = 33 }/')
picture blade_drooped beams/blade 0 "${near[@]}"
picture blade_spinning beams/blade 351 "${near[@]}"
