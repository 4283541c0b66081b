"""Scenes with parameters, units, settings of the command line, included files, groups, named places and guesses, through the real program.

The truth is a scene with plain numbers, written here, or a closed formula."""
import math
import pathlib

from program import expect, finish, history, near, run, temporary_folder

head = """[simulation]
duration = 0.5
gravity = [0, -9.81, 0]
tolerance = 1e-9
"""
rod = """[[body]]
name = "%(name)s"
kind = "rigid"
mass = %(mass)s
inertia = [0, %(inertia)s, %(inertia)s]
centre_of_mass = [%(half)s, 0, 0]
frames = { tip = [%(length)s, 0, 0] }
"""
pin = """[[joint]]
name = "%(name)s"
kind = "revolute"
parent = "%(parent)s"
child = "%(child)s"
"""
angle = """[[output]]
name = "%(name)s"
of = "%(name)s"
quantity = "value"
"""


def simulate(folder, text, *words, code=0, name="scene.toml"):
    """The histories, or stderr of a run that is to fail."""
    scene = folder / name
    scene.write_text(text)
    done = run("simulate", scene, "-o", folder / "r.h5", "--csv", folder / "h.csv", *words, code=code)
    return history(folder / "h.csv") if code == 0 else done.stderr


def same(a, b, what):
    expect(a.keys() == b.keys(), f"{what}: columns {list(a)} and {list(b)}")
    worst = max(abs(x - y) for key in a.keys() & b.keys() for x, y in zip(a[key], b[key]))
    expect(worst == 0.0, f"{what}: off by {worst:.3g}")


def number_scenes(folder):
    def pendulum(length, mass, start):
        values = {"name": "rod", "mass": mass, "inertia": mass * length**2 / 12, "half": length / 2, "length": length}
        joint = pin % {"name": "pin", "parent": "ground", "child": "rod"}
        return head + rod % values + joint + f"initial = {{ value = {start!r} }}\n" + angle % {"name": "pin"}

    text = (
        """[parameters]
m = "2*base"
L = "500 mm"
base = 1
start = "-30 deg"
"""
        + head.replace("0.5", '"500 ms"').replace("[0, -9.81, 0]", '"[0, -9.81, 0]"')
        + rod % {"name": "rod", "mass": '"m"', "inertia": '"m*L^2/12"', "half": '"L/2"', "length": '"L"'}
        + pin % {"name": "pin", "parent": "ground", "child": "rod"}
        + 'initial = { value = "start" }\n'
        + angle % {"name": "pin"}
    )
    plain = simulate(folder, pendulum(0.5, 2.0, -math.pi / 6))
    same(simulate(folder, text), plain, "a pendulum of parameters and units")
    set_text = simulate(folder, text, "--set", "L=0.25", "--set", "body.rod.mass=3", "--set", "joint.pin.initial.value=0.125")
    reference = pendulum(0.25, 3.0, 0.125).replace(f"{3.0 * 0.25**2 / 12}", f"{2.0 * 0.25**2 / 12}")
    same(set_text, simulate(folder, reference), "the same with three settings")
    # What is drawn from the results is the scene as it was run.
    simulate(folder, text, "--set", "L=0.25")
    run("info", folder / "r.h5")
    run("render", folder / "r.h5", "-o", folder / "pictures", "--size", "64x64", "--frames", "0:1", "--no-video")

    wrong = [
        (text.replace('"L/2"', '"L/"'), [], ["scene.toml:15", "'rod'", "'centre_of_mass'", "'L/'"]),
        (text.replace('"L/2"', '"K/2"'), [], ["'K'", "no parameter", "L"]),
        (text.replace("base = 1", 'base = "m"'), [], ["scene.toml:", "'m'", "need each other"]),
        (text.replace('mass = "m"', 'mass = "2 mm"'), [], ["'mass'", "'mm'", "kg"]),
        (text.replace('"start"', '"20 Hz"'), [], ["'initial.value'", "'Hz'", "rad"]),
        (text.replace("[parameters]", "[parameters]\nsin = 3"), [], ["scene.toml:2", "'sin'"]),
        (text.replace('mass = "m"', 'mass = "base - 2"'), [], ["'mass'", "-1", "base = 1"]),
        (text.replace('mass = "m"', 'mass = "t"'), [], ["'mass'", "time"]),
        (text, ["--set", "K=3"], ["--set K", "no parameter 'K'; there are m, L"]),
        (text, ["--set", "body.rod.mas=3"], ["'mas'", "mass"]),
        (text, ["--set", "body.rodd.mass=3"], ["rodd", "rod"]),
        (text, ["--set", "L"], ["NAME=VALUE"]),
    ]
    chain = "".join(f'p{i} = "p{i + 1}"\n' for i in range(5000))
    wrong.append((text.replace("[parameters]\n", "[parameters]\n" + chain + "p5000 = 1\n"), [], ["p0", "200 steps"]))
    for scene, words, parts in wrong:
        if not parts:
            continue
        message = simulate(folder, scene, *words, code=2)
        for part in parts:
            expect(part in message, f"{part!r} is missing in: {message}")


