// Scene files: every word of the contract is read, everything wrong is answered with file, line, key and what is allowed.
#include "scratch.h"
#include "sim/base/words.h"
#include "sim/scene/scene_reader.h"

#include <gtest/gtest.h>

#include <fstream>

#include <unistd.h>

#include <fmt/format.h>

namespace flexframe::sim::test_scene {

namespace {

// Line numbers matter to the cases below: add at the end.
const std::string good = R"(title = "Elastic slider-crank"
[simulation]
duration = 1.6
output_rate = 500
gravity = [0, -9.81, 0]
tolerance = 1e-7
method = "bdf"

[[body]]
name = "crank"
kind = "beam"
length = 0.152
section = { shape = "circle", diameter = 0.01 }
material = { density = 2770.0, youngs_modulus = 1e9, poisson = 0.3 }
model = "finite-element"
elements = 3
boundary = "clamped-free"
effects = ["bending_xy", "axial"]
damping = { ratio = 0.02 }
frames = { middle = 0.5 }

[[body]]
name = "rod"
kind = "beam"
length = 0.3
section = { shape = "rectangle", width = 0.01, height = 0.02 }
material = { density = 2770.0, youngs_modulus = 1e9 }
model = "modal"
modes = { bending_xy = [1, 3], axial = [1] }
initial = { q = [0, 0, 0], qd = [0, 0, 1] }

[[body]]
name = "block"
kind = "rigid"
mass = 0.075552
inertia = [1e-5, 1e-5, 1e-5, 0, 0, 0]
centre_of_mass = [0, 0, 0.1]
frames = { pin = [0, 0, 0.2] }

[[joint]]
name = "shaft"
kind = "revolute"
parent = "ground"
child = "crank.root"
axis = [0, 0, 2]
position = [1, 2, 3]
rotation = [0, 0.1, 0]
initial = { value = 0.5, rate = 2 }
spring = { stiffness = 1e4, damping = 10, rest = 0.1 }
friction = { coefficient = 0.3, normal_force = 10.0 }
stop = { lower = -0.1, upper = 0.2, stiffness = 1e6, damping = 1e3 }

[[joint]]
name = "pin"
kind = "spherical"
parent = "crank.tip"
child = "rod.root"
initial = { rate = [0, 0, 2.5] }

[[joint]]
name = "slider"
kind = "point-on-line"
parent = "ground"
child = "block.pin"
friction = { coefficient = 0.3, normal_force = "reaction" }

[[joint]]
name = "lead"
kind = "screw"
parent = "ground"
child = "block"
pitch = 0.01
motion = "150*t"

[[force]]
kind = "torque"
on = "crank.root"
direction = [0, 0, 3]
value = "t <= 0.7 ? 0.01*(1 - exp(-t/0.167)) : 0"

[[force]]
name = "drag"
kind = "distributed"
on = "rod"
direction = [0, 1, 0]
frame = "body"
value = 12

[[force]]
kind = "spring-damper"
on = "crank.middle"
from = "rod.tip"
stiffness = 100
rest = 0.3

[[output]]
name = "tip"
of = "crank.node[3]"
quantity = "displacement"

[[output]]
name = "energy"
of = "system"
quantity = "energy"

[[output]]
name = "angle"
of = "shaft"
quantity = "value"

[render]
size = [1280, 720]
)";

Scene parse(const std::string& text) { return parse_scene(text, "scene.toml"); }

std::string message_of(const std::string& text) {
  try {
    parse(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "(no error)";
}

// `good` with its first `from` replaced.
std::string changed(const std::string& from, const std::string& to) {
  std::string text = good;
  const std::size_t at = text.find(from);
  if (at == std::string::npos) ADD_FAILURE() << "the scene has no " << from;
  else text.replace(at, from.size(), to);
  return text;
}

}  // namespace

TEST(Scene, EveryWordIsRead) {
  const Scene scene = parse(good);
  EXPECT_EQ(scene.title, "Elastic slider-crank");
  EXPECT_EQ(scene.text, good);
  EXPECT_EQ(scene.simulation.duration, 1.6);
  EXPECT_EQ(scene.simulation.output_rate, 500.0);
  EXPECT_EQ(scene.simulation.gravity, Vec3(0, -9.81, 0));
  EXPECT_EQ(scene.simulation.tolerance, 1e-7);
  EXPECT_FALSE(scene.simulation.accuracy);
  EXPECT_EQ(scene.simulation.method, Method::bdf);

  ASSERT_EQ(scene.bodies.size(), 3u);
  const auto& crank = std::get<BeamDef>(scene.bodies[0].kind);
  EXPECT_EQ(scene.bodies[0].name, "crank");
  EXPECT_EQ(scene.bodies[0].line, 9);
  EXPECT_EQ(crank.length, 0.152);
  EXPECT_NEAR(crank.section.iz, M_PI * 1e-8 / 64.0, 1e-20);
  EXPECT_EQ(crank.material.youngs_modulus, 1e9);
  EXPECT_EQ(crank.elements, 3);
  EXPECT_FALSE(crank.effects.automatic);
  EXPECT_EQ(crank.effects.names, (std::vector<std::string>{"bending_xy", "axial"}));
  EXPECT_EQ(crank.damping.ratio, std::vector<double>{0.02});
  EXPECT_EQ(crank.frames.at("middle"), 0.5);
  const auto& rod = std::get<BeamDef>(scene.bodies[1].kind);
  EXPECT_EQ(rod.model, BeamModel::modal);
  EXPECT_EQ(rod.modes.at("bending_xy"), (std::vector<int>{1, 3}));
  EXPECT_EQ(rod.material.poisson, 0.3);
  EXPECT_TRUE(rod.effects.automatic);
  EXPECT_EQ(rod.initial.qd, (std::vector<double>{0, 0, 1}));
  const auto& block = std::get<RigidDef>(scene.bodies[2].kind);
  EXPECT_EQ(block.mass, 0.075552);
  EXPECT_EQ(block.inertia, (Vec6() << 1e-5, 1e-5, 1e-5, 0, 0, 0).finished());
  EXPECT_EQ(block.frames.at("pin"), Vec3(0, 0, 0.2));

  ASSERT_EQ(scene.joints.size(), 4u);
  const JointDef& shaft = scene.joints[0];
  EXPECT_EQ(shaft.kind, JointKind::revolute);
  EXPECT_EQ(shaft.parent.body, "ground");
  EXPECT_EQ(shaft.child.body + ":" + shaft.child.frame, "crank:root");
  EXPECT_EQ(shaft.axis, Vec3(0, 0, 1));
  EXPECT_EQ(shaft.position, Vec3(1, 2, 3));
  EXPECT_EQ(shaft.rotation, Vec3(0, 0.1, 0));
  EXPECT_EQ(shaft.initial.value, std::vector<double>{0.5});
  EXPECT_EQ(shaft.spring->stiffness, 1e4);
  EXPECT_EQ(shaft.friction->normal_force, 10.0);
  EXPECT_EQ(shaft.stop->upper, 0.2);
  EXPECT_EQ(scene.joints[1].initial.rate, (std::vector<double>{0, 0, 2.5}));
  EXPECT_FALSE(scene.joints[1].initial.value);
  EXPECT_TRUE(scene.joints[2].friction->reaction);
  EXPECT_EQ(scene.joints[3].pitch, 0.01);
  EXPECT_EQ(scene.joints[3].motion, "150*t");

  ASSERT_EQ(scene.forces.size(), 3u);
  EXPECT_EQ(scene.forces[0].direction, Vec3(0, 0, 1));
  EXPECT_FALSE(scene.forces[0].follower);
  EXPECT_EQ(scene.forces[1].kind, ForceKind::distributed);
  EXPECT_TRUE(scene.forces[1].follower);
  EXPECT_EQ(scene.forces[1].value, "12");
  EXPECT_EQ(scene.forces[2].from.frame, "tip");
  EXPECT_EQ(scene.forces[2].spring.rest, 0.3);
  ASSERT_EQ(scene.outputs.size(), 3u);
  EXPECT_EQ(scene.outputs[0].of.frame, "node[3]");
  EXPECT_EQ(scene.outputs[0].quantity, Quantity::displacement);
  EXPECT_EQ(scene.outputs[2].quantity, Quantity::value);
}

TEST(Scene, Defaults) {
  const Scene scene = parse(R"(
[simulation]
duration = 1
[[body]]
name = "b"
kind = "beam"
length = 1
section = { shape = "circle", radius = 0.01 }
material = { density = 1, youngs_modulus = 1 }
)");
  EXPECT_EQ(scene.title, "scene");
  EXPECT_EQ(scene.simulation.output_rate, 1000.0);
  EXPECT_EQ(scene.simulation.gravity, Vec3::Zero());
  EXPECT_FALSE(scene.simulation.tolerance);
  EXPECT_FALSE(scene.simulation.max_steps);
  EXPECT_EQ(scene.simulation.method, Method::automatic);
  const auto& beam = std::get<BeamDef>(scene.bodies[0].kind);
  EXPECT_EQ(beam.model, BeamModel::finite_element);
  EXPECT_EQ(beam.boundary, Boundary::clamped_free);
  EXPECT_EQ(beam.elements, 10);
  EXPECT_TRUE(beam.effects.automatic);
}

TEST(Scene, WindowsFilesAndMarks) {
  std::string windows = "\xEF\xBB\xBF";
  for (const char c : good) windows += c == '\n' ? "\r\n" : std::string(1, c);
  EXPECT_EQ(parse(windows).joints.size(), 4u);
}

TEST(Scene, BushingFreeJointAndLists) {
  const Scene scene = parse(good + R"(
[[force]]
name = "mount"
kind = "bushing"
on = "block"
from = "crank.tip"
stiffness = [1, 2, 3, 4, 5, 6]
[[joint]]
name = "flight"
kind = "free"
parent = "ground"
child = "rod.tip"
initial = { value = [1, 2, 3, 0, 0, 0.5], rate = [0, 0, 2.5] }
[[body]]
name = "chain"
kind = "beam"
length = 1
section = { shape = "general", area = 1e-4, iy = 1e-9, iz = 2e-9, j = 1e-9 }
material = { density = 1, youngs_modulus = 1 }
model = "mixed"
volumes = 4
damping = { mass = 0.1, stiffness = 1e-4 }
color = [1, 0, 0.5]
drawing = { opacity = 0.5 }
)");
  EXPECT_EQ(scene.forces.back().bushing_stiffness[5], 6.0);
  EXPECT_EQ(scene.joints.back().initial.value->size(), 6u);
  EXPECT_EQ(scene.joints[4].initial.rate, (std::vector<double>{0, 0, 0, 0, 0, 2.5}));
  const auto& chain = std::get<BeamDef>(scene.bodies.back().kind);
  EXPECT_EQ(chain.volumes, 4);
  EXPECT_EQ(chain.elements, 2);
  EXPECT_EQ(chain.damping.stiffness, 1e-4);
  EXPECT_EQ(scene.bodies.back().drawing.at("color"), "[1, 0, 0.5]");
  EXPECT_EQ(scene.bodies.back().drawing.at("opacity"), "0.5");
}

struct WrongScene {
  std::string from, to;               // what is changed in the good scene
  std::vector<std::string> expected;  // fragments of the message
};

TEST(Scene, WrongScenesAreExplained) {
  const std::vector<WrongScene> cases = {
      // top level and [simulation]
      {"title =",
       "titel =",
       {"scene.toml:1: key 'titel' is unknown; did you mean 'title'? allowed: title, include, parameters, simulation, ground"}},
      {"title = \"Elastic", "title = 3 #", {"scene.toml:1: key 'title' must be a string, found the number 3"}},
      {"[simulation]", "[simulatoin]", {"scene.toml:2: key 'simulatoin' is unknown; did you mean 'simulation'?"}},
      {"[simulation]", "[[simulation]]", {"key 'simulation' must be a table {...}, found an array of 1 value"}},
      {"duration = 1.6",
       "duraton = 1.6",
       {"scene.toml:3: [simulation]: key 'duraton' is unknown; did you mean 'duration'? allowed: duration, output_rate"}},
      {"duration = 1.6", "", {"scene.toml:2: [simulation]: key 'duration' is missing"}},
      {"duration = 1.6",
       "duration = \"long\"",
       {"scene.toml:3: [simulation]: key 'duration' must be a number > 0, found the string 'long', which is none"}},
      {"duration = 1.6", "duration = -1", {"must be a number > 0, found the number -1"}},
      {"duration = 1.6", "duration = nan", {"key 'duration' must be finite, found the number nan"}},
      {"duration = 1.6", "duration = inf", {"key 'duration' must be finite"}},
      {"duration = 1.6", "duration = true", {"must be a number > 0, found the boolean true"}},
      {"duration = 1.6", "duration = 1e9", {"key 'output_rate' gives 5e+11 samples", "at most 1e+07"}},
      {"output_rate = 500", "output_rate = 0", {"scene.toml:4:", "must be a number > 0, found the number 0"}},
      {"gravity = [0, -9.81, 0]", "gravity = [0, -9.81]", {"scene.toml:5:", "key 'gravity' must have 3 numbers, found 2"}},
      {"gravity = [0, -9.81, 0]", "gravity = -9.81", {"key 'gravity' must be an array of 3 numbers, found the number -9.81"}},
      {"gravity = [0, -9.81, 0]",
       "gravity = [0, \"down\", 0]",
       {"key 'gravity' entry 2 must be a number, found the string 'down', which is none"}},
      {"tolerance = 1e-7", "tolerance = 1e-7\nmax_steps = 0", {"scene.toml:7:", "key 'max_steps' must be a number >= 1"}},
      {"tolerance = 1e-7", "tolerance = 1e-20", {"scene.toml:6:", "key 'tolerance' must be a number from 1e-13 to 0.1"}},
      {"tolerance = 1e-7", "tolerance = 1e-7\naccuracy = 1e-3", {"scene.toml:7:", "key 'accuracy' excludes 'tolerance'"}},
      {"method = \"bdf\"",
       "method = \"bfd\"",
       {"scene.toml:7:", "key 'method' is 'bfd', which is unknown; did you mean 'bdf'? allowed: auto, adams, bdf, erk, dirk, ida"}},
      {"method = \"bdf\"", "method = 3", {"key 'method' must be one of the words auto, adams", "found the number 3"}},
      // syntax
      {"duration = 1.6", "duration = 1.6 1.7", {"scene.toml:3: column 16: TOML syntax:"}},
      {"duration = 1.6", "duration = 1.6\nduration = 2", {"scene.toml:4: column", "TOML syntax", "duration"}},
      {"length = 0.152", "length = [", {"TOML syntax"}},
      {"\"Elastic", "\"Elastic\xff", {"scene.toml:1: column", "TOML syntax: Encountered invalid utf-8 sequence"}},
      {"duration = 1.6", "duration = 99999999999999999999999", {"scene.toml:3: column", "TOML syntax"}},
      {"length = 0.152",
       "length = 0.152\na.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r.s.t.u.v.w.x.y.z.a.b.c.d.e.f.g.h.i.j = 3",
       {"scene.toml:13: a key with more than 32 dots"}},
      // bodies
      {"[[body]]\nname = \"crank\"", "[body]\nname = \"crank\"", {"TOML syntax"}},
      {"name = \"crank\"", "", {"scene.toml:9: [[body]]: key 'name' is missing"}},
      {"name = \"crank\"", "nmae = \"crank\"", {"key 'name' is missing; is 'nmae' a misspelling of it?"}},
      {"name = \"crank\"", "name = \"\"", {"key 'name' is empty; a body needs a name"}},
      {"name = \"crank\"", "name = \"a.b\"", {"is no name for a body: 'a.b'; a name has no '.'"}},
      {"name = \"crank\"", "name = \"ground\"", {"scene.toml:10:", "must not be 'ground', which is a word of the scene file"}},
      {"name = \"crank\"", "name = \"system\"", {"must not be 'system'"}},
      {"name = \"rod\"", "name = \"crank\"", {"scene.toml:23: [[body]] 'crank': key 'name' is already the name of the body in line 9"}},
      {"kind = \"beam\"",
       "kind = \"baem\"",
       {"scene.toml:11: [[body]] 'crank': key 'kind' is 'baem', which is unknown; did you mean 'beam'? allowed: rigid, beam, modal, "
        "statespace"}},
      {"kind = \"beam\"", "", {"[[body]] 'crank': key 'kind' is missing"}},
      {"length = 0.152",
       "lenght = 0.152",
       {"scene.toml:12: [[body]] 'crank': key 'lenght' is unknown; did you mean 'length'? allowed: name, kind"}},
      {"length = 0.152", "length = 0", {"scene.toml:12:", "key 'length' must be a number > 0, found the number 0"}},
      {"length = 0.152", "", {"scene.toml:9: [[body]] 'crank': key 'length' is missing"}},
      {"length = 0.152", "length = 0.152\nmass = 3", {"key 'mass' is unknown"}},
      {"shape = \"circle\"",
       "shape = \"cirlce\"",
       {"scene.toml:13: [[body]] 'crank': key 'section.shape' is 'cirlce'", "did you mean 'circle'? allowed: circle, tube, rectangle"}},
      {"diameter = 0.01", "diamter = 0.01", {"key 'section.diamter' is unknown; did you mean 'diameter'?"}},
      {"diameter = 0.01", "diameter = -0.01", {"key 'section.diameter' must be a number > 0, found the number -0.01"}},
      {", diameter = 0.01", "", {"a section of shape 'circle' needs {diameter} or {radius}; found {none}"}},
      {"section = { shape = \"circle\", diameter = 0.01 }", "", {"[[body]] 'crank': key 'section' is missing"}},
      {"section = { shape = \"circle\", diameter = 0.01 }",
       "section = \"circle\"",
       {"key 'section' must be a table {...}, found the string 'circle'"}},
      {"shape = \"circle\", diameter = 0.01",
       "shape = \"tube\", diameter = 0.01, thickness = 0.006",
       {"key 'section' 'thickness' 0.006 is too large for the section: it must be smaller than 0.005"}},
      {"shape = \"circle\", diameter = 0.01",
       "shape = \"general\", area = 1, iy = 1, iz = 1, j = 3",
       {"'j' 3 is larger than the polar moment iy + iz = 2"}},
      {"shape = \"circle\", diameter = 0.01", "shape = \"circle\", diameter = 1e200", {"too large or too small"}},
      {"density = 2770.0", "density = -2770.0", {"scene.toml:14:", "key 'material.density' must be a number > 0, found the number -2770"}},
      {"density = 2770.0, ", "", {"key 'material.density' is missing"}},
      {"youngs_modulus = 1e9", "young_modulus = 1e9", {"key 'material.young_modulus' is unknown; did you mean 'youngs_modulus'?"}},
      {"poisson = 0.3", "poisson = 0.7", {"key 'material.poisson' must be a number in (-1, 0.5], found the number 0.7"}},
      {"poisson = 0.3", "poisson = -1", {"must be a number in (-1, 0.5]"}},
      {"model = \"finite-element\"",
       "model = \"finite-elements\"",
       {"scene.toml:15:", "did you mean 'finite-element'? allowed: finite-element, modal, mixed, lumped"}},
      {"elements = 3", "elements = 0", {"scene.toml:16:", "key 'elements' must be a whole number from 1 to 10000, found the number 0"}},
      {"elements = 3", "elements = 2.5", {"must be a whole number from 1 to 10000, found the number 2.5"}},
      {"elements = 3", "elements = 3\nvolumes = 2", {"key 'volumes' belongs to model 'mixed'; this one is 'finite-element'"}},
      {"boundary = \"clamped-free\"", "boundary = \"free-clamped\"", {"scene.toml:17:", "allowed: clamped-free, supported-supported"}},
      {"effects = [\"bending_xy\", \"axial\"]",
       "effects = [\"bending_yx\"]",
       {"scene.toml:18:", "names the effect 'bending_yx', which is unknown; did you mean 'bending_xy'?"}},
      {"effects = [\"bending_xy\", \"axial\"]", "effects = \"axial\"", {"must be \"auto\" or an array: write [\"axial\"]"}},
      {"effects = [\"bending_xy\", \"axial\"]", "effects = [\"axial\", \"axial\"]", {"names 'axial' twice"}},
      {"damping = { ratio = 0.02 }", "damping = { ratio = -0.02 }", {"scene.toml:19:", "key 'damping.ratio' must be a number >= 0"}},
      {"damping = { ratio = 0.02 }", "damping = { ratio = 0.02, mass = 1 }", {"key 'damping.ratio' excludes 'mass' and 'stiffness'"}},
      {"middle = 0.5",
       "middle = 1.5",
       {"scene.toml:20:", "key 'frames.middle' must be x/length, a number from 0 to 1, found the number 1.5"}},
      {"middle = 0.5", "tip = 0.5", {"key 'frames.tip' is a name of the beam's own"}},
      {"modes = { bending_xy = [1, 3], axial = [1] }", "", {"[[body]] 'rod': key 'modes' is missing"}},
      {"modes = { bending_xy = [1, 3], axial = [1] }", "modes = {}", {"key 'modes' is empty"}},
      {"bending_xy = [1, 3]", "bending_xy = []", {"key 'modes.bending_xy' is empty"}},
      {"bending_xy = [1, 3]", "bending_xy = [0, 3]", {"key 'modes.bending_xy' must hold whole numbers from 1 to 60, found the number 0"}},
      {"bending_xy = [1, 3]", "bending_xy = [3, 3]", {"names mode 3 twice"}},
      {"bending_xy = [1, 3]", "bending = [1, 3]", {"key 'modes.bending' is unknown", "allowed: axial, bending_xy, bending_xz, torsion"}},
      {"qd = [0, 0, 1]", "qd = [0, 1]", {"key 'initial.qd' must have as many numbers as 'q': 3, found 2"}},
      {"model = \"modal\"", "model = \"modal\"\nelements = 3", {"key 'elements' does not belong to model 'modal'"}},
      {"mass = 0.075552", "mass = -1", {"[[body]] 'block': key 'mass' must be a number >= 0, found the number -1"}},
      {"mass = 0.075552", "", {"[[body]] 'block': key 'mass' is missing"}},
      {"inertia = [1e-5, 1e-5, 1e-5, 0, 0, 0]",
       "inertia = [1, 1, 3]",
       {"key 'inertia' violates the triangle inequality", "3 exceeds the sum of the others, 1 + 1"}},
      {"inertia = [1e-5, 1e-5, 1e-5, 0, 0, 0]", "inertia = [1, 1, 1, 5, 0, 0]", {"key 'inertia' is not positive semidefinite"}},
      {"inertia = [1e-5, 1e-5, 1e-5, 0, 0, 0]", "inertia = [-1, 1, 1]", {"key 'inertia' is not positive semidefinite"}},
      {"inertia = [1e-5, 1e-5, 1e-5, 0, 0, 0]", "inertia = [1, 1, 1, 1]", {"key 'inertia' must have 3 numbers (xx yy zz) or 6"}},
      {"pin = [0, 0, 0.2]", "pin = 0.2", {"key 'frames.pin' must be an array of 3 numbers, found the number 0.2"}},
      {"kind = \"rigid\"", "kind = \"rigid\"\nmesh = \"nowhere.obj\"", {"key 'mesh' names the file 'nowhere.obj', which does not exist"}},
      {"kind = \"rigid\"\nmass = 0.075552\ninertia = [1e-5, 1e-5, 1e-5, 0, 0, 0]\ncentre_of_mass = [0, 0, 0.1]\nframes = { pin = [0, 0, "
       "0.2] }",
       "kind = \"modal\"\nfile = \"nowhere.sid\"",
       {"key 'file' names the file 'nowhere.sid', which does not exist"}},
      // joints
      {"kind = \"revolute\"",
       "kind = \"revolut\"",
       {"[[joint]] 'shaft': key 'kind' is 'revolut', which is unknown; did you mean 'revolute'? allowed: weld, revolute"}},
      {"child = \"crank.root\"",
       "child = \"crank.tpi\"",
       {"[[joint]] 'shaft': key 'child' names the frame 'tpi', which is no frame of 'crank'; did you mean 'tip'? it has root, tip, middle, "
        "node[0] ... node[3]"}},
      {"child = \"crank.root\"", "child = \"crank.node[4]\"", {"names the frame 'node[4]', which is no frame of 'crank'"}},
      {"child = \"crank.root\"",
       "child = \"cranc.root\"",
       {"names the body 'cranc', which does not exist; did you mean 'crank'? there are ground, crank, rod, block"}},
      {"child = \"crank.root\"", "child = \"ground\"", {"key 'child' must not be ground: exchange 'parent' and 'child'"}},
      {"child = \"crank.root\"", "child = \"crank.\"", {"a frame's name is missing after the dot"}},
      {"child = \"crank.root\"", "", {"[[joint]] 'shaft': key 'child' is missing"}},
      {"child = \"crank.root\"", "child = 3", {"key 'child' must be a string, found the number 3"}},
      {"parent = \"ground\"", "parent = \"ground.a\"", {"names the frame 'a' of ground, which does not exist"}},
      {"parent = \"ground\"", "parent = \"crank.tip\"", {"key 'child' is on the same body as the parent, 'crank'"}},
      {"child = \"rod.root\"", "child = \"rod.node[1]\"", {"a modal beam has no numbered nodes"}},
      {"child = \"block.pin\"", "child = \"block.pim\"", {"which is no frame of 'block'; did you mean 'pin'? it has pin"}},
      {"name = \"pin\"", "name = \"shaft\"", {"key 'name' is already the name of the joint in line"}},
      {"axis = [0, 0, 2]", "axis = [0, 0, 0]", {"[[joint]] 'shaft': key 'axis' must be a direction, not a zero vector"}},
      {"initial = { value = 0.5, rate = 2 }",
       "initial = { value = [0.5, 1], rate = 2 }",
       {"key 'initial.value' of a revolute joint must be one number, found an array of 2 values"}},
      {"initial = { rate = [0, 0, 2.5] }",
       "initial = { rate = 2.5 }",
       {"key 'initial.rate' of a spherical joint must be [rotation x, y, z], found the number 2.5"}},
      {"stiffness = 1e4, ", "stifness = 1e4, ", {"key 'spring.stifness' is unknown; did you mean 'stiffness'?"}},
      {"coefficient = 0.3", "coefficient = -0.3", {"key 'friction.coefficient' must be a number >= 0"}},
      {"normal_force = 10.0",
       "normal_force = \"raction\"",
       {"key 'friction.normal_force' must be a number >= 0 or \"reaction\", found the string 'raction'"}},
      {"lower = -0.1", "lower = 0.5", {"key 'stop.lower' must not exceed 'upper': 0.5 > 0.2"}},
      {"lower = -0.1, upper = 0.2, ", "", {"a stop needs 'lower', 'upper' or both"}},
      {"pitch = 0.01", "", {"[[joint]] 'lead': key 'pitch' is missing"}},
      {"pitch = 0.01", "pitch = 0", {"key 'pitch' must not be 0"}},
      {"kind = \"screw\"", "kind = \"prismatic\"", {"key 'pitch' belongs to joints of kind 'screw'; this one is 'prismatic'"}},
      {"kind = \"screw\"\nparent = \"ground\"\nchild = \"block\"\npitch = 0.01",
       "kind = \"weld\"\nparent = \"ground\"\nchild = \"block\"",
       {"[[joint]] 'lead': key 'motion' has no meaning for a weld joint, which has no coordinate"}},
      {"pitch = 0.01\nmotion = \"150*t\"",
       "pitch = 0.01\nmotion = \"150*x\"",
       {"key 'motion' is no expression of t: '150*x', column 5: 'x' is unknown", "allowed: t, pi, e"}},
      {"motion = \"150*t\"", "motion = true", {"key 'motion' must be a number or an expression of t, found the boolean true"}},
      {"motion = \"150*t\"", "motion = \"150*t\"\ninitial = { value = 1 }", {"key 'initial' excludes 'motion'"}},
      {"motion = \"150*t\"", "motion = { value = \"150*t\" }", {"key 'motion.value' does not belong here", "motion = \"2*t\""}},
      {"initial = { rate = [0, 0, 2.5] }", "motion = \"t\"", {"key 'motion' needs a joint with one coordinate"}},
      // forces
      {"kind = \"torque\"", "kind = \"toque\"", {"[[force]]: key 'kind' is 'toque', which is unknown; did you mean 'torque'?"}},
      {"on = \"crank.root\"", "on = \"ground\"", {"[[force]]: key 'on' must not be ground"}},
      {"direction = [0, 0, 3]", "direction = [0, 0, 0]", {"key 'direction' must be a direction, not a zero vector"}},
      {"direction = [0, 0, 3]", "", {"[[force]]: key 'direction' is missing"}},
      {"value = \"t <= 0.7", "value = \"t <== 0.7", {"key 'value' is no expression of t", "column"}},
      {"frame = \"body\"",
       "frame = \"bdoy\"",
       {"[[force]] 'drag': key 'frame' is 'bdoy', which is unknown; did you mean 'body'? allowed: world, body"}},
      {"on = \"rod\"", "on = \"block\"", {"must be a beam: 'block' is none"}},
      {"on = \"rod\"", "on = \"rod.tip\"", {"must be a beam's name alone"}},
      {"from = \"rod.tip\"", "from = \"crank.tip\"", {"is on the same body as 'on', 'crank'"}},
      {"stiffness = 100\n", "", {"key 'stiffness' is missing"}},
      {"rest = 0.3", "rest = -0.3", {"is a length and must be >= 0"}},
      // outputs
      {"of = \"crank.node[3]\"", "of = \"crank.nod[3]\"", {"[[output]] 'tip': key 'of' names the frame 'nod[3]'"}},
      {"quantity = \"displacement\"",
       "quantity = \"displacment\"",
       {"key 'quantity' is 'displacment', which is unknown; did you mean 'displacement'?"}},
      {"of = \"system\"",
       "of = \"crnk\"",
       {"must be \"system\" or a body's name for the quantity 'energy', found 'crnk'; did you mean 'crank'?"}},
      {"quantity = \"energy\"",
       "quantity = \"position\"",
       {"is \"system\", which has energy, kinetic, strain and potential, but no 'position'"}},
      {"of = \"shaft\"", "of = \"shatf\"", {"must be a joint for the quantity 'value', and 'shatf' is none; did you mean 'shaft'?"}},
      {"quantity = \"value\"", "quantity = \"position\"", {"is the joint 'shaft', which has value, rate and reaction, but no 'position'"}},
      {"of = \"shaft\"\nquantity = \"value\"",
       "of = \"block\"\nquantity = \"q\"",
       {"is the rigid body 'block', which has no elastic coordinates"}},
      {"of = \"shaft\"\nquantity = \"value\"",
       "of = \"slider\"\nquantity = \"value\"",
       {"is 'value', but a point-on-line joint has no coordinate"}},
      {"name = \"energy\"", "name = \"tip\"", {"key 'name' is already the name of the output in line"}},
      {"[render]", "[[render]]", {"key 'render' must be a table"}},
  };
  EXPECT_GE(cases.size(), 40u);
  for (const WrongScene& wrong : cases) {
    const std::string message = message_of(changed(wrong.from, wrong.to));
    EXPECT_TRUE(message.starts_with("scene.toml:")) << wrong.to << "\n" << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    for (const std::string& fragment : wrong.expected)
      EXPECT_NE(message.find(fragment), std::string::npos)
          << wrong.from << " -> " << wrong.to << "\n  found:    " << message << "\n  expected: " << fragment;
  }
}

TEST(Scene, NothingButTables) {
  EXPECT_NE(message_of("").find("scene.toml:1: key 'simulation' is missing"), std::string::npos) << message_of("");
  EXPECT_NE(message_of("[simulation]\nduration = 1\n").find("key 'body' is missing"), std::string::npos);
  EXPECT_NE(message_of("body = 3\n[simulation]\nduration = 1\n").find("key 'body' must be an array of tables [[body]], found the number 3"),
            std::string::npos);
  EXPECT_NE(message_of("[body]\nname = \"a\"\n[simulation]\nduration = 1\n").find("write [[body]], not [body]"), std::string::npos);
  EXPECT_NE(message_of(std::string("a\0b", 3)).find("is a binary file"), std::string::npos);
  EXPECT_NE(message_of("a = " + std::string(100000, '[')).find("TOML syntax"), std::string::npos);
  EXPECT_NE(message_of("a = " + std::string(100000, '{')).find("TOML syntax"), std::string::npos);
  std::string deep = "[a";
  for (int i = 0; i < 100000; ++i) deep += ".a";
  EXPECT_NE(message_of(deep + "]").find("more than 32 dots"), std::string::npos);
  // nested inline tables with dotted keys multiply
  std::string nested, keys = "a";
  for (int i = 0; i < 31; ++i) keys += ".a";
  for (int i = 0; i < 300; ++i) nested += "{" + keys + "=";
  EXPECT_NE(message_of("a = " + nested + "1" + std::string(300, '}')).find("TOML syntax"), std::string::npos);
}

TEST(SceneFile, WrongFiles) {
  const flexframe::Scratch folder;
  const auto message = [](const std::filesystem::path& path) -> std::string {
    try {
      read_scene(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "(no error)";
  };
  EXPECT_NE(message(folder.path() / "none.toml").find("none.toml: no such file"), std::string::npos);
  EXPECT_NE(message(folder.path()).find("is a directory"), std::string::npos);
  EXPECT_NE(message(folder.put("empty.toml", "")).find("empty.toml: is empty"), std::string::npos);
  EXPECT_NE(message(folder.put("binary.toml", std::string("\x7f"
                                                          "ELF\0\0\1",
                                                          7)))
                .find("is a binary file"),
            std::string::npos);
  EXPECT_NE(message(folder.put("huge.toml", std::string(9u << 20, '#'))).find("is larger than 8 MiB"), std::string::npos);
  EXPECT_NE(message(folder.put("matrix.toml",
                               good + "[[body]]\nname = \"s\"\nkind = \"statespace\"\nframes = { p = [0,0,0] }\nomega = [[1, 2], [3]]\n"))
                .find("must have rows of equal length: row 1 has 2, row 2 has 1"),
            std::string::npos);
}

TEST(SceneFile, NamesStartAtTheScene) {
  const flexframe::Scratch folder;
  std::filesystem::create_directories(folder.path() / "meshes");
  folder.put("meshes/rod.obj", "v 0 0 0\n");
  folder.put("rod.sid", "part\n");
  const Scene scene = read_scene(folder.put("scene.toml", R"([simulation]
duration = 1
[[body]]
name = "rod"
kind = "modal"
file = "rod.sid"
mesh = "meshes/../meshes/rod.obj"
[[joint]]
name = "j"
kind = "revolute"
parent = "ground"
child = "rod.node[17]"
)"));
  EXPECT_EQ(*scene.bodies[0].mesh, folder.path() / "meshes/rod.obj");
  EXPECT_EQ(std::get<ModalDef>(scene.bodies[0].kind).file, folder.path() / "rod.sid");
  EXPECT_EQ(scene.joints[0].child.frame, "node[17]");
}

TEST(SceneFile, StateSpace) {
  const flexframe::Scratch folder;
  folder.put("plant.toml", "omega = [[100, 0], [0, 400]]\ngamma = [[1, 0], [0, 2]]\nsigma = [[0, 1, 0], [0, 2, 0]]\n");
  const std::string start =
      "[simulation]\nduration = 1\n[[body]]\nname = \"s\"\nkind = \"statespace\"\nframes = { tip = [1, 0, 0] }\nmass = 2\n";
  const Scene scene = read_scene(folder.put("scene.toml", start + "file = \"plant.toml\"\n"));
  const auto& plant = std::get<StateSpaceDef>(scene.bodies[0].kind);
  EXPECT_EQ(plant.omega(1, 1), 400.0);
  EXPECT_EQ(plant.theta(1, 1), 2.0);  // the transpose of sigma
  EXPECT_EQ(plant.ports, std::vector<std::string>{"tip"});
  EXPECT_EQ(plant.rigid.mass, 2.0);
  const auto message = [&](const std::string& rest) { return message_of(start + rest); };
  EXPECT_NE(message("omega = [[1, 2]]").find("key 'omega' must be square, found 1 x 2"), std::string::npos);
  EXPECT_NE(message("omega = [[1]]\nsigma = [[1, 2]]").find("'sigma' must have 3 or 6 columns"), std::string::npos);
  EXPECT_NE(message("omega = [[1]]\ngamma = [[1, 2]]\nsigma = [[1, 2, 3]]").find("key 'gamma' must be 1 x 1 like 'omega'"),
            std::string::npos);
  EXPECT_NE(message("omega = [[1]]\nsigma = [[1, 2, 3]]\nports = [\"top\"]").find("names 'top', which is no frame of the body; it has tip"),
            std::string::npos);
}

TEST(Words, Distance) {
  EXPECT_EQ(word_distance("lenght", "length"), 1);
  EXPECT_EQ(word_distance("", "abc"), 3);
  EXPECT_EQ(word_distance("abc", "abc"), 0);
  EXPECT_EQ(word_distance("Length", "length"), 0);
  EXPECT_EQ(word_distance("kitten", "sitting"), 3);
  const std::vector<std::string> known{"length", "width", "height"};
  EXPECT_EQ(nearest_word("widht", known), "width");
  EXPECT_EQ(nearest_word("colour", known), "");
  EXPECT_EQ(nearest_word(std::string(100000, 'a'), known), "");
  EXPECT_EQ(did_you_mean("Fixed", std::vector<std::string>{"revolute", "weld"}), "; did you mean 'weld'?");
  EXPECT_EQ(did_you_mean("fixed", known), "");
  EXPECT_EQ(quote("a\nb\xff\xC3\xBC"), "'a\\x0ab\\xff\xC3\xBC'");
  EXPECT_LT(quote(std::string(1000, 'a')).size(), 80u);
  EXPECT_EQ(how_many(1, "modes"), "1 mode");
  EXPECT_EQ(how_many(0, "modes"), "0 modes");
  EXPECT_EQ(how_many(12, "elements"), "12 elements");
}

}  // namespace flexframe::sim::test_scene
