"""The Debian packages: packages.py FLEXFRAME SOURCE_DIR, for the nightly run.

Made by cpack from the build of FLEXFRAME, looked at by lintian (no errors) and, where debootstrap can make a clean root, installed there
with what they depend on; in it the quick start's run, the Python example and the project outside of the tree. The source tarball is then
unpacked there and its program built, with the packages that it lists itself; its histories are those of the installed program bit for bit.
FLEXFRAME_ROOT=FOLDER: a root that `debootstrap --variant=minbase` has made, copied instead of made anew. FLEXFRAME_JOBS=N: compilers at
once. FLEXFRAME_TARBALL=no: the tarball is looked at, not built, which takes most of the time.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

from program import expect, failures, finish, flexframe, source, temporary_folder

EXAMPLE = """
import flexframe as ff
r = ff.simulate("/usr/share/flexframe/examples/pendulum.toml", accuracy=1e-3)
print(ff.draw(r, t=0.5, size=(640, 360)).shape, r.columns, r.warnings)
made = ff.film(r, "film", frames=(0, 3), video=False, size=(320, 180))
assert made["pictures"] == 3, made
"""

ZSH = r"""
zmodload zsh/zpty
zpty shell zsh -f
zpty -w shell "autoload -Uz compinit && compinit -u -d /tmp/dump; print ready"
zpty -r shell line "*ready*ready*"
zpty -w -n shell "$1"$'\t'
sleep 3
zpty -r -t shell line
print -r -- "$line"
while zpty -r -t shell line; do print -r -- "$line"; done
"""

build = pathlib.Path(flexframe).resolve().parent


def done(*words, **more):
    out = subprocess.run([str(w) for w in words], capture_output=True, text=True, **more)
    expect(out.returncode == 0, f"{' '.join(map(str, words))}: exit {out.returncode}\n{out.stdout[-3000:]}\n{out.stderr[-3000:]}")
    return out.stdout


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    done("cpack", "--config", build / "CPackConfig.cmake", "-B", folder / "packages", cwd=build)
    debs = sorted((folder / "packages").glob("*.deb"))
    names = [deb.name.split("_")[0] for deb in debs]
    expect(names == ["flexframe", "libflexframe-dev", "python3-flexframe"], f"packages: {names}")
    for deb in debs:
        fields = done("dpkg-deb", "--field", deb)
        expect("Depends:" in fields and "Maintainer:" in fields, fields)
        print(fields)
    needs = done("dpkg-deb", "--field", debs[0], "Depends")
    for name in ("libosmesa6", "libopenblas0", "libmumps-seq", "libmetis5", "libnetcdf", "libmatio", "libzip"):
        expect(name in needs, f"the program's package lacks {name}, which is opened when it is needed: {needs}")
    expect("copyright.hdf5" in done("dpkg-deb", "--contents", debs[0]), "HDF5 is within the program, its terms are not in the package")
    if shutil.which("lintian"):
        out = subprocess.run(["lintian", "--fail-on", "error", "--allow-root", *map(str, debs)], capture_output=True, text=True)
        print(out.stdout)
        expect(out.returncode == 0, f"lintian: {out.stdout}")
    else:
        print("lintian is not installed: not looked at")
    done("cpack", "--config", build / "CPackSourceConfig.cmake", "-B", folder / "source", cwd=build)
    tarball = next((folder / "source").glob("*.tar.gz"))
    listed = done("tar", "tf", tarball)
    top = listed.split("/")[0]
    expect(f"{top}/sim/simulate.cpp\n" in listed and "/build/" not in listed, "the source tarball is incomplete or holds a build")

    if not shutil.which("debootstrap") or os.geteuid() != 0:
        print("debootstrap is not installed, or not root: not tried in a clean root")
        sys.exit(1 if failures else 0)
    root = folder / "root"
    if os.environ.get("FLEXFRAME_ROOT"):
        done("cp", "-a", os.environ["FLEXFRAME_ROOT"], root)
    else:
        done("debootstrap", "--variant=minbase", "bookworm", root)
    for deb in debs:
        shutil.copy(deb, root / "tmp")
    shutil.copy(tarball, root / "tmp")
    shutil.copytree(source / "examples/library", root / "tmp/library")

    def inside(command):
        # With /proc in a mount namespace of its own, so that nothing stays mounted whatever happens.
        mounts = f"mount --make-rprivate / && mount -t proc proc {root}/proc && mount --bind /dev/pts {root}/dev/pts"
        chroot = f'{mounts} && exec chroot {root} /bin/bash -euc "$0"'
        return done("unshare", "--mount", "bash", "-euc", chroot, command, env={**os.environ, "DEBIAN_FRONTEND": "noninteractive"})

    def step(what, command):
        begin = time.time()
        inside(command)
        if failures:
            sys.exit(1)  # what follows needs this one
        print(f"{what}: {time.time() - begin:.0f} s", flush=True)

    apt = "apt-get install -q -y --no-install-recommends -o Dpkg::Options::=--force-unsafe-io"
    step("program and Python module installed", f"apt-get update -q && {apt} /tmp/flexframe_*.deb /tmp/python3-flexframe_*.deb")
    scenes = "/usr/share/flexframe/examples"
    step("quick start", f"cd /tmp && flexframe run {scenes}/slider_crank.toml -o out --frames 0:3 && test -s out/frames/frame_00002.png")
    step("manual page", "test -s /usr/share/man/man1/flexframe.1.gz && test -s /usr/share/bash-completion/completions/flexframe")
    (root / "tmp/example.py").write_text(EXAMPLE)
    step("Python example", "cd /tmp && python3 example.py")
    step("libraries and compiler installed", f"{apt} /tmp/libflexframe-dev_*.deb g++ cmake ninja-build")
    step("outside project", "cmake -G Ninja -S /tmp/library -B /tmp/uses && cmake --build /tmp/uses")
    step(
        "its programs",
        "/tmp/uses/cart /tmp/library/cart.toml && /tmp/uses/kernel_map && /tmp/uses/drawing /tmp/wave.png && test -x /tmp/uses/part",
    )

    # A user's image tests, as the workflow to copy has them: its project file stands in its head, its commands below.
    workflow = (source / "tests/image/workflow.yml").read_text()
    project = root / "tmp/pictures"
    project.mkdir()
    lines = [line[4:] for line in workflow.splitlines() if line.startswith("#   ")]
    (project / "CMakeLists.txt").write_text("\n".join(["cmake_minimum_required(VERSION 3.25)", *lines]) + "\n")
    shutil.copy(source / "examples/mechanisms/pendulum.toml", project / "swing.toml")
    configure, test = re.findall(r"run: (cmake -G.*|ctest .*)", workflow)
    step("image tests, first pictures", f'cd /tmp/pictures && {configure} && FLEXFRAME_UPDATE="first pictures" {test}')
    step("image tests", f"cd /tmp/pictures && {test}")

    # The completions in the shells that they are for.
    step("zsh and fish installed", f"{apt} zsh fish")
    typed = "flexframe run --color-by str"
    fish = f"fish -c 'complete --do-complete \"{typed}\"' | cut -f 1 | tr '\\n' ' '"
    step("fish completes", f'test "$({fish})" = "strain stress "')
    # zsh completes on a terminal only: one of its own is typed into.
    (root / "tmp/zsh.exp").write_text(ZSH)
    step("zsh completes", f"zsh /tmp/zsh.exp '{typed}es' | grep -a 'color-by stress'")

    if os.environ.get("FLEXFRAME_TARBALL") == "no":
        finish()
    # From the tarball, as a stranger would: the packages that its own list names, its preset, its program.
    step("tarball unpacked", "mkdir /tmp/source && tar -xf /tmp/flexframe-*.tar.gz -C /tmp/source --strip-components=1")
    names = "top=/tmp/source; source tests/packages.sh"
    step("packages of its list", f"cd /tmp/source && {names}; {apt} $(packages_of build clang)")
    jobs = os.environ.get("FLEXFRAME_JOBS", str(os.cpu_count()))
    build_it = "cmake --preset clang -D FLEXFRAME_TESTS=OFF -D FLEXFRAME_BENCHMARKS=OFF && cmake --build --preset clang --target flexframe"
    step("its program built", f"cd /tmp/source && {build_it} -j {jobs}")
    for program, name in (("build/clang/flexframe", "mine"), ("flexframe", "installed")):
        step(f"its simulation, {name}", f"cd /tmp/source && {program} simulate examples/slider_crank.toml -o {name}.h5 --csv {name}.csv")
    step("the same bits", "cmp /tmp/source/mine.csv /tmp/source/installed.csv")
finish()
