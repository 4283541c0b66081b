#!/usr/bin/env bash
# The house rules of includes and of what lies where, as a test: tests/layering.sh [ROOT]. Prints each breach, exit 1 if there is one.
#   tests/layering.sh --self-test: plants every breach in a copy and demands that it is found.
set -uo pipefail

# breaches ROOT: one line a breach.
breaches() {
  local root=$1
  cd "$root" || return 1

  # banned RULE PATTERN FILE...: FILE must not contain PATTERN.
  # The one header that every module includes is sim/base/error.h.
  banned() {
    local rule=$1 pattern=$2
    shift 2
    (($#)) && grep -nE "$pattern" "$@" /dev/null | grep -vF '#include "sim/base/error.h"' | sed "s|^|$rule: |"
  }
  # files FOLDER [DEPTH]: the C++ files of a folder.
  files() { find "$1" -maxdepth "${2:-9}" \( -name '*.h' -o -name '*.cpp' \) 2>/dev/null | sort; }
  # confined RULE PATTERN ALLOWED [MOST]: only files whose name matches ALLOWED include PATTERN, and at most MOST of them.
  confined() {
    local rule=$1 pattern=$2 allowed=$3 most=${4:-99} users
    users=$(files . | grep -v '^\./\(tests\|build\|out\)/' | xargs grep -lE "^ *# *include *[<\"]$pattern" /dev/null)
    local stray
    stray=$(grep -vE "$allowed" <<<"$users" | grep .)
    [[ -n $stray ]] && echo "$rule is included outside its place: ${stray//$'\n'/ }"
    (($(grep -c . <<<"$users") > most)) && echo "$rule is included in more than $most file(s): ${users//$'\n'/ }"
  }

  local sim interp render film imports cli
  mapfile -t sim < <(files sim)
  mapfile -t interp < <(files interp)
  mapfile -t render < <(files render | grep -vE '^render/(film|import|cli|python)/')
  mapfile -t film < <(files render/film)
  mapfile -t imports < <(files render/import)
  mapfile -t cli < <(files render/cli)
  local commands
  mapfile -t commands < <(files render/cli | grep -v '/main\.cpp$')

  # Who may know whom.
  banned "sim knows only itself" '#include "(interp|render)/' "${sim[@]}"
  banned "interp knows only itself" '#include "(sim|render)/' "${interp[@]}"
  banned "the drawing part knows only itself" '#include "(sim|interp|render/film|render/cli)/' "${render[@]}"
  banned "film stands below the program" '#include "render/cli/' "${film[@]}"
  banned "what reads other programs' files stands below the program" '#include "(render/cli|interp)/' "${imports[@]}"
  banned "includes are written from the project's root" '#include "(\.|[^/"]+")' \
    "${sim[@]}" "${interp[@]}" "${render[@]}" "${film[@]}" "${imports[@]}" "${cli[@]}"

  # Rooms: every file stands in one, and includes only its own and those before it.
  # rooms MODULE ROOM...: in this order; a file beside the rooms is the door and may include them all.
  rooms() {
    local module=$1 room later
    shift
    local all=("$@")
    while (($#)); do
      room=$1
      shift
      later=$(IFS='|'; echo "$*")
      [[ -n $later ]] && banned "$module/$room stands before what it includes" "#include \"$module/($later)/" $(files "$module/$room")
      banned "the door of $module is opened from inside" "#include \"$module/[a-z_]+\.h\"" $(files "$module/$room")
    done
    files "$module" | grep "^$module/.*/" | grep -vE "^$module/($(IFS='|'; echo "${all[*]}"))/" | sed "s|^|no room of $module: |"
  }
  rooms sim base scene bodies reduce model dynamics time start results run accuracy sweep
  rooms render base picture image frame draw film import cli python

  # Each foreign library behind its door.
  confined SUNDIALS '(cvode|cvodes|arkode|ida|idas|kinsol|nvector|sunlinsol|sunmatrix|sunnonlinsol|sundials)' \
    '^\./sim/time/(integrat|cvode|arkode|ida)[a-z_]*\.(h|cpp)$'
  confined OpenGL 'GL/' '^\./render/draw/[a-z_]+\.h$' 1
  confined assimp 'assimp/' '^\./render/picture/mesh[a-z_]*\.cpp$' 1
  confined stb_image 'stb(/|_|/stb_)image' '^\./render/[a-z_]+/[a-z_]+\.cpp$' 1
  confined stb_truetype 'stb(/|_|/stb_)truetype' '^\./render/[a-z_]+/[a-z_]+\.cpp$' 1
  confined libdeflate 'libdeflate' '^\./render/[a-z_]+/[a-z_]+\.cpp$' 1
  confined HDF5 '(hdf5|H5)' '^\./sim/results/results_file_hdf5\.h$' 1
  confined muParser 'muParser' '^\./sim/scene/expression\.cpp$' 1
  confined toml++ 'toml(\+\+|\.hpp|plusplus)' '^\./sim/scene/toml_input\.cpp$' 1
  confined xxHash 'xxhash' '^\./interp/hash\.h$' 1
  confined matio 'matio' '^\./render/import/modelica\.cpp$'
  confined libzip 'zip\.h' '^\./render/import/arrays\.cpp$'
  confined pugixml 'pugixml' '^\./render/import/[a-z_]+\.cpp$'
  confined NetCDF 'netcdf' '^\./render/import/mbdyn[a-z_]*\.cpp$'
  confined CLI11 'CLI/' '^\./render/cli/'
  confined Boost 'boost/' '^\./sim/sweep/design\.cpp$' 1
  confined NLopt 'nlopt' '^\./sim/sweep/search\.cpp$' 1
  confined Eigen/Sparse 'Eigen/(Sparse|SparseCholesky)' '^\./(sim|interp|render/film)/'

  # The library never prints; the one catch of everything is main's.
  banned "the library prints" '(std::(cout|cerr|clog)|[^a-zA-Z_:]f?printf *\(|fmt::print|std::puts|[^a-zA-Z_]perror *\()' \
    "${sim[@]}" "${interp[@]}" "${render[@]}" "${film[@]}" "${imports[@]}"
  banned "catch of everything outside main" 'catch \(const std::exception' "${commands[@]}"

  # The top level is what the README shows, and no more.
  local entry wanted=(CMakeLists.txt CMakePresets.json LICENSE README.md assets examples interp render sim tests)
  for entry in *; do
    case " ${wanted[*]} build out " in *" $entry "*) ;;
      *) echo "the top level has a name of its own: $entry (allowed: ${wanted[*]})" ;;
    esac
  done
  for entry in "${wanted[@]}"; do [[ -e $entry ]] || echo "the top level lacks $entry"; done

  # Nothing leans on files outside a clone.
  find . -type f ! -path './.git' ! -path './.git/*' ! -path './build/*' ! -path './out/*' ! -path ./tests/layering.sh \
    -size -2000k -print0 |
    xargs -0 grep -nIE \
      '(PROJECT_SOURCE_DIR\}|CMAKE_SOURCE_DIR\}|FLEXFRAME_SOURCE_DIR\)?)/\.\.(/|"|$)|(^|[^.])\.\./shared|[Ss]eed 00[0-9]' /dev/null |
    sed 's|^|a file outside the repository: |'

  # Names of one machine: absolute homes and work folders.
  find . -type f ! -path './.git' ! -path './.git/*' ! -path './build/*' ! -path './out/*' -size -2000k -print0 |
    xargs -0 grep -nIE '(^|[^A-Za-z0-9_.~}/-])/(work|root|home|farm)/' /dev/null | sed 's|^|a path of one machine: |'
}

if [[ ${1:-} == --self-test ]]; then
  folder=$(mktemp -d)
  trap 'rm -rf "$folder"' EXIT
  failures=0
  # The folders and files of the top level, empty.
  bare_tree() {
    mkdir -p "$folder/tree/"{sim,interp,render/film,render/cli,assets,examples,tests}
    touch "$folder/tree/"{CMakeLists.txt,CMakePresets.json,LICENSE,README.md}
  }
  # expect FILE LINE RULE: LINE in FILE must be reported with RULE.
  expect() {
    rm -rf "$folder/tree"
    bare_tree
    mkdir -p "$folder/tree/$(dirname "$1")"
    echo "$2" >"$folder/tree/$1"
    local found
    found=$( (breaches "$folder/tree") )
    if ! grep -qF "$3" <<<"$found"; then
      echo "not found: '$2' in $1 ($3)"
      failures=1
    fi
  }
  expect sim/a.cpp '#include "interp/map.h"' "sim knows only itself"
  expect sim/a.h '#include "render/image/image.h"' "sim knows only itself"
  expect interp/a.cpp '#include "sim/base/types.h"' "interp knows only itself"
  expect render/image/a.h '#include "sim/results/results.h"' "the drawing part knows only itself"
  expect render/draw/a.cpp '#include "interp/map.h"' "the drawing part knows only itself"
  expect render/film/a.cpp '#include "render/cli/command.h"' "film stands below the program"
  expect render/import/a.cpp '#include "render/cli/command.h"' "what reads other programs' files stands below the program"
  expect sim/a.cpp '#include <matio.h>' "matio is included outside"
  # Every room against every later one.
  rooms_in_order() {
    local module=$1 i j
    shift
    for ((i = 1; i <= $#; ++i)); do
      expect "$module/${!i}/a.cpp" "#include \"$module/a.h\"" "the door of $module is opened from inside"
      for ((j = i + 1; j <= $#; ++j)); do expect "$module/${!i}/a.h" "#include \"$module/${!j}/b.h\"" "stands before what it includes"; done
    done
    expect "$module/attic/a.cpp" "" "no room of $module"
  }
  rooms_in_order sim base scene bodies reduce model dynamics time start results run accuracy sweep
  rooms_in_order render base picture image frame draw film import cli python
  expect interp/a.cpp '#include "sim/base/errors.h"' "interp knows only itself"
  expect sim/a.cpp '#include "types.h"' "includes are written from the project's root"
  expect sim/model/model.cpp '#include <cvode/cvode.h>' "SUNDIALS is included outside"
  expect render/draw/renderer.cpp '#include <GL/gl.h>' "OpenGL is included outside"
  expect render/image/image.cpp '#include <assimp/scene.h>' "assimp is included outside"
  expect sim/a.cpp '#include <hdf5.h>' "HDF5 is included outside"
  expect sim/scene/scene_reader.cpp '#include <toml++/toml.h>' "toml++ is included outside"
  expect sim/a.cpp '#include <muParser.h>' "muParser is included outside"
  expect sim/run/run.cpp '#include <boost/math/special_functions/erf.hpp>' "Boost is included outside"
  expect sim/sweep/sweep.cpp '#include <nlopt.h>' "NLopt is included outside"
  expect interp/cache.cpp '#include <xxhash.h>' "xxHash is included outside"
  expect render/film/a.cpp '#include <CLI/CLI.hpp>' "CLI11 is included outside"
  expect interp/a.cpp 'std::cout << 1;' "the library prints"
  expect sim/a.cpp '  printf("x");' "the library prints"
  expect render/cli/run.cpp 'catch (const std::exception& e) {' "catch of everything outside main"
  expect examples/x.toml "file = \"/""home/someone/x.obj\"" "a path of one machine"
  expect packages.txt 'cmake' "the top level has a name of its own: packages.txt"
  expect cmake/Compiler.cmake 'set(x 1)' "the top level has a name of its own: cmake"
  expect tests/CMakeLists.txt 'set(data "${PROJECT_SOURCE_DIR}/''../data")' "a file outside the repository"
  expect tests/a.cpp '// see ..''/shared/x.md' "a file outside the repository"
  expect sim/a.h '// as in seed ''001 eq. 8' "a file outside the repository"
  # A top level that lacks a part.
  rm -rf "$folder/tree"
  bare_tree
  rm -r "$folder/tree/assets"
  grep -qF "the top level lacks assets" <<<"$( (breaches "$folder/tree") )" || { echo "not found: a missing folder"; failures=1; }
  # A clean tree is reported clean.
  rm -rf "$folder/tree"
  bare_tree
  mkdir -p "$folder/tree/sim/results"
  printf '#include "sim/base/types.h"\n#include <hdf5.h>\n' >"$folder/tree/sim/results/results_file_hdf5.h"
  clean=$( (breaches "$folder/tree") )
  [[ -z $clean ]] || { echo "a clean tree is blamed: $clean"; failures=1; }
  exit $failures
fi

found=$( (breaches "${1:-$(dirname "${BASH_SOURCE[0]}")/..}") )
[[ -z $found ]] && exit 0
echo "$found"
exit 1