def rotations(folder):
    def scene(rotation):
        return (
            head
            + rod % {"name": "rod", "mass": 2, "inertia": 0.1, "half": 0.25, "length": 0.5}
            + pin % {"name": "pin", "parent": "ground", "child": "rod"}
            + f"rotation = {rotation}\n"
            + '[[output]]\nname = "tip"\nof = "rod.tip"\nquantity = "position"\n'
        )

    plain = simulate(folder, scene("[0, 0, 0.7853981633974483]"))
    for rotation in [
        '{ quaternion = ["2*cos(pi/8)", 0, 0, "2*sin(pi/8)"] }',
        '[0, 0, "45 deg"]',
        '{ axis = [0, 0, 2], angle = "45 deg" }',
        '{ euler = "xyz", angles = [0, 0, "pi/4"] }',
    ]:
        turned = simulate(folder, scene(rotation))
        worst = max(abs(x - y) for key in plain for x, y in zip(plain[key], turned[key]))
        expect(worst < 1e-12, f"rotation = {rotation}: off by {worst:.3g}")
    # Turns about z, the new x, the new z: the tip lies where the matrices put it.
    a, b, c = 0.3, 0.5, 0.7
    h = simulate(folder, scene(f'{{ euler = "zxz", angles = [{a}, {b}, {c}] }}'))
    wanted = [
        math.cos(a) * math.cos(c) - math.sin(a) * math.cos(b) * math.sin(c),
        math.sin(a) * math.cos(c) + math.cos(a) * math.cos(b) * math.sin(c),
        math.sin(b) * math.sin(c),
    ]
    for k, axis in enumerate("xyz"):
        near(h[f"tip.{axis}"][0], 0.5 * wanted[k], 1e-12, f"Euler angles, {axis}")


