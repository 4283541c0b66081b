// The results file: what is written reads back to the same bits, strangers can read it, damage is found and never followed.
#include "scratch.h"
#include "sim/base/file_output.h"
#include "sim/results/csv.h"
#include "sim/results/driven_coordinates.h"
#include "sim/results/results_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

namespace flexframe::sim::test_results {

namespace {

const std::filesystem::path& scratch() {
  static const flexframe::Scratch folder;
  return folder.path();
}

// Every field filled, numbers without pattern.
Results sample_results(Eigen::Index nt = 37) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto fill = [&](Eigen::Index rows, Eigen::Index cols) {
    return MatX(MatX::NullaryExpr(rows, cols, [&] { return normal(random); }));
  };
  Results r;
  r.title =
      "Rods \xC3\xBC"
      "ber all";
  r.scene_file = "rods.toml";
  r.scene_text = "title = \"x\"\n# \xE2\x82\xAC\n";
  r.times = VecX::LinSpaced(nt, 0.0, 1.6);
  for (int b = 0; b < 3; ++b) {
    ResultBody body;
    body.name = std::vector<std::string>{"rod", "crank arm", "block"}[static_cast<std::size_t>(b)];  // not in the order of names
    body.kind = b == 2 ? "rigid" : "beam";
    body.position = fill(nt, 3);
    body.orientation = fill(nt, 4).rowwise().normalized();
    if (b < 2) {
      body.length = 0.3;
      body.section.shape = "tube";
      body.section.size = {{"outer_diameter", 0.01}, {"thickness", 0.001}};
      body.section.area = 2e-5;
      body.section.iy = 1e-10;
      body.section.outline = {{{0, 0}, {1, 0}, {0, 1}}, {{0.1, 0.1}, {0.2, 0.1}, {0.1, 0.2}, {0.1, 0.15}}};
      const Eigen::Index nn = 4 + b, n = 5;
      for (Eigen::Index i = 0; i < nn; ++i) body.nodes.push_back({fmt::format("node[{}]", i), fill(3, 1)});
      body.displacement = fill(nt, 3 * nn);
      body.rotation = fill(nt, 3 * nn);
      body.q = fill(nt, n);
      body.qd = fill(nt, n);
      body.node_phi = fill(3 * nn, n);
      body.node_psi = fill(3 * nn, n);
      body.stress_nodes = {0, 2};
      body.node_stress = fill(12, n);
      body.labels = {"a", "element 3 v", "", "c", "d"};
      body.held_position = fill(nt, 3);
      body.held_rotation = fill(nt, 3);
      body.shown_columns = fill(6, n);
      body.strain_stations = VecX::LinSpaced(3, 0.0, 0.3);
      body.section_strain.resize(3, 3);
      body.section_strain << 0, 0, 1.5, 7, 4, -2.5, 11, 3, 1e-3;
      body.unstrained = {"axial"};
    }
    r.bodies.push_back(body);
  }
  ResultJoint joint{"shaft", "revolute", fill(nt, 3), fill(nt, 4).rowwise().normalized(), fill(nt, 1), fill(nt, 1)};
  r.joints = {joint};
  r.outputs = {{"slider.x", "m", fill(nt, 1)}, {"a, b", "rad/s", fill(nt, 1)}};
  r.kinetic = fill(nt, 1);
  r.strain = fill(nt, 1);
  r.potential = fill(nt, 1);
  r.supplied = fill(nt, 1);
  r.dissipated = fill(nt, 1);
  r.statistics = {"adams", 1e-6, 123456789012L, 2, 3, 4, 5, 0.25, 0.0, 1e-5, "slider.x", {}, {}};
  r.statistics.notes.tell("", "first note");
  r.statistics.notes.warn("", "second");
  return r;
}

void expect_same(const Results& a, const Results& b) {
  EXPECT_EQ(a.title, b.title);
  EXPECT_EQ(a.scene_file, b.scene_file);
  EXPECT_EQ(a.scene_text, b.scene_text);
  EXPECT_EQ(a.times, b.times);
  ASSERT_EQ(a.bodies.size(), b.bodies.size());
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    const ResultBody &x = a.bodies[i], &y = b.bodies[i];
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.kind, y.kind);
    EXPECT_EQ(x.length, y.length);
    EXPECT_EQ(x.mesh, y.mesh);
    EXPECT_EQ(x.section.shape, y.section.shape);
    EXPECT_EQ(x.section.size, y.section.size);
    EXPECT_EQ(x.section.area, y.section.area);
    EXPECT_EQ(x.section.iy, y.section.iy);
    EXPECT_EQ(x.section.outline, y.section.outline);
    EXPECT_EQ(x.position, y.position);
    EXPECT_EQ(x.orientation, y.orientation);
    ASSERT_EQ(x.nodes.size(), y.nodes.size());
    for (std::size_t k = 0; k < x.nodes.size(); ++k) {
      EXPECT_EQ(x.nodes[k].name, y.nodes[k].name);
      EXPECT_EQ(x.nodes[k].origin, y.nodes[k].origin);
    }
    EXPECT_TRUE(x.displacement.reshaped() == y.displacement.reshaped());
    EXPECT_TRUE(x.rotation.reshaped() == y.rotation.reshaped());
    EXPECT_TRUE(x.q.reshaped() == y.q.reshaped());
    EXPECT_TRUE(x.qd.reshaped() == y.qd.reshaped());
    EXPECT_TRUE(x.node_phi.reshaped() == y.node_phi.reshaped());
    EXPECT_TRUE(x.node_psi.reshaped() == y.node_psi.reshaped());
    EXPECT_EQ(x.stress_nodes, y.stress_nodes);
    EXPECT_TRUE(x.node_stress.reshaped() == y.node_stress.reshaped());
    EXPECT_EQ(x.labels, y.labels);
    EXPECT_TRUE(x.held_position.reshaped() == y.held_position.reshaped());
    EXPECT_TRUE(x.held_rotation.reshaped() == y.held_rotation.reshaped());
    EXPECT_TRUE(x.shown_columns.reshaped() == y.shown_columns.reshaped());
    EXPECT_TRUE(x.strain_stations.reshaped() == y.strain_stations.reshaped());
    EXPECT_TRUE(x.section_strain.reshaped() == y.section_strain.reshaped());
    EXPECT_EQ(x.unstrained, y.unstrained);
  }
  ASSERT_EQ(a.joints.size(), b.joints.size());
  for (std::size_t i = 0; i < a.joints.size(); ++i) {
    EXPECT_EQ(a.joints[i].name, b.joints[i].name);
    EXPECT_EQ(a.joints[i].kind, b.joints[i].kind);
    EXPECT_EQ(a.joints[i].position, b.joints[i].position);
    EXPECT_EQ(a.joints[i].orientation, b.joints[i].orientation);
    EXPECT_EQ(a.joints[i].value, b.joints[i].value);
    EXPECT_EQ(a.joints[i].rate, b.joints[i].rate);
  }
  ASSERT_EQ(a.outputs.size(), b.outputs.size());
  for (std::size_t i = 0; i < a.outputs.size(); ++i) {
    EXPECT_EQ(a.outputs[i].column, b.outputs[i].column);
    EXPECT_EQ(a.outputs[i].unit, b.outputs[i].unit);
    EXPECT_EQ(a.outputs[i].values, b.outputs[i].values);
  }
  EXPECT_EQ(a.kinetic, b.kinetic);
  EXPECT_EQ(a.dissipated, b.dissipated);
  EXPECT_EQ(a.statistics.method, b.statistics.method);
  EXPECT_EQ(a.statistics.steps, b.statistics.steps);
  EXPECT_EQ(a.statistics.restarts, b.statistics.restarts);
  EXPECT_EQ(a.statistics.error_estimate, b.statistics.error_estimate);
  EXPECT_EQ(a.statistics.notes.texts(Severity::note), b.statistics.notes.texts(Severity::note));
  EXPECT_EQ(a.statistics.notes.texts(Severity::warning), b.statistics.notes.texts(Severity::warning));
}

