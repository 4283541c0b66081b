#!/usr/bin/env bash
# Simulates and draws the gallery's 16 pictures into pictures/: examples/gallery/make.sh [FLEXFRAME [NAME...]]
# With VTK=1 in the environment each also by VTK, into vtk/ (Debian packages python3-vtk9, python3-h5py, xvfb); with BLENDER=1 besides by
# Blender's path tracer, into blender/ (Debian package blender).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
flexframe=$(realpath "${1:-$here/../../build/clang/flexframe}")
names=" ${*:2} "
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$here/pictures" ${VTK:+"$here/vtk"} ${BLENDER:+"$here/blender"}

# picture NAME SCENE MOMENT WORDS [z]: MOMENT in per cent of the sequence, WORDS what stands in [render] beside the size; z: is upwards.
picture() {
  local name=$1 scene=$2 words=$4 count moment
  [[ $names == "  " || $names == *" $name "* ]] || return 0
  local results=$work/$(basename "$scene" .toml).h5
  # Pictures of stress want it said beforehand: forces along beams count too.
  local stress=()
  [[ $words == *'color_by = "stress"'* ]] && stress=(--set 'render.color_by="stress"')
  [[ -f $results ]] ||
    "$flexframe" simulate "$scene" "${stress[@]}" -o "$results" -q --no-error-estimate --no-effect-check 2>"$work/said" || {
    cat "$work/said" >&2
    exit 1
  }
  printf '[render]\nsize = [800, 450]\nsamples = 9\n%s\n' "$words" >"$work/words.toml"
  # How many pictures there are is told of one that there is not.
  count=$("$flexframe" render "$results" --scene "$work/words.toml" -o "$work/out" --no-video -q --frames 9999999:10000000 2>&1 |
    sed -n 's/.*the sequence has \([0-9]*\) pictures.*/\1/p') || true
  moment=$((count * $3 / 100))
  "$flexframe" render "$results" --scene "$work/words.toml" -o "$work/out" --no-video -q --frames "$moment:$((moment + 1))"
  cp "$work/out/frames/$(printf 'frame_%05d.png' "$moment")" "$here/pictures/$name.png"
  # The same moment by VTK: mesh, values, size and direction of view.
  [[ -z ${VTK:-} ]] ||
    xvfb-run -a /usr/bin/python3 "$here/vtk_picture.py" "$flexframe" "$results" "$work/words.toml" "$moment" "$here/vtk/$name.png" \
      "${5:-y}" "$work/$name.npz"
  # And by Blender, a path tracer.
  [[ -z ${BLENDER:-} ]] ||
    blender -b --factory-startup -P "$here/blender_picture.py" -- "$work/$name.npz" "$here/blender/$name.png" >/dev/null
}

# template NAME TITLE: a scene that the program itself makes.
template() {
  (cd "$work" && [[ -f $1.toml ]] || "$flexframe" new "$1" -t "$1" -q >/dev/null)
  sed -i "s/^title = .*/title = \"$2\"/" "$work/$1.toml"
  echo "$work/$1.toml"
}
cd "$work"

# The engine with colours that show what is cut.
sed -e 's|"\.\./assets|"'"$here"'/../../assets|' -e 's|^mesh = .*crank.obj"|&\ncolor = "#4a78a8"|' \
  -e 's|^mesh = .*piston.obj"|&\ncolor = "#c9a227"|' "$here/../engine.toml" >"$work/engine_cut.toml"
# The blade with a ghost in the colours of its values.
sed -e 's|"\.\./\.\./assets|"'"$here"'/../../assets|' -e '/^drawing = { ghost_color/d' \
  "$here/../beams/blade.toml" >"$work/blade_colours.toml"

picture 01_slider_crank "$here/../slider_crank.toml" 30 \
  $'scales = [1, 20]\nframe_rate = 60\nspeed = 0.25\ncamera = { window = [0.4, 0.6] }\noverlay = { plot = ["slider.x", "rod_middle.y"] }'
picture 02_engine "$here/../engine.toml" 95 \
  $'speed = 0.05\ncolor_by = "none"\nscales = [100000]\nundeformed = true\ncamera = { direction = [-0.35, -0.3, -1] }'
picture 03_engine_section "$work/engine_cut.toml" 2 \
  $'speed = 0.05\ncolor_by = "none"\nscales = [1]\njoints = false\n'\
$'section = { point = [0, 0, 0], normal = [0, 0, 1] }\n'\
$'camera = { direction = [-0.35, -0.3, -1] }'
picture 04_conrod "$here/../engine.toml" 96 \
  $'speed = 0.1\ncolor_by = "displacement"\nscales = [1]\njoints = false\nextremes = true\ncolor_range = [0, 4.3e-7]'
picture 05_strip "$here/../beams/strip.toml" 34 $'color_by = "displacement"\nscales = [1]\ntrail = 14\nspeed = 0.1\n'\
$'color_range = { window = [0, 0.35], percentile = 100 }\n'\
$'camera = { direction = [-0.42, -0.16, -1], window = [0, 0.35] }\n'\
$'insets = [{ at = "strip.tip", zoom = 8, corner = "upper right", label = "tip" }]'
picture 06_blade "$work/blade_colours.toml" 25 $'color_by = "displacement"\nscales = [1, 10]\n'\
$'color_range = { window = [3.7, 3.77], percentile = 100 }\n'\
$'camera = { window = [3.7, 3.77], direction = [-1, 0.45, -0.28], up = [0, 0, 1] }' z
picture 07_buckling "$here/../beams/buckling.toml" 99 \
  $'color_by = "displacement"\nscales = [1]\ncolormap = "cividis"\nextremes = true\n'\
$'camera = { direction = [0.25, -0.16, -1], window = [9.8, 9.9] }\noverlay = { plot = ["middle.y"] }'
picture 08_rollup "$here/../beams/rollup.toml" 45 $'color_by = "stress"\nscales = [1]\ntrail = 6\ncamera = { window = [3.5, 4.1] }'
picture 09_rotor "$(template rotor "Rotor on its shaft")" 60 \
  $'color_by = "stress"\nscales = [1]\njoints = false\ncolor_range = { window = [0.29, 0.31], percentile = 100 }\nextremes = true'
picture 10_fe_body "$(template fe-body "Finite element body with an end mass")" 30 \
  $'color_by = "displacement"\nscales = "auto"\nextremes = true\ncolor_range = { window = [0.0899, 0.0901], percentile = 100 }'
picture 11_suspension "$(template suspension "Double wishbone over a bump")" 35 $'color_by = "body"\nlook = "presentation"\n'\
$'camera = { direction = [0.55, -0.3, 1], window = [0.69, 0.71] }'
picture 12_robot "$(template robot-arm "Robot arm")" 55 \
  $'color_by = "none"\nlook = "presentation"\nforces = true\ncamera = { window = [1.1, 1.1] }' z
picture 13_mems "$here/mems.toml" 80 $'color_by = "stress"\nscales = [1]\nforces = true'
picture 14_crane "$here/crane.toml" 6 $'color_by = "stress"\nscales = [1, 5]\nforces = true\n'\
$'camera = { window = [0.6, 0.8], direction = [-0.35, -0.12, -1] }'
picture 15_views "$here/../mechanisms/governor.toml" 20 $'color_by = "none"\ncamera = { views = ["front", "side", "top", "iso"] }' z
picture 16_print "$here/../mechanisms/peaucellier.toml" 20 \
  $'look = "print"\ncolor_by = "none"\ncamera = { preset = "plane", window = [0.15, 0.25] }'