def parts(folder):
    (folder / "parts").mkdir()
    (folder / "parts" / "rod.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "parts" / "pendulum.toml").write_text(
        """[parameters]
mass = 5
[[group]]
name = "pendulum"
parameters = { L = 0.5, carrier = "ground", start = 0 }
[[group.body]]
name = "rod"
kind = "rigid"
mass = "mass"
inertia = "[0, mass*L^2/12, mass*L^2/12]"
centre_of_mass = "[L/2, 0, 0]"
frames = { tip = ["L", 0, 0] }
mesh = "rod.obj"
[[group.joint]]
name = "pin"
kind = "revolute"
parent = "{carrier}"
child = "rod"
initial = { value = "start" }
[[group.output]]
name = "angle"
of = "pin"
quantity = "value"
[[group.output]]
name = "tip"
of = "rod.tip"
quantity = "position"
"""
    )
    text = (
        'include = "parts/pendulum.toml"\n[parameters]\nmass = 2\n'
        + head
        + """[[instance]]
group = "pendulum"
name = "p"
count = 2
position = "[i, 0, 0]"
parameters = { start = "-0.1*i" }
[[instance]]
group = "pendulum"
name = "second"
parameters = { L = "mass/8", carrier = "p1:rod.tip" }
"""
    )
    plain = head
    rods = [("p1:rod", 0.5, "ground", 1, -0.1), ("p2:rod", 0.5, "ground", 2, -0.2), ("second:rod", 0.25, "p1:rod.tip", 0, 0)]
    for name, length, _, _, _ in rods:
        plain += rod % {"name": name, "mass": 2, "inertia": 2 * length**2 / 12, "half": length / 2, "length": length}
    for name, _, parent, x, start in rods:
        plain += pin % {"name": name.replace("rod", "pin"), "parent": parent, "child": name}
        plain += f"position = [{x}, 0, 0]\ninitial = {{ value = {start} }}\n"
    for name, *_ in rods:
        own = name.split(":")[0]
        plain += f'[[output]]\nname = "{own}:angle"\nof = "{own}:pin"\nquantity = "value"\n'
        plain += f'[[output]]\nname = "{own}:tip"\nof = "{name}.tip"\nquantity = "position"\n'
    wanted = simulate(folder, plain, name="plain.toml")
    same(simulate(folder, text), wanted, "three pendulums of one group")
    run("render", folder / "r.h5", "-o", folder / "of_parts", "--size", "64x64", "--frames", "0:1", "--no-video")
    set_length = simulate(folder, text, "--set", "body.second:rod.mass=4", "--set", "mass=2")
    expect(set_length["second:angle"] != wanted["second:angle"], "a setting did not reach the body of an instance")

    for wrong, parts_of_message in [
        (text.replace('group = "pendulum"\nname = "p"', 'group = "pendulem"\nname = "p"'), ["'pendulem'", "pendulum"]),
        (text.replace('L = "mass/8"', "K = 3"), ["'parameters.K'", "L"]),
        (text.replace("parts/pendulum", "parts/none"), ["scene.toml:1", "'include'", "none.toml"]),
        (text.replace("count = 2", "count = 1.5"), ["'count'", "1.5"]),
        (text.replace('"p1:rod.tip"', '"p9:rod.tip"'), ["pendulum.toml", "p9:rod", "p1:rod"]),
    ]:
        message = simulate(folder, wrong, code=2)
        for part in parts_of_message:
            expect(part in message, f"{part!r} is missing in: {message}")
    (folder / "parts" / "a.toml").write_text('include = "b.toml"\n')
    (folder / "parts" / "b.toml").write_text('include = "a.toml"\n')
    message = simulate(folder, text.replace("parts/pendulum", "parts/a"), code=2)
    expect("circle" in message and "b.toml" in message, f"a circle of includes: {message}")


def words_in_expressions(folder):
    """A word of a group in an expression, the name of an output outside; {i} there is what i is."""
    text = (
        head
        + """[[group]]
name = "follower"
parameters = { leader = "none", gain = 2 }
[[group.body]]
name = "cart"
kind = "rigid"
mass = 1
[[group.joint]]
name = "rail"
kind = "prismatic"
parent = "ground"
child = "cart"
axis = [1, 0, 0]
[[group.force]]
kind = "force"
on = "cart"
direction = [1, 0, 0]
value = "{gain}*{leader} + {i - 3}*t"
[[group.output]]
name = "x"
of = "rail"
quantity = "value"
[[body]]
name = "leader"
kind = "rigid"
mass = 1
[[joint]]
name = "leader"
kind = "prismatic"
parent = "ground"
child = "leader"
axis = [1, 0, 0]
motion = "t^2"
[[output]]
name = "place"
of = "leader"
quantity = "value"
[[instance]]
group = "follower"
name = "f"
count = 2
parameters = { leader = "place" }
"""
    )
    h = simulate(folder, text)
    for i in (1, 2):
        worst = max(abs(x - (t**4 / 6 + (i - 3) * t**3 / 6)) for t, x in zip(h["t"], h[f"f{i}:x"]))
        near(worst, 0, 1e-7, f"a word of a group in an expression, copy {i}")
    message = simulate(folder, text.replace("{gain}", "{gian}"), code=2)
    for word in ("scene.toml:", "gian"):
        expect(word in message, f"a misspelt parameter in braces: {word!r} is missing in {message!r}")


