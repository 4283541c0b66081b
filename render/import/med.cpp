// Meshes of MED files (Salome, Code_Aster), which are HDF5 inside. Read as they lie there and not by libmedc: Debian's brings MPI and
// another HDF5 with it. Layout: MED 3 and 4, "Modélisation et Echange de Données", documentation of med-fichier.
#include "render/import/fe_mesh.h"

#include "render/import/hdf5_reader.h"
#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace flexframe::imports {
namespace {

struct Type {
  const char* name;
  int vtk, nodes;
};
// MED's cells by VTK's number.
constexpr std::array<Type, 20> types{{{"PO1", 1, 1},   {"SE2", 3, 2},  {"SE3", 21, 3},  {"TR3", 5, 3},   {"QU4", 9, 4},
                                      {"TR6", 22, 6},  {"QU8", 23, 8}, {"QU9", 28, 9},  {"TE4", 10, 4},  {"PY5", 14, 5},
                                      {"PE6", 13, 6},  {"HE8", 12, 8}, {"T10", 24, 10}, {"P15", 26, 15}, {"H20", 25, 20},
                                      {"H27", 29, 27}, {"TR7", 34, 7}, {"P13", 27, 13}, {"P18", 32, 18}, {"O12", 16, 12}}};
constexpr size_t name_length = 80;  // of a group

// A text of fixed length: without the blanks and zeros behind it.
std::string trimmed(std::string text) {
  text.resize(std::min(text.find('\0'), text.size()));
  text.resize(text.find_last_not_of(' ') + 1);
  return text;
}

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : file_(path) {
    mesh_.file = path.string();
    const auto version = file_.has("/INFOS_GENERALES") ? file_.attribute("/INFOS_GENERALES", "MAJ") : std::nullopt;
    if (!version || !file_.has("/ENS_MAA")) file_.fail("is no MED file: it lacks INFOS_GENERALES or ENS_MAA");
    if (*version < 3.0)
      file_.fail(
          fmt::format("was written by MED {:.0f}; 3 and 4 can be read (Salome saves it as such, or MED's medimport does)", *version));
  }

  CellMesh read() {
    choose();
    read_points();
    for (const std::string& name : file_.members(at_ + "/MAI")) read_cells(name);
    read_groups("ELEME", cell_family_, mesh_.cell_sets);
    read_groups("NOEUD", point_family_, mesh_.point_sets);
    return std::move(mesh_);
  }

 private:
  // The first of the meshes of most dimensions, and its first state.
  void choose() {
    const std::vector<std::string> names = file_.members("/ENS_MAA");
    if (names.empty()) file_.fail("holds no mesh");
    double most = -1.0;
    for (const std::string& name : names) {
      const double dimension = file_.attribute("/ENS_MAA/" + name, "DIM").value_or(0.0);
      if (dimension <= most) continue;
      most = dimension;
      name_ = name;
    }
    const std::string mesh = "/ENS_MAA/" + name_;
    if (names.size() > 1)
      mesh_.notes.push_back(fmt::format("of the meshes {} of {}, {} is read", sim::list_words(names, 12), mesh_.file, sim::quote(name_)));
    if (file_.attribute(mesh, "TYP").value_or(0.0) != 0.0)
      file_.fail(fmt::format("its mesh {} is structured; an unstructured one is needed", sim::quote(name_)));
    if (const double space = file_.attribute(mesh, "ESP").value_or(3.0); space != 3.0)
      file_.fail(fmt::format("its mesh {} has {:.0f} coordinates a node; three are needed", sim::quote(name_), space));
    if (file_.attribute(mesh, "REP").value_or(0.0) != 0.0)
      file_.fail(fmt::format("the coordinates of its mesh {} are not Cartesian", sim::quote(name_)));
    const std::vector<std::string> states = file_.members(mesh);
    if (states.empty()) file_.fail(fmt::format("its mesh {} has no state", sim::quote(name_)));
    at_ = mesh + "/" + states.front();
    const std::string unit = file_.has_attribute(mesh, "UNI") ? trimmed(file_.text(mesh, "UNI").substr(0, 16)) : "";
    if (!unit.empty())
      mesh_.notes.push_back(
          fmt::format("{} says that its lengths are in {}; they are read in those of --units", mesh_.file, sim::quote(unit)));
  }

