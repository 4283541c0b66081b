#!/usr/bin/env bash
# Fuzzes the readers with clang's libFuzzer, address, leak and undefined-behaviour sanitizers.
#   tests/fuzz/fuzz.sh NAME [RUNS]      NAME: scene sid obj fe results csv png import body map, or all; RUNS 1000000
# Starts from corpus/NAME and from the project's own files; what is found new stays in build/fuzz/NAME/corpus, a failing input in
# build/fuzz/NAME, the log in build/fuzz/NAME/log. Ends with a row of figures for each reader; exit 1 after a crash, leak, hang (10 s for an
# input) or too much memory (512 MB besides what HDF5 and the corpus hold; no reader may take more than its input's size allows).
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$top"
readers=(scene sid obj fe results csv png import body map)
name=${1:?usage: tests/fuzz/fuzz.sh NAME [RUNS]}
runs=${2:-1000000}

if [[ $name == all ]]; then
  failed=0
  for reader in "${readers[@]}"; do "$0" "$reader" "$runs" | tail -n 1 || failed=1; done
  exit $failed
fi
out=build/fuzz/$name

# Sources that are instrumented; what they call besides comes from the release build and the system's libraries.
# Inputs are kept short: a reader's branches fit into a few hundred bytes, and short ones run a hundred times faster.
seeds=()
case $name in
  scene) sources=(sim/scene/{document,instances,parameters,units,rotation_input,toml_output,scene_reader,read_bodies,read_joints}.cpp
    sim/scene/{toml_input,section,expression,expression_switches}.cpp sim/base/words.cpp)
    longest=4096 seeds=(examples/*.toml tests/regression/*.toml) ;;
  sid) sources=(sim/bodies/sid_{read,write,body}.cpp) longest=8192 ;;
  obj) sources=(render/picture/mesh.cpp render/picture/mesh_obj.cpp render/picture/mesh_shading.cpp render/base/file.cpp) longest=1024 ;;
  fe) sources=(sim/reduce/fe_{inp,nastran}*.cpp sim/reduce/fe_{msh,model}.cpp) longest=2048 ;;
  results) sources=(sim/base/hdf5_reader.cpp sim/results/results_file_read.cpp) longest=20000 ;;
  csv) sources=(render/film/deform.cpp) longest=512 ;;
  import)
    sources=(render/import/*.cpp sim/scene/toml_input.cpp) longest=4096
    seeds=(tests/regression/data/import/{solids.frd,grid_ascii.vtu}) ;;
  body) sources=(sim/base/hdf5_reader.cpp sim/bodies/body_file*.cpp) longest=40000 ;;
  map)
    sources=(interp/{map,graph,patch,partition,axis,skeleton,curve,spline,elastic,green,lift,faces,surface,rotation,trial}.cpp)
    longest=2048 ;;
  png) sources=(render/image/png.cpp render/image/image.cpp) longest=512 ;;
  *) echo "no fuzz target '$name'; there is: ${readers[*]} all" >&2; exit 2 ;;
esac
built=build/release  # or where only the preset clang is built
[[ -f $built/sim/libflexframe_sim.a ]] || built=build/clang
release=($built/{render/film/libflexframe_film.a,render/libflexframe_render.a,interp/libflexframe_interp.a,sim/libflexframe_sim.a})
for library in "${release[@]}"; do
  [[ -f $library ]] || { echo "$library is missing: build the preset release or clang first" >&2; exit 2; }
done
[[ $name != import ]] || release+=("$built/render/import/libflexframe_import.a")
# Files compiled together (tests/run.sh) have instrumented ones among them, which come first and count.
libraries=(-Wl,-z,muldefs -lmatio -lnetcdf -lzip -lpugixml -lxxhash -L/usr/lib/x86_64-linux-gnu/hdf5/serial -lhdf5 -ltomlplusplus
  -lassimp -ldeflate -lfmt -lpthread -ldl)
# Results of other programs are converted by all that the program links.
if [[ $name == import ]]; then
  mapfile -t linked < <(awk '/^build flexframe:/ {found = 1} found && /LINK_LIBRARIES/ {print; exit}' "$built/build.ninja" | tr ' ' '\n' |
    grep -E '^(/|-l)')
  libraries+=("${linked[@]}")
fi
# Names of libraries that are loaded late (render/package/late.cmake).
mapfile -t late < <(grep -oh -- '-DFLEXFRAME_[A-Z]*_FILE=[^ ]*' "$built/build.ninja" | tr -d '\\' | sort -u)
cache=()
command -v ccache >/dev/null && cache=(ccache)

mkdir -p "$out/corpus" "$out/seeds" "$out/o"
program=$out/fuzz
if [[ ! -x $program || -n $(find sim interp render tests/fuzz \( -name '*.h' -o -name '*.cpp' \) -newer "$program" | head -n 1) ]]; then
  objects=()
  for file in "tests/fuzz/${name}_fuzz.cpp" "${sources[@]}"; do
    object=$out/o/$(tr / _ <<<"${file%.cpp}").o
    objects+=("$object")
    [[ -f $object && $object -nt $file && -z $(find tests/fuzz sim interp render -name '*.h' -newer "$object" | head -n 1) ]] && continue
    "${cache[@]}" clang++ -std=c++20 -O1 -g1 -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined \
      -I. -isystem /usr/include/eigen3 -isystem /usr/include/hdf5/serial -isystem /usr/include/stb -DFMT_SHARED \
      -DTOML_HEADER_ONLY=0 -DTOML_SHARED_LIB=1 "${late[@]}" -c "$file" -o "$object"
  done
  clang++ -fsanitize=fuzzer,address,undefined "${objects[@]}" -Wl,--start-group "${release[@]}" -Wl,--end-group "${libraries[@]}" \
    -o "$program"
fi

if ((${#seeds[@]})); then cp -n "${seeds[@]}" "$out/seeds/" 2>/dev/null || true; fi
export ASAN_OPTIONS=allocator_may_return_null=1:malloc_context_size=8
extra=()
[[ -f tests/fuzz/$name.dict ]] && extra+=("-dict=tests/fuzz/$name.dict")
TIMEFORMAT='%U %S'
status=0
cpu=$({ time "$program" "$out/corpus" "tests/fuzz/corpus/$name" "$out/seeds" -runs="$runs" -timeout=10 \
  -rss_limit_mb=2048 -malloc_limit_mb=512 \
  -max_len="$longest" -artifact_prefix="$out/" -print_final_stats=1 -verbosity=1 "${extra[@]}" >"$out/log" 2>&1; } 2>&1) || status=$?
if ((status)); then
  grep -v '^#' "$out/log" | tail -n 60
  echo "$name: failed (exit $status), whole log: $out/log"
  exit 1
fi
awk -v name="$name" -v cpu="$cpu" '
  /^#.*(DONE|INITED)/ { for (i = 1; i < NF; ++i) if ($i == "cov:") edges = $(i + 1) }
  /number_of_executed_units/ { n = $2 }
  /peak_rss_mb/ { mb = $2 }
  END { split(cpu, t, " "); printf "| %s | %d | %d | %d | %.0f | 0 |\n", name, n, edges, mb, t[1] + t[2] }' "$out/log"