def four_bar(folder):
    # Ground 4, crank 1, coupler 3.5, rocker 2; from three digits, and each branch as asked. Closed: the distance law of the two circles.
    ground, crank, coupler, rocker = 4.0, 1.0, 3.5, 2.0
    start = 1.047
    x, y = crank * math.cos(start) - ground, crank * math.sin(start)
    d = math.hypot(x, y)

    def scene(guess):
        text = head.replace("0.5", "0.1")
        for name, length in (("crank", crank), ("coupler", coupler), ("rocker", rocker)):
            text += rod % {"name": name, "mass": 1, "inertia": 0.1, "half": length / 2, "length": length}
        text += pin % {"name": "a", "parent": "ground", "child": "crank"} + f"initial = {{ value = {start}, rate = 1 }}\n"
        text += pin % {"name": "b", "parent": "crank.tip", "child": "coupler"}
        text += pin % {"name": "d", "parent": "ground", "child": "rocker"} + f"position = [{ground}, 0, 0]\n"
        text += f"initial = {{ guess = {guess} }}\n"
        text += pin % {"name": "c", "parent": "coupler.tip", "child": "rocker.tip"}
        return text + '[[output]]\nname = "c"\nof = "rocker.tip"\nquantity = "position"\n'

    for sign, guess in ((1.0, 2.0), (-1.0, -2.5)):
        h = simulate(folder, scene(guess))
        # The coupler's end: at distances `coupler` from the crank's pin and `rocker` from the ground's.
        along = (d * d + rocker**2 - coupler**2) / (2 * d)
        beside = math.sqrt(rocker**2 - along**2)
        wanted_x = ground + (along * x + sign * beside * y) / d
        wanted_y = (along * y - sign * beside * x) / d
        near(h["c.x"][0], wanted_x, 1e-9, f"four-bar, guess {guess}, x")
        near(h["c.y"][0], wanted_y, 1e-9, f"four-bar, guess {guess}, y")
    # Values of which several almost close the loop are answered with what they are as guesses.
    file = folder / "scene.toml"
    inner = 'name = "b"\nkind = "revolute"\nparent = "crank.tip"\nchild = "coupler"\n'
    for value in ("-0.72", "1.5"):
        file.write_text(scene(1.66).replace("guess", "value").replace(inner, inner + f"initial = {{ value = {value} }}\n"))
        said = run("check", file, code=2).stderr
        for word in ("with initial.guess instead of initial.value at", "joint 'd' 1.66", "joint 'b' -0.719" if value == "-0.72" else ""):
            expect(word in said, f"values that almost close a loop: {word!r} is missing in {said!r}")
    # Driven beyond its reach.
    file.write_text(
        scene(2.0).replace(f"initial = {{ value = {start}, rate = 1 }}", 'motion = "1.047 + 40*t"').replace("[1.0, 0", "[2.6, 0")
    )
    said = run("simulate", file, "-o", folder / "x.h5", code=1).stderr
    for word in ("limit of its reach", "another way to assemble", "guess"):
        expect(word in said, f"a four-bar that cannot turn: {word!r} is missing in {said!r}")


