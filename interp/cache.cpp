// The disk cache of mapped modes: one file per content and build of this library, named by its hash; those not used for longest go.
//
// Layout (little endian): "FFMODES7", 16 bytes of content hash, int64 vertices, modes, text length, coordinates of the doubt (n or 0), the
// report as text lines, 3 M n floats column after column, both n x n tables of the doubt in double, 8 bytes of hash over everything before.
// Written beside its name and renamed, so that it is whole or not there.
#include "interp/modes.h"

#include "interp/disk_cache.h"
#include "interp/hash.h"
#include "interp/known.h"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <fstream>
#include <random>
#include <sstream>
#include <utility>

#include <dlfcn.h>
#include <sys/stat.h>

namespace flexframe::interp {
namespace {

constexpr std::string_view magic = "FFMODES7";
using Name = std::array<std::uint64_t, 2>;

// Size and time of the file that this code was loaded from: another build may map otherwise.
std::string this_build() {
  Dl_info info{};
  struct stat file {};
  if (::dladdr(reinterpret_cast<const void*>(&cached_modes), &info) == 0 || !info.dli_fname) return {};
  // A program that was found by PATH has no path here.
  if (::stat(info.dli_fname, &file) != 0 && ::stat("/proc/self/exe", &file) != 0) return {};
  return fmt::format("{} {}.{}", file.st_size, file.st_mtim.tv_sec, file.st_mtim.tv_nsec);
}

Name content_hash(const Nodes& nodes, const MeshView& mesh, const Options& options, const Eigen::MatrixXd& phi,
                  const Eigen::MatrixXd& psi) {
  Hash h;
  h.add_text(magic);
  h.add_text(this_build());
  for (const Eigen::Index size : {nodes.positions.rows(), mesh.vertices.rows(), mesh.triangles.rows(), phi.cols(), psi.cols()})
    h.add(static_cast<std::int64_t>(size));
  h.add_bytes(nodes.positions.data(), nodes.positions.size() * sizeof(double));
  h.add_bytes(mesh.vertices.data(), mesh.vertices.size() * sizeof(double));
  h.add_bytes(mesh.triangles.data(), mesh.triangles.size() * sizeof(int));
  h.add_bytes(phi.data(), phi.size() * sizeof(double));
  h.add_bytes(psi.data(), psi.size() * sizeof(double));
  h.add(static_cast<std::int64_t>(nodes.rotations));
  for (const Mat3& shear : nodes.shear) h.add_bytes(shear.data(), sizeof(double) * 9);
  h.add(static_cast<std::int64_t>(options.scheme));
  h.add(static_cast<std::int64_t>(options.patch_nodes));
  h.add(options.lebesgue_warn);
  h.add(options.lebesgue_error);
  h.add(options.merge_distance);
  h.add(options.thickness);
  return h.words();
}

std::string report_text(const Report& r) {
  std::string text = fmt::format("{}\n{}\n{}\n{:.17g} {} {} {} {:.17g}\n", scheme_name(r.scheme), r.reason, r.layout, r.lebesgue,
                                 r.lebesgue_vertex, r.patches, r.merged_nodes, r.setup_seconds);
  for (const std::string& w : r.warnings) text += w + "\n";
  return text;
}

bool read_report(const std::string& text, Report& r) {
  std::istringstream in(text);
  std::string scheme, numbers, line;
  if (!std::getline(in, scheme) || !std::getline(in, r.reason) || !std::getline(in, r.layout) || !std::getline(in, numbers)) return false;
  std::istringstream values(numbers);
  if (!(values >> r.lebesgue >> r.lebesgue_vertex >> r.patches >> r.merged_nodes >> r.setup_seconds)) return false;
  while (std::getline(in, line)) r.warnings.push_back(line);
  try {
    r.scheme = scheme_from_name(scheme);
  } catch (const InputError&) {
    return false;
  }
  return true;
}

std::string encode(const CachedModes& modes, const Name& name) {
  std::string out(magic);
  auto put = [&](const void* data, size_t size) { out.append(static_cast<const char*>(data), size); };
  const std::string report = report_text(modes.report);
  const std::array<std::int64_t, 4> sizes{modes.columns.rows() / 3, modes.columns.modes(), static_cast<std::int64_t>(report.size()),
                                          modes.doubt.doubt.rows()};
  put(name.data(), sizeof name);
  put(sizes.data(), sizeof sizes);
  out += report;
  put(modes.columns.tiles().data(), modes.columns.tiles().size_bytes());
  for (const Eigen::MatrixXd* table : {&modes.doubt.doubt, &modes.doubt.moved})
    put(table->data(), static_cast<size_t>(table->size()) * sizeof(double));
  Hash check;
  check.add_text(out);
  put(check.words().data(), 8);
  return out;
}

// False for anything but a whole file of this content.
bool decode(const std::string& data, const Name& name, Eigen::Index vertices, Eigen::Index modes, CachedModes& out) {
  constexpr size_t head = 8 + 16 + 32;
  if (data.size() < head + 8 || data.compare(0, magic.size(), magic) != 0) return false;
  Hash check;
  check.add_bytes(data.data(), data.size() - 8);
  Name found{};
  std::array<std::int64_t, 4> sizes{};
  std::uint64_t sum = 0;
  std::memcpy(found.data(), data.data() + 8, 16);
  std::memcpy(sizes.data(), data.data() + 24, 32);
  std::memcpy(&sum, data.data() + data.size() - 8, 8);
  if (sum != check.words()[0] || found != name || sizes[0] != vertices || sizes[1] != modes || sizes[2] < 0) return false;
  if (sizes[3] != 0 && sizes[3] != modes) return false;
  ModeColumns columns(3 * vertices, modes);
  const size_t tiles = columns.tiles().size_bytes(), table = static_cast<size_t>(sizes[3] * sizes[3]) * sizeof(double);
  if (data.size() != head + sizes[2] + tiles + 2 * table + 8) return false;
  if (!read_report(data.substr(head, sizes[2]), out.report)) return false;
  const char* at = data.data() + head + sizes[2];
  std::memcpy(columns.tiles().data(), at, tiles);
  for (Eigen::MatrixXd* into : {&out.doubt.doubt, &out.doubt.moved}) {
    into->resize(sizes[3], sizes[3]);
    std::memcpy(into->data(), at + tiles + (into == &out.doubt.moved ? table : 0), table);
  }
  out.columns = std::move(columns);
  out.from_cache = true;
  return true;
}

}  // namespace

CachedModes cached_modes(const Nodes& nodes, const MeshView& mesh, const Options& options, const Eigen::Ref<const Eigen::MatrixXd>& phi,
                         const Eigen::Ref<const Eigen::MatrixXd>& psi, const std::filesystem::path& cache) {
  const Eigen::MatrixXd shapes = phi, turns = psi;
  const Name name = content_hash(nodes, mesh, options, shapes, turns);
  const std::filesystem::path file = cache / fmt::format("{:016x}{:016x}.modes", name[0], name[1]);
  CachedModes out;
  if (!cache.empty()) {
    std::ifstream in(file, std::ios::binary);
    if (in) {
      // What cannot be read (a folder, a disk that fails) ends early: it has another checksum.
      std::ostringstream text;
      text << in.rdbuf();
      if (decode(std::move(text).str(), name, mesh.vertices.rows(), shapes.cols(), out)) {
        mark_used(file);
        return out;
      }
      out = {};
    }
  }
  const Map map = make_map_for(nodes, mesh, options, {shapes, nodes.rotations ? turns : Eigen::MatrixXd(), true});
  out.columns = map_modes(map, shapes, turns);
  out.doubt = doubt_modes(map, mesh, shapes, turns, out.columns);
  out.report = map.report;
  if (cache.empty()) return out;
  // A cache that cannot be written costs time, not the picture.
  std::error_code error;
  std::filesystem::create_directories(cache, error);
  const std::filesystem::path partial = file.string() + fmt::format(".{:08x}.partial", std::random_device{}());
  const std::string data = encode(out, name);
  std::ofstream stream(partial, std::ios::binary);
  stream.write(data.data(), static_cast<std::streamsize>(data.size()));
  stream.close();
  if (stream) std::filesystem::rename(partial, file, error);
  if (!stream || error) std::filesystem::remove(partial, error);
  bound_cache(cache, ".modes");
  return out;
}

}  // namespace flexframe::interp
