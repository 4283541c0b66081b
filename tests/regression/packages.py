"""The Debian packages: packages.py FLEXFRAME SOURCE_DIR, for the nightly run.

Made by cpack from the build of FLEXFRAME, looked at by lintian (no errors) and, where debootstrap can make a clean root, installed there
with what they depend on; in it the quick start's run, the Python example and the project outside of the tree.
"""

import os
import pathlib
import shutil
import subprocess

from program import expect, finish, flexframe, source, temporary_folder

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
    expect("libosmesa6" in done("dpkg-deb", "--field", debs[0], "Depends"), "the program's package lacks OSMesa")
    if shutil.which("lintian"):
        out = subprocess.run(["lintian", "--fail-on", "error", "--allow-root", *map(str, debs)], capture_output=True, text=True)
        print(out.stdout)
        expect(out.returncode == 0, f"lintian: {out.stdout}")
    else:
        print("lintian is not installed: not looked at")
    done("cpack", "--config", build / "CPackSourceConfig.cmake", "-B", folder / "source", cwd=build)
    tarball = next((folder / "source").glob("*.tar.xz"))
    listed = done("tar", "tf", tarball)
    expect("/sim/simulate.cpp" in listed and "/build/" not in listed, "the source tarball is incomplete or holds a build")

    if not shutil.which("debootstrap") or os.geteuid() != 0:
        print("debootstrap is not installed, or not root: not tried in a clean root")
        finish()
    root = folder / "root"
    done("debootstrap", "--variant=minbase", "bookworm", root)
    for deb in debs:
        shutil.copy(deb, root / "tmp")
    shutil.copytree(source / "examples/library", root / "tmp/library")

    def inside(command):
        return done("chroot", root, "/bin/bash", "-euc", command)

    inside("apt-get update -q && apt-get install -y --no-install-recommends /tmp/*.deb g++ cmake ninja-build")
    inside(
        "cd /tmp && flexframe run /usr/share/flexframe/examples/slider_crank.toml -o out --frames 0:3 && test -s out/frames/frame_00002.png"
    )
    example = "import flexframe as ff; print(ff.draw(ff.simulate('/usr/share/flexframe/examples/pendulum.toml')).shape)"
    inside(f'cd /tmp && python3 -c "{example}"')
    inside("cmake -G Ninja -S /tmp/library -B /tmp/uses && cmake --build /tmp/uses")
    inside("/tmp/uses/cart /tmp/library/cart.toml && /tmp/uses/kernel_map && /tmp/uses/drawing /tmp/wave.png")
finish()