def shares_and_speeds(folder):
    """Per cent where a plain number stands, and a speed of friction with its unit."""
    text = head.replace("0.5", "0.2") + rod % {"name": "rod", "mass": 1, "inertia": 0.1, "half": 0.2, "length": 0.4}
    text += pin % {"name": "pin", "parent": "ground", "child": "rod"} + "initial = { rate = 2 }\n" + angle % {"name": "pin"}
    friction = "friction = { coefficient = %s, normal_force = 40, radius = 0.1, regularised = %s }\n"
    plain = simulate(folder, text.replace("initial", friction % (0.05, 0.5) + "initial"))
    same(simulate(folder, text.replace("initial", friction % ('"5 %"', '"0.5 rad/s"') + "initial")), plain, "5 % and 0.5 rad/s")
    asked = simulate(folder, text.replace("tolerance = 1e-9", "accuracy = 0.01"))
    for words in ('"1 %"', '"2*share"'):
        given = "[parameters]\nshare = 0.005\n" + text.replace("tolerance = 1e-9", f"accuracy = {words}")
        same(simulate(folder, given), asked, f"an accuracy of {words}")
    same(simulate(folder, text.replace("tolerance = 1e-9\n", ""), "--accuracy", "1 %"), asked, "--accuracy 1 %")
    message = simulate(folder, text.replace("tolerance = 1e-9\n", ""), "--accuracy", "1 kg", code=2)
    expect("--accuracy" in message and "0.5 px" in message, f"--accuracy 1 kg: {message}")

    # The unit behind a whole expression is the whole's; what is missing is not what another key of the table is meant to be.
    turns = text.replace("initial = { rate = 2 }", 'motion = "t*1200 rpm"')
    message = simulate(folder, turns, code=2)
    for word in ("'motion'", "'rpm'", "in rad", "t*(2 rpm)"):
        expect(word in message, f"t*1200 rpm: {word!r} is missing in {message!r}")
    simulate(folder, turns.replace("t*1200 rpm", "t*(1200 rpm)"))
    beam = '[[body]]\nname = "b"\nkind = "beam"\nmodel = "modal"\nlength = 1\n'
    beam += 'material = { density = 1000, youngs_modulus = 1e9 }\nsection = { shape = "circle", diameter = 0.02 }\n'
    message = simulate(folder, head + beam + pin % {"name": "pin", "parent": "ground", "child": "b"}, code=2)
    expect("'modes' is missing" in message and "misspelling" not in message, f"modes left out: {message}")