std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

void put_bytes(const std::filesystem::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

std::string message_of(const std::filesystem::path& path) {
  try {
    read_results(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "(no error)";
}

int python(const std::string& code) {
  const auto script = scratch() / "script.py";
  put_bytes(script, code);
  return std::system(fmt::format("/usr/bin/python3 {}", script.string()).c_str());
}

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace

TEST(ResultsFile, ReadsBackTheSameBits) {
  const Results r = sample_results();
  write_results(r, scratch() / "a.h5");
  expect_same(r, read_results(scratch() / "a.h5"));
}

TEST(ResultsFile, LongSeriesCrossChunks) {
  const Results r = sample_results(20000);
  write_results(r, scratch() / "long.h5");
  expect_same(r, read_results(scratch() / "long.h5"));
}

TEST(ResultsFile, SmallestResults) {
  Results r;
  r.times = VecX::Zero(1);
  write_results(r, scratch() / "small.h5");
  expect_same(r, read_results(scratch() / "small.h5"));
}

TEST(ResultsFile, PythonReadsIt) {
  const Results r = sample_results();
  write_results(r, scratch() / "py.h5");
  EXPECT_EQ(python(fmt::format(R"(
import h5py
f = h5py.File(r'{}', 'r')
text = lambda x: x.decode() if isinstance(x, bytes) else x
assert text(f.attrs['format']) == 'flexframe results' and f.attrs['format_version'] == 1
assert text(f.attrs['title']) == 'Rods \u00fcber all'
assert f['times'].shape == (37,) and text(f['times'].attrs['unit']) == 's'
assert sorted(f['bodies'], key=lambda b: f['bodies'][b].attrs['index']) == ['rod', 'crank arm', 'block']
rod = f['bodies/rod']
assert rod['displacement'].shape == (37, 4, 3) and rod['node_phi'].shape == (4, 3, 5)
assert rod['displacement'][3, 2, 1] == {:.17g} and rod['node_phi'][2, 1, 4] == {:.17g}
assert [text(x) for x in rod['node_names']][3] == 'node[3]'
assert text(f['scene'][0]) == 'title = "x"\n# \u20ac\n'
assert [text(x) for x in f['outputs/columns']] == ['slider.x', 'a, b'] and f['outputs/values'].shape == (37, 2)
)",
                               (scratch() / "py.h5").string(), r.bodies[0].displacement(3, 7), r.bodies[0].node_phi(7, 4))),
            0);
}

// The least another simulator has to write, in h5py's own types (fixed strings, single precision, contiguous, deflated).
TEST(ResultsFile, WrittenByAStranger) {
  const auto path = scratch() / "stranger.h5";
  ASSERT_EQ(python(fmt::format(R"(
import h5py, numpy as np
f = h5py.File(r'{}', 'w', libver='v110')
f.attrs['format'] = np.bytes_('flexframe results')
f.attrs['format_version'] = 1
f['times'] = np.arange(5) * 0.5
g = f.create_group('bodies/rod')
g.attrs['kind'] = np.bytes_('beam')
g.attrs['mesh'] = np.bytes_('meshes/rod.obj')
g['position'] = np.zeros((5, 3), 'f4')
g['orientation'] = np.tile(np.array([0.6, 0.8, 0, 0], 'f4'), (5, 1))
g['node_origin'] = np.array([[0, 0, 0], [1, 0, 0]])
g.create_dataset('displacement', data=np.arange(30.0).reshape(5, 2, 3), compression='gzip', chunks=(2, 2, 3))
f['outputs/columns'] = np.array([b'a', b'b.x'])
f['outputs/values'] = np.ones((5, 2), 'i4')
)",
                               path.string())),
            0);
  const Results r = read_results(path);
  ASSERT_EQ(r.bodies.size(), 1u);
  EXPECT_EQ(r.bodies[0].kind, "beam");
  EXPECT_EQ(r.bodies[0].mesh, scratch() / "meshes/rod.obj");
  EXPECT_EQ(r.bodies[0].displacement(4, 5), 29.0);
  EXPECT_EQ(r.bodies[0].nodes[1].origin, Vec3(1, 0, 0));
  EXPECT_EQ(r.outputs[1].column, "b.x");
  EXPECT_EQ(r.times[4], 2.0);
}

TEST(ResultsFile, WrongContentIsNamed) {
  const std::pair<const char*, const char*> cases[] = {
      {"del f['times']", "dataset '/times': is missing"},
      {"f['times'][2] = 0", "dataset '/times': must increase, but value 2 is 0 after 0.5"},
      {"f['times'][2] = np.nan", "dataset '/times': holds a value that is not finite in row 2"},
      {"f.attrs['format'] = np.bytes_('other')", "no results file"},
      {"f.attrs['format_version'] = 7", "format version 7; this program reads version 1"},
      {"del f['bodies']", "group '/bodies': is missing"},
      {"del g['position']", "dataset '/bodies/rod/position': is missing"},
      {"del g['position']; g['position'] = np.zeros((4, 3))", "must be 5 x 3, found 4 x 3"},
      {"del g['position']; g['position'] = np.array([b'a'] * 5)", "dataset '/bodies/rod/position': must hold numbers"},
      {"del g['position']; g.create_group('position')", "dataset '/bodies/rod/position': is no dataset"},
      {"g['position'][1, 1] = np.inf", "dataset '/bodies/rod/position': holds a value that is not finite in row 1"},
      {"g['orientation'][3, 0] = 2", "row 3 is no unit quaternion, its norm is 2"},
      {"g['node_origin'] = np.zeros((2, 3))", "dataset '/bodies/rod/displacement': is missing"},
      {"g['node_origin'] = np.zeros((2, 3)); g['displacement'] = np.zeros((5, 6))", "must be 5 x 2 x 3, found 5 x 6"},
      {"g['node_origin'] = np.zeros((2, 3)); g['displacement'] = np.zeros((5, 2, 3)); g['node_names'] = np.array([b'a'])",
       "must name 2 nodes"},
      {"g['q'] = np.zeros((5, 2)); g['qd'] = np.zeros((5, 3))", "dataset '/bodies/rod/qd': must be 5 x 2, found 5 x 3"},
      {"del f['times']; f.create_dataset('times', (10**12,), 'f8', chunks=(1000,))", "claims 1e+12 values but holds 0 bytes"},
      {"f['outputs/columns'] = np.array([b'a']); f['outputs/values'] = np.zeros((5, 2))",
       "dataset '/outputs/values': must be 5 x 1, found 5 x 2"},
      {"f['joints/pin/position'] = np.zeros((5, 3))", "dataset '/joints/pin/orientation': is missing"},
      {"f['bodies/x'] = 3.0", "group '/bodies/x': is no group"},
      {"f['scene'] = np.array([b'a', b'b'])", "dataset '/scene': must be one string"},
      {"f['scene'] = np.array([b'a']); f.attrs['scene_sha256'] = np.bytes_('ab')", "does not agree with its checksum"},
      {"g.attrs['length'] = [1.0, 2.0]", "attribute 'length' of '/bodies/rod/': must be one number"},
      {"g.attrs['kind'] = 3", "attribute 'kind' of '/bodies/rod/': must be text"},
      {"f['bodies/loop'] = h5py.SoftLink('/nowhere')", "group '/bodies/loop': is missing"},
      {"f['bodies/loop'] = h5py.SoftLink('/bodies/rod')", "group '/bodies/loop': is missing"},
      {"f['bodies/far'] = h5py.ExternalLink('wrong0.h5', '/bodies/rod')", "group '/bodies/far': is missing"},
      {"del g['position']; g.create_dataset('position', (5, 3), 'f8', external=[('wrong0.h5', 0, 120)])", "lies in another file"},
      {"del g['position']; g.create_dataset('position', data=np.zeros((5, 3)), scaleoffset=3)", "packed by HDF5's filter 6"},
      {"g.attrs['kind'] = 'beam'", "holds data of variable length"},
      {"f['scene'] = ['a']", "holds data of variable length"},
      {"v = h5py.VirtualLayout((5, 3), 'f8'); v[:] = h5py.VirtualSource('wrong0.h5', 'x', (5, 3)); del g['position']; "
       "g.create_virtual_dataset('position', v)",
       "holds data of variable length"},
      {"h5py.h5a.create(g.id, b'kind', h5py.h5t.py_create(h5py.string_dtype(), logical=True), h5py.h5s.create(h5py.h5s.SCALAR))",
       "text of fixed length"},
      {"g.create_dataset('q', data=np.zeros((5, 2), 'f2')); g['qd'] = np.zeros((5, 2))", "dataset '/bodies/rod/q': must hold numbers"},
      {"f.close(); f = h5py.File(f'{folder}/wrong%d.h5' % number, 'w', libver=('v108', 'v110'))", "one of HDF5's older formats"},
  };
  // one Python for all files
  std::string code = fmt::format(R"(
import h5py, numpy as np
folder = r'{0}'
def begin(number):
    f = h5py.File(r'{0}/wrong%d.h5' % number, 'w', libver='v110')
    f.attrs['format'] = np.bytes_('flexframe results')
    f.attrs['format_version'] = 1
    f['times'] = np.arange(5) * 0.5
    g = f.create_group('bodies/rod')
    g['position'] = np.zeros((5, 3))
    g['orientation'] = np.tile([1.0, 0, 0, 0], (5, 1))
    return f, g
)",
                                 scratch().string());
  for (std::size_t i = 0; i < std::size(cases); ++i)
    code += fmt::format("number = {}; f, g = begin(number); {}; f.close()\n", i, cases[i].first);
  ASSERT_EQ(python(code), 0);
  for (std::size_t i = 0; i < std::size(cases); ++i) {
    const std::string name = fmt::format("wrong{}.h5", i), message = message_of(scratch() / name);
    EXPECT_NE(message.find(cases[i].second), std::string::npos) << cases[i].first << "\n" << message;
    EXPECT_NE(message.find(name), std::string::npos) << message;
  }
}

