"""The cache: what was made before is there at once and the same; what changed is made anew; a cache that refuses costs nothing else."""
import json
import os

from program import expect, run, run_parts


def deck(folder, modulus="2.1e11", nx=12, ny=3):
    """A bar of nx x ny x ny bricks in two files."""
    number = lambda i, j, k: 1 + i + (nx + 1) * (j + (ny + 1) * k)
    nodes = [
        f"{number(i, j, k)}, {i / nx}, {0.1 * j / ny}, {0.1 * k / ny}" for k in range(ny + 1) for j in range(ny + 1) for i in range(nx + 1)
    ]
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    bricks = [[number(i + a, j + b, k + c) for a, b, c in corners] for k in range(ny) for j in range(ny) for i in range(nx)]
    elements = [", ".join(map(str, [e + 1, *brick])) for e, brick in enumerate(bricks)]
    (folder / "steel.inc").write_text(f"*material, name=steel\n*elastic\n{modulus}, 0.3\n*density\n7850\n")
    parts = ["*node", *nodes, "*element, type=C3D8, elset=all", *elements, "*include, input=steel.inc"]
    parts += ["*solid section, elset=all, material=steel", "*nset, nset=root", ", ".join(str(number(0, 0, k)) for k in range(ny + 1))]
    (folder / "bar.inp").write_text("\n".join(parts) + "\n")
    return folder / "bar.inp"


def made(out):
    return {ending: out.with_suffix(ending).read_bytes() for ending in (".sid", ".obj", ".md")}


def reductions(folder):
    model, cache = deck(folder), folder / "cache"

    def reduce(name, *words, modes=4):
        out = folder / f"{name}.sid"
        report = json.loads(run("reduce", model, "-o", out, "--modes", modes, "--cache", cache, *words, "--json").stdout)
        return report, made(out)

    first, files = reduce("first")
    expect(first["kept"] is False and len(list(cache.iterdir())) == 1, f"the first reduction: {first['kept']}")
    again, same = reduce("again")
    expect(again["kept"] is True and same == files, "the second time another body")
    expect(
        {k: v for k, v in again.items() if k not in ("kept", "body")} == {k: v for k, v in first.items() if k not in ("kept", "body")},
        "another summary",
    )
    expect(reduce("fresh", "--fresh")[0]["kept"] is False, "--fresh took what was kept")
    expect(reduce("more", modes=5)[0]["kept"] is False, "other words took what was kept")
    # The file that the deck includes counts too.
    deck(folder, "2.2e11")
    other, files2 = reduce("other")
    expect(other["kept"] is False and files2[".sid"] != files[".sid"], "a changed material took what was kept")
    expect(abs(other["frequencies"][0] / first["frequencies"][0] - (2.2 / 2.1) ** 0.5) < 1e-6, "the frequencies of the other material")
    deck(folder)
    back, files3 = reduce("back")
    expect(files3[".sid"] == files[".sid"], "the first material again, another body")
    # Damaged: made anew.
    for entry in cache.iterdir():
        data = bytearray(entry.read_bytes())
        data[len(data) // 2] ^= 1
        entry.write_bytes(data)
    mended, files4 = reduce("mended")
    expect(mended["kept"] is False and files4[".sid"] == files[".sid"], "a damaged file of the cache was taken")


def places(folder):
    model = deck(folder, nx=40, ny=8)  # enough work to be kept without being asked
    bare = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_CACHE_HOME", "FLEXFRAME_CACHE")}
    words = ["reduce", model, "-o", folder / "b.sid", "--modes", "6", "--json"]
    for name, variables, place in [
        ("home", {"HOME": str(folder / "home")}, folder / "home/.cache/flexframe"),
        ("xdg", {"HOME": str(folder / "home2"), "XDG_CACHE_HOME": str(folder / "xdg")}, folder / "xdg/flexframe"),
        ("none", {"HOME": str(folder / "home3"), "FLEXFRAME_CACHE": "none"}, None),
        ("nowhere", {"HOME": "/proc"}, None),
        ("nobody", {}, None),
    ]:
        kept = [json.loads(run(*words, env={**bare, **variables}).stdout)["kept"] for _ in range(2 if place else 1)]
        expect(kept == ([False, True] if place else [False]), f"{name}: {kept}")
        expect(place is None or len(list(place.glob("*.body"))) == 1, f"{name}: no file in {place}")
    expect(not (folder / "home2").exists() and not (folder / "home3").exists(), "a home that was not asked for was written to")
    # Pictures: mapped modes of the same build, read again.
    draw = ["modes", folder / "b.sid", "--mode", "1", "--pictures", "2", "--size", "64x48", "--no-video", "-q"]
    home = {**bare, "HOME": str(folder / "home")}
    for out in ("one", "two"):
        run(*draw, "-o", folder / out, env=home)
    run(*draw, "-o", folder / "three", "--cache", "none", env=home)
    pictures = [[p.read_bytes() for p in sorted((folder / out).rglob("*.png"))] for out in ("one", "two", "three")]
    expect(len(pictures[0]) == 2 and pictures[0] == pictures[1] == pictures[2], "pictures by the cache are others")
    expect(len(list((folder / "home/.cache/flexframe").glob("*.modes"))) == 1, "no mapped modes were kept")


run_parts(reductions, places)