def two_ways(folder):
    """Texts that may be read in two ways: each is read as the page says, and a warning says how."""

    def pushed(value, parameters="", outputs="", more="", kind="force", name="push"):
        text = "[simulation]\nduration = 0.1\noutput_rate = 10\n" + parameters
        for k in ("a", "b"):
            text += f'[[body]]\nname = "{k}"\nkind = "rigid"\nmass = 1\n'
            text += f'[[joint]]\nname = "{k}"\nkind = "prismatic"\nparent = "ground"\nchild = "{k}"\naxis = [1, 0, 0]\n'
            text += f'motion = "{2 if k == "a" else 5} + t"\n'
        for output in outputs.split():
            text += f'[[output]]\nname = "{output}"\nof = "{"b" if output == "b" else "a"}"\nquantity = "value"\n'
        more = more or "direction = [0, 1, 0]\n"
        text += f'[[force]]\nname = "push"\nkind = "{kind}"\non = "a"\n{more}value = "{value}"\n'
        text += '[[output]]\nname = "F"\nof = "push"\nquantity = "force"\n'
        (folder / "s.toml").write_text(text)
        done = run("simulate", folder / "s.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv")
        return history(folder / "h.csv")["F"][-1], "WARNING" in done.stdout and done.stdout

    g = "[parameters]\ng = 9.81\nm = 3\n"
    weight = g + 'W = "5 kg*g"\n'
    spring = dict(kind="spring-damper", more='from = "b"\nstiffness = 1e-9\n')
    for what, (found, warned), wanted, word in (
        ("grams times a time", pushed("5 kg*g*t", g), 0.0005, "'g'"),
        ("the parameter with blanks", pushed("5 kg * g*t", g), 4.905, None),
        ("a parameter in grams", pushed("W", weight), 0.005, "'g'"),
        ("a parameter's product", pushed("W", weight.replace("kg*g", "kg * g")), 49.05, None),
        ("newtons a metre", pushed("20 N/m*a", g, "a"), 42.0, None),
        ("hours", pushed("1 N*h*t", "", "h"), 360.0, "'h'"),
        ("a parameter with an output's name", pushed("2*m", g, "m"), 6.0, "'m'"),
        ("a parameter with the spring's word", pushed("length + rate", "[parameters]\nlength = 7\n", "", **spring), 7.0, "'length'"),
        ("the spring's word", pushed("length + rate", "", "", **spring), 3.0, None),
        ("a name with a minus", pushed("a-b", "", "a b a-b"), 2.1, "'a-b'"),
        ("a difference", pushed("a - b", "", "a b a-b"), -3.0, None),
    ):
        near(found, wanted, 1e-6, what)
        expect(bool(warned) == bool(word) and (not word or word in warned), f"{what}: {warned}")
    group = """[simulation]
duration = 0.1
output_rate = 10
[[group]]
name = "g"
parameters = { m = 2, N = 3, s = 4 }
[[group.body]]
name = "a"
kind = "rigid"
mass = "m"
[[group.joint]]
name = "j"
kind = "prismatic"
parent = "ground"
child = "a"
initial = { value = 1, rate = 1 }
spring = { stiffness = "100 N/m", damping = "7 N s/m" }
[[group.output]]
name = "m"
of = "j"
quantity = "spring_force"
[[instance]]
group = "g"
name = "i"
"""
    # Outputs of any name are those of the group, not of the scene; of a parameter's name: the parameter, told.
    named = group.replace('"m"\nof = "j"\nquantity = "spring_force"', '"%s"\nof = "j"\nquantity = "value"')
    named += '[[group.output]]\nname = "E"\nexpression = "2*%s"\n'
    named += '[[body]]\nname = "o"\nkind = "rigid"\nmass = 1\n[[joint]]\nname = "o"\nkind = "prismatic"\nparent = "ground"\n'
    named += 'child = "o"\ninitial = { value = 7 }\n[[output]]\nname = "x-pos"\nof = "o"\nquantity = "value"\n'
    near(simulate(folder, named % ("x-pos", "x-pos"))["i:E"][0], 2.0, 1e-9, "an output of the group with a minus in its name")
    (folder / "s.toml").write_text(named % ("N", "N"))
    done = run("simulate", folder / "s.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv")
    near(history(folder / "h.csv")["i:E"][0], 6.0, 1e-9, "a parameter of the group with an output's name")
    expect("in '2*N' the parameter 'N' is read" in done.stdout, f"a parameter of the group is not told: {done.stdout}")
    near(simulate(folder, group)["i:m"][0], -107.0, 1e-9, "units in a group whose parameters and outputs have their names")


