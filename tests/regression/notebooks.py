"""The notebooks of examples/notebooks, executed by nbconvert: notebooks.py FLEXFRAME SOURCE_DIR [OUTPUT_FOLDER]. A cell that fails is
one."""

import os
import pathlib
import subprocess
import sys
import time

from program import examples, expect, finish, flexframe, temporary_folder

build = pathlib.Path(flexframe).resolve().parent
environment = {**os.environ, "PYTHONPATH": str(build / "python"), "EXAMPLES": str(examples), "PYTHONDONTWRITEBYTECODE": "1"}
environment.update(IPYTHONDIR="", MPLBACKEND="module://matplotlib_inline.backend_inline")
with temporary_folder() as folder:
    environment.update(HOME=folder, MPLCONFIGDIR=folder)
    to = sys.argv[3] if len(sys.argv) > 3 else folder
    notebooks = sorted((examples / "notebooks").glob("*.ipynb"))
    expect(len(notebooks) == 3, f"{len(notebooks)} notebooks")
    for notebook in notebooks:
        begin = time.time()
        out = subprocess.run(
            ["/usr/bin/python3", "-m", "nbconvert", "--to", "html", "--execute", "--output-dir", to, str(notebook)],
            env=environment,
            capture_output=True,
            text=True,
            timeout=500,
        )
        expect(out.returncode == 0, f"{notebook.name}: exit {out.returncode}\n{out.stdout[-1500:]}\n{out.stderr[-4000:]}")
        made = pathlib.Path(to) / (notebook.stem + ".html")
        pictures = made.read_text(encoding="utf-8").count("data:image/png") if made.exists() else 0
        expect(pictures >= 1, f"{notebook.name}: {pictures} pictures")
        print(f"{notebook.name}: {time.time() - begin:.1f} s, {pictures} pictures", flush=True)
finish()
