#!/usr/bin/env bash
# Makes the three HTML pages of examples/README.md in a folder, and their screenshots here: examples/pictures/pages.sh [FLEXFRAME [FOLDER]]
# Screenshots need Chromium (section [nightly] of tests/packages.txt).
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
flexframe=${1:-$top/build/clang/flexframe}
folder=${2:-$(mktemp -d)}
mkdir -p "$folder"
command -v chromium >/dev/null || { echo "chromium is missing: install it (Debian package chromium)" >&2; exit 1; }
page() {  # NAME SCENE TIME
  "$flexframe" simulate "$top/examples/$2.toml" -o "$folder/$1.h5" --no-error-estimate --no-effect-check >/dev/null 2>&1
  "$flexframe" export "$folder/$1.h5" --to html -o "$folder/$1.html"
  chromium --headless=new --no-sandbox --disable-dev-shm-usage --use-angle=swiftshader --enable-unsafe-swiftshader --hide-scrollbars \
    --window-size=1120,700 --virtual-time-budget=6000 --screenshot="$folder/$1.png" "file://$folder/$1.html#t=$3" >/dev/null 2>&1
  cp "$folder/$1.png" "$top/examples/pictures/page_$1.png"
}
page slider_crank slider_crank 1.2
page engine engine 1.13
page blade beams/blade 7.2