def meant_in_other_units(folder):
    """Numbers without a unit that look like degrees or like MPa and t/mm^3 are read in SI, with a warning that says what to write."""

    def said(old, new):
        text = (
            head
            + rod % {"name": "arm", "mass": 1, "inertia": 1, "half": 0.5, "length": 1}
            + pin % {"name": "arm", "parent": "ground", "child": "arm"}
        )
        text += '[[body]]\nname = "bar"\nkind = "beam"\nmodel = "finite-element"\nlength = 1\nsection = { shape = "rectangle", '
        text += "width = 0.02, height = 0.03 }\nmaterial = { density = 7850, youngs_modulus = 2.1e11 }\n"
        text += '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "bar"\nrotation = [0, 0, 1.5]\n' + angle % {
            "name": "arm"
        }
        expect(old in text, f"{old} is not in the scene")
        (folder / "s.toml").write_text(text.replace(old, new).replace("0.5\n", "0.01\n", 1))
        out = run("check", folder / "s.toml").stdout
        return " ".join(line for line in out.splitlines() if line.startswith("WARNING") and "s.toml" in line)

    turned, held, made = "rotation = [0, 0, 1.5]", 'name = "arm"\nkind = "revolute"', "density = 7850, youngs_modulus = 2.1e11"
    for old, new, words in (
        (turned, turned, ()),
        (turned, "rotation = [0, 0, 90]", ("'clamp'", "'rotation'", "90 deg", "14.3 turns")),
        (turned, 'rotation = "[0, 0, 22.5]"', ("22.5 deg",)),
        (turned, 'rotation = [0, 0, "90 deg"]', ()),
        (turned, 'rotation = [0, 0, "90 rad"]', ()),
        (turned, "rotation = { axis = [0, 0, 1], angle = -45 }", ("'rotation.angle'", "-45 deg")),
        (turned, 'rotation = { euler = "zxz", angles = [0, 0, 30] }', ("'rotation.angles'", "30 deg")),
        (turned, "rotation = [0, 0, 12.566370614359172]", ()),
        ("height = 0.03", "height = 0.03, angle = 45", ("'section.angle'", "45 deg")),
        ("width = 0.02, height = 0.03", "width = 20, height = 30", ("'section'", "35 m deep", "1 m long", "mm")),
        ("width = 0.02, height = 0.03", 'width = "20 mm", height = "30 mm"', ()),
        (held, held + "\ninitial = { value = -60 }", ("'initial.value'", "-60 deg")),
        (held, held + "\ninitial = { rate = 300 }", ()),
        (held, held + '\nstop = { lower = -45, upper = "45 deg", stiffness = 100 }', ("'stop.lower'", "-45 deg")),
        (held, held + "\nmotion = { table = [[0, 0], [1, 90], [2, 100]] }", ()),
        (made, "density = 7850, youngs_modulus = 210000", ("'material.density'", "in MPa?")),
        (made, "density = 7.85, youngs_modulus = 2.1e11", ("in g/cm^3?",)),
        (made, "density = 7.85e-9, youngs_modulus = 2.1e5", ("in t/mm^3 and MPa?",)),
        (made, "density = 7850, youngs_modulus = 210", ("in GPa?",)),
        (made, 'density = 7850, youngs_modulus = "210000 Pa"', ()),
        (made, "density = 2770, youngs_modulus = 5e7", ()),
        (made, made + " }\ndamping = { ratio = 2", ("'damping.ratio'", '"2 %"')),
        (made, made + ' }\ndamping = { ratio = "2 %"', ()),
        (made, made + " }\ndamping = { ratio = 1", ()),
        (made, made + ' }\ndamping = { ratio = "200 %"', ()),
        (made, made + " }\ndamping = { ratio = [0.01, 0.02, 1.5]", ('"1.5 %"',)),
        ("-9.81, 0]", "-9810, 0]", ("'gravity'", '"9810 mm/s^2"')),
        ("-9.81, 0]", '"-9810 mm/s^2", 0]', ()),
        (made, "density = 1, youngs_modulus = 2e11", ()),
    ):
        warned = said(old, new)
        expect(all(word in warned for word in words), f"{new}: {words} not all in {warned!r}")
        expect(bool(words) == bool(warned), f"{new}: warned {warned!r}")


