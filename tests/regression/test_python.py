"""The Python module: the same numbers and pixels as the program, to the last bit; forces, inputs, errors, interrupts; what a call costs."""
import pathlib
import subprocess
import sys

from program import expect, finish, flexframe, source, temporary_folder

build = pathlib.Path(flexframe).resolve().parent
if not (build / "python/flexframe").exists():
    print("the build has no Python module (FLEXFRAME_PYTHON): pybind11-dev and python3-dev are missing")
    expect(False, "no module")
    finish()
python = "/usr/bin/python3"
with temporary_folder() as folder:
    out = subprocess.run(
        [python, str(source / "tests/regression/python_module.py"), flexframe, str(source), folder, *sys.argv[3:]],
        env={"PYTHONPATH": str(build / "python"), "PATH": "/usr/bin:/bin", "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=550,
    )
    print(out.stdout, out.stderr, sep="\n")
    expect(out.returncode == 0, f"the module's tests failed: exit {out.returncode}")
finish()