TEST(ResultsFile, ForeignFiles) {
  put_bytes(scratch() / "text.h5", "t,x\n0,1\n");
  put_bytes(scratch() / "empty.h5", "");
  put_bytes(scratch() / "magic.h5", "\x89HDF\r\n\x1a\n");
  EXPECT_NE(message_of(scratch() / "none.h5").find("no such file"), std::string::npos);
  EXPECT_NE(message_of(scratch()).find("is a directory"), std::string::npos);
  EXPECT_NE(message_of(scratch() / "text.h5").find("is no HDF5 file"), std::string::npos);
  EXPECT_NE(message_of(scratch() / "empty.h5").find("is no HDF5 file"), std::string::npos);
  EXPECT_NE(message_of(scratch() / "magic.h5").find("magic.h5"), std::string::npos);
}

TEST(ResultsFile, CutShortAtAnyLength) {
  write_results(sample_results(), scratch() / "whole.h5");
  const std::string bytes = file_bytes(scratch() / "whole.h5");
  for (std::size_t length = 0; length < bytes.size(); length += 1 + bytes.size() / 150) {
    put_bytes(scratch() / "cut.h5", bytes.substr(0, length));
    EXPECT_THROW(read_results(scratch() / "cut.h5"), InputError) << length;
  }
}