def places(folder):
    # A mass on a spring from a named place hangs at rest length + m g / k.
    text = (
        head
        + """[ground]
frames = { hook = [0.3, 2, 0], rail = [0.3, 0, 0] }
[[body]]
name = "mass"
kind = "rigid"
mass = 3
[[joint]]
name = "slide"
kind = "prismatic"
parent = "ground.rail"
child = "mass"
axis = [0, 1, 0]
initial = { guess = 0.5 }
[[force]]
kind = "spring-damper"
on = "mass"
from = "ground.hook"
stiffness = "2 N/mm"
rest = "500 mm"
[[output]]
name = "place"
of = "mass"
quantity = "position"
"""
    ).replace("tolerance", 'start = "static"\ntolerance')
    h = simulate(folder, text)
    near(h["place.y"][-1], 2.0 - 0.5 - 3 * 9.81 / 2000, 1e-9, "spring from a named place, y")
    near(h["place.x"][-1], 0.3, 1e-12, "spring from a named place, x")
    message = simulate(folder, text.replace('"ground.hook"', '"ground.hok"'), code=2)
    expect("'hok'" in message and "hook" in message, f"a misspelt place: {message}")


def relative_outputs(folder):
    # Two rods turn at given angles: the tip of one seen from the middle of the other, by hand.
    text = head
    for name in ("a", "b"):
        text += rod % {"name": name, "mass": 1, "inertia": 0.1, "half": 0.25, "length": 0.5}
    for name, x, motion in (("a", 0, "0.3 + 2*t"), ("b", 1, "1 - 3*t")):
        text += pin % {"name": "pin_" + name, "parent": "ground", "child": name}
        text += f'position = [{x}, 0, 0]\nmotion = "{motion}"\n'
    for quantity in ("position", "velocity", "rotation", "angular_velocity", "distance", "distance_rate"):
        text += f'[[output]]\nname = "{quantity}"\nof = "b.tip"\nquantity = "{quantity}"\nrelative_to = "a.tip"\n'
    text += "[ground]\nframes = { mark = [0, 2, 0] }\n"
    text += '[[output]]\nname = "far"\nof = "a.tip"\nquantity = "distance"\nrelative_to = "ground.mark"\n'
    h = simulate(folder, text)

    def seen(t):
        a, b = 0.3 + 2 * t, 1 - 3 * t
        dx, dy = 1 + 0.5 * math.cos(b) - 0.5 * math.cos(a), 0.5 * math.sin(b) - 0.5 * math.sin(a)
        return (dx * math.cos(a) + dy * math.sin(a), -dx * math.sin(a) + dy * math.cos(a))

    worst = dict.fromkeys(("position", "velocity", "rotation", "rate", "distance", "distance_rate", "far"), 0.0)
    step = 1e-6
    for k, t in enumerate(h["t"]):
        x, y = seen(t)
        ahead, behind = seen(t + step), seen(t - step)
        u, v = ((ahead[i] - behind[i]) / (2 * step) for i in range(2))
        a = 0.3 + 2 * t
        errors = {
            "position": math.hypot(h["position.x"][k] - x, h["position.y"][k] - y),
            "velocity": math.hypot(h["velocity.x"][k] - u, h["velocity.y"][k] - v),
            "rotation": abs(h["rotation.z"][k] - (0.7 - 5 * t)),
            "rate": abs(h["angular_velocity.z"][k] + 5),
            "distance": abs(h["distance"][k] - math.hypot(x, y)),
            "distance_rate": abs(h["distance_rate"][k] - (x * u + y * v) / math.hypot(x, y)),
            "far": abs(h["far"][k] - math.hypot(0.5 * math.cos(a), 0.5 * math.sin(a) - 2)),
        }
        worst = {key: max(worst[key], errors[key]) for key in worst}
    for key, error in worst.items():
        # Rates are compared with differences, which round at 1e-10.
        near(error, 0.0, 1e-8 if "velocity" in key or "_rate" in key else 1e-12, f"relative {key}")
    message = simulate(folder, text.replace('quantity = "position"', 'quantity = "acceleration"'), code=2)
    expect("'relative_to'" in message and "acceleration" in message, f"acceleration relative to a frame: {message}")


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    number_scenes(folder)
    rotations(folder)
    parts(folder)
    words_in_expressions(folder)
    shares_and_speeds(folder)
    two_ways(folder)
    meant_in_other_units(folder)
    four_bar(folder)
    places(folder)
    relative_outputs(folder)
finish()