  void read_points() {
    if (!file_.has(at_ + "/NOE/COO")) file_.fail(fmt::format("its mesh {} has no nodes", sim::quote(name_)));
    const std::vector<double> all = file_.rows(at_ + "/NOE/COO", 0, -1);
    const size_t count = all.size() / 3;
    if (count == 0 || all.size() % 3 != 0 || all.size() > 3'000'000'000) file_.fail(fmt::format("has {} coordinates of nodes", all.size()));
    mesh_.points.resize(all.size());
    for (size_t p = 0; p < count; ++p)
      for (size_t k = 0; k < 3; ++k) mesh_.points[3 * p + k] = all[k * count + p];
    read_families(at_ + "/NOE", count, point_family_);
  }

  // Cells of one kind: all first nodes, then all second ones, and so on.
  void read_cells(const std::string& name) {
    const auto type = std::find_if(types.begin(), types.end(), [&](const Type& t) { return name == t.name; });
    if (type == types.end()) {
      if (name == "POE") file_.fail("holds polyhedra, which are no finite elements");
      if (name == "POG" || name == "PO2") return add_polygons(name);
      mesh_.notes.push_back(fmt::format("{}: its cells of the kind {} are left out", mesh_.file, sim::quote(name)));
      return;
    }
    const std::vector<double> all = file_.rows(at_ + "/MAI/" + name + "/NOD", 0, -1);
    const auto width = static_cast<size_t>(type->nodes);
    const size_t count = all.size() / width;
    if (all.size() % width != 0)
      file_.fail(fmt::format("its cells {} have {} nodes in all, which is no multiple of {}", name, all.size(), width));
    std::vector<int> of_cell(width);
    for (size_t c = 0; c < count; ++c) {
      for (size_t k = 0; k < width; ++k) {
        const double node = all[k * count + c];
        if (!(node >= 1.0 && node < 2e9)) file_.fail(fmt::format("a cell {} names node {}", name, node));
        of_cell[k] = static_cast<int>(node) - 1;
      }
      mesh_.add(type->vtk, of_cell);
    }
    read_families(at_ + "/MAI/" + name, count, cell_family_);
  }

  // One cell stands for all of them: they are no elements, and which of their corners is whose does not matter.
  void add_polygons(const std::string& name) {
    std::vector<int> corners;
    for (const double node : file_.rows(at_ + "/MAI/" + name + "/NOD", 0, -1))
      if (node >= 1.0 && node < 2e9) corners.push_back(static_cast<int>(node) - 1);
    mesh_.add(7, corners);
    cell_family_.push_back(0.0);
  }

  // Family 0, of no groups, where the file says nothing.
  void read_families(const std::string& of, size_t count, std::vector<double>& into) const {
    std::vector<double> families(count, 0.0);
    if (file_.has(of + "/FAM")) families = file_.rows(of + "/FAM", 0, -1);
    if (families.size() != count) file_.fail(fmt::format("{}/FAM has {} numbers for {}", of, families.size(), count));
    into.insert(into.end(), families.begin(), families.end());
  }

  void read_groups(const std::string& kind, const std::vector<double>& families, std::map<std::string, std::vector<int>>& sets) const {
    const std::string folder = fmt::format("/FAS/{}/{}", name_, kind);
    for (const std::string& family : file_.members(folder)) {
      const std::string at = folder + "/" + family, names = at + "/GRO/NOM";
      const auto number = file_.attribute(at, "NUM");
      if (!number || !file_.has(names)) continue;
      const std::string text = file_.bytes(names);
      for (size_t first = 0; first < text.size(); first += name_length) {
        const std::string name = trimmed(text.substr(first, name_length));
        if (name.empty()) continue;
        std::vector<int>& set = sets[name];
        for (size_t i = 0; i < families.size(); ++i)
          if (families[i] == *number) set.push_back(static_cast<int>(i));
      }
    }
  }

  Hdf5Reader file_;
  CellMesh mesh_;
  std::string name_, at_;  // of the mesh, and where its state lies
  std::vector<double> cell_family_, point_family_;
};

}  // namespace

CellMesh read_med_cells(const std::filesystem::path& path) { return Reader(path).read(); }

}  // namespace flexframe::imports