// A flipped bit is found by a checksum, or lies where nothing is read.
TEST(ResultsFile, FlippedBitsAreFoundOrHarmless) {
  const Results r = sample_results();
  write_results(r, scratch() / "whole.h5");
  const std::string bytes = file_bytes(scratch() / "whole.h5");
  std::mt19937 random(3);
  int found = 0;
  for (int i = 0; i < 600; ++i) {
    std::string damaged = bytes;
    damaged[random() % damaged.size()] ^= static_cast<char>(1 << random() % 8);
    put_bytes(scratch() / "damaged.h5", damaged);
    try {
      const Results read = read_results(scratch() / "damaged.h5");
      ASSERT_EQ(read.bodies.size(), r.bodies.size());
      EXPECT_EQ(read.times, r.times);
      EXPECT_TRUE(read.bodies[0].displacement.reshaped() == r.bodies[0].displacement.reshaped());
      EXPECT_TRUE(read.bodies[1].node_phi.reshaped() == r.bodies[1].node_phi.reshaped());
      EXPECT_EQ(read.scene_text, r.scene_text);
    } catch (const InputError&) {
      ++found;
    }
  }
  EXPECT_GT(found, 60);
}

TEST(ResultsFile, RefusesWhatMustNotBeWritten) {
  const auto refused = [](auto&& spoil) {
    Results r = sample_results();
    spoil(r);
    EXPECT_THROW(write_results(r, scratch() / "refused.h5"), SimulationError);
    EXPECT_FALSE(std::filesystem::exists(scratch() / "refused.h5"));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused([&](Results& r) { r.bodies[1].displacement(3, 3) = nan; });
  refused([&](Results& r) { r.outputs[0].values[1] = nan; });
  refused([&](Results& r) { r.times.resize(0); });
  refused([&](Results& r) { r.bodies[0].displacement.resize(37, 3); });
  refused([&](Results& r) { r.bodies[0].name = "a/b"; });
  refused([&](Results& r) { r.kinetic.resize(3); });
}

TEST(ResultsFile, UnwritablePlaces) {
  const Results r = sample_results();
  const auto message = [&](const std::filesystem::path& path) -> std::string {
    try {
      write_results(r, path);
    } catch (const InputError&) {
      return "an input error";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "(no error)";
  };
  EXPECT_NE(message(scratch() / "no/such/x.h5").find("does not exist"), std::string::npos);
  EXPECT_NE(message(scratch()).find("is a directory"), std::string::npos);
  EXPECT_NE(message("/proc/x.h5").find("cannot be written"), std::string::npos);
}

// A child with a limit on the size of its files sees every write beyond it fail, like on a full disk.
TEST(ResultsFile, FullDiskLeavesNothing) {
  const auto folder = scratch() / "full";
  std::filesystem::create_directories(folder);
  const Results r = sample_results(20000);
  for (const rlim_t bytes : {0, 2048, 20480, 204800}) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    std::fflush(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
      // everything that HDF5 says goes into the pipe too
      ::dup2(ends[1], STDOUT_FILENO);
      ::dup2(ends[1], STDERR_FILENO);
      std::signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{bytes, bytes};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      for (const bool csv : {false, true}) {
        try {
          if (csv) write_histories_csv(r, folder / "x.csv");
          else write_results(r, folder / "x.h5");
          std::printf("written\n");
        } catch (const std::runtime_error& error) {
          std::printf("refused: %s\n", error.what());
        }
      }
      std::exit(0);
    }
    ::close(ends[1]);
    std::string output;
    char block[4096];
    for (ssize_t n = 0; (n = ::read(ends[0], block, sizeof block)) > 0;) output.append(block, static_cast<std::size_t>(n));
    ::close(ends[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << output;
    const std::string reason = "cannot be written: File too large\n";
    EXPECT_EQ(output, fmt::format("refused: {0}/x.h5: {1}refused: {0}/x.csv: {1}", folder.string(), reason));
    EXPECT_EQ(files_in(folder), 0u) << bytes;
  }
}

TEST(ResultsFile, ReplacesAnOlderFileWhole) {
  const auto folder = scratch() / "replace";
  std::filesystem::create_directories(folder);
  write_results(sample_results(100), folder / "x.h5");
  write_results(sample_results(10), folder / "x.h5");
  EXPECT_EQ(read_results(folder / "x.h5").times.size(), 10);
  EXPECT_EQ(files_in(folder), 1u);
}

// A link laid under the name of the file in the making would lead the writing out of the folder.
TEST(ResultsFile, PlantedLinksAreNotFollowed) {
  const flexframe::Scratch folder;
  const std::filesystem::path victim = folder.put("victim", "kept"), path = folder.path() / "results.h5";
  char host[256] = {};
  ::gethostname(host, sizeof host - 1);
  std::filesystem::create_symlink(victim, folder.path() / fmt::format(".results.h5.part-{}-{}", host, ::getpid()));
  std::filesystem::create_symlink(victim, path);
  write_results(sample_results(3), path);
  EXPECT_TRUE(std::filesystem::is_regular_file(std::filesystem::symlink_status(path)));
  std::ifstream in(victim);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "kept");
  EXPECT_EQ(read_results(path).times.size(), 3);
}

TEST(HistoriesCsv, ShortestNumbersThatReadBack) {
  Results r;
  r.times = Eigen::Vector3d(0.0, 0.1, 1.0 / 3.0);
  r.outputs = {{"slider.x", "m", Eigen::Vector3d(-0.0, 1e-300, 6.02214076e23)},
               {"a, \"b\"", "", Eigen::Vector3d(1.0, 2.0, 0.30000000000000004)}};
  EXPECT_EQ(histories_csv(r), "t,slider.x,\"a, \"\"b\"\"\"\n0,-0,1\n0.1,1e-300,2\n0.3333333333333333,6.02214076e+23,0.30000000000000004\n");
  r.outputs[0].values[1] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(histories_csv(r), SimulationError);
}

TEST(Sha256, KnownDigests) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

// A crank that follows a motion has no coordinates in the results: the closed formula of its motion.
TEST(DrivenCoordinates, AreThoseOfTheMotion) {
  Results r;
  r.scene_file = "crank.toml";
  r.scene_text = R"toml(
[simulation]
duration = 2.0
[[body]]
name = "crank"
kind = "rigid"
mass = 1.0
inertia = [1, 1, 1]
[[joint]]
name = "shaft"
kind = "revolute"
parent = "ground"
child = "crank"
motion = "3*t + sin(5*t)"
)toml";
  r.times = VecX::LinSpaced(11, 0.0, 2.0);
  r.joints = {{.name = "shaft", .kind = "revolute", .position = {}, .orientation = {}, .value = {}, .rate = {}}};
  add_driven_coordinates(r);
  ASSERT_EQ(r.joints[0].value.rows(), 11);
  for (Eigen::Index i = 0; i < 11; ++i) {
    EXPECT_NEAR(r.joints[0].value(i, 0), 3.0 * r.times[i] + std::sin(5.0 * r.times[i]), 1e-14);
    EXPECT_NEAR(r.joints[0].rate(i, 0), 3.0 + 5.0 * std::cos(5.0 * r.times[i]), 1e-13);
  }
  // What is there stays; without a scene that can be read nothing is added.
  r.joints[0].value.setConstant(7.0);
  add_driven_coordinates(r);
  EXPECT_EQ(r.joints[0].value(3, 0), 7.0);
  for (const std::string& unreadable : {std::string(), std::string("[simulation\n")}) {
    r.scene_text = unreadable;
    r.joints[0].value.resize(0, 0);
    add_driven_coordinates(r);
    EXPECT_EQ(r.joints[0].value.cols(), 0);
  }
}

}  // namespace flexframe::sim::test_results
