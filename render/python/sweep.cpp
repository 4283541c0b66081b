// sweep: a scene over its keys, with the table as arrays.
#include "render/python/sweep.h"

#include "render/film/sweep_plots.h"
#include "render/python/bindings.h"

#include "sim/base/file_output.h"
#include "sim/sweep/minimise.h"
#include "sim/sweep/sensitivity.h"

#include <pybind11/eigen.h>

#include <dlfcn.h>

#include <functional>
#include <limits>
#include <map>

namespace flexframe::python {
namespace {

// What the rows depend on beside the question: this module's own file.
std::string module_fingerprint() {
  Dl_info info{};
  if (::dladdr(reinterpret_cast<const void*>(&module_fingerprint), &info) == 0 || !info.dli_fname) return "unknown";
  return sim::sha256_of_file(info.dli_fname);
}

// The words of ff.sweep() by name, in their place in the question.
void take_words(const py::dict& words, sim::SweepQuestion& q) {
  const auto optional = [](const py::handle& v) { return v.cast<std::optional<double>>(); };
  const std::map<std::string, std::function<void(const py::handle&)>> takers{
      {"settings", [&](const py::handle& v) { q.design.settings = v.cast<std::vector<std::string>>(); }},
      {"responses", [&](const py::handle& v) { q.responses = v.cast<std::vector<std::string>>(); }},
      {"sample", [&](const py::handle& v) { q.design.sample = v.cast<std::string>(); }},
      {"sensitivity", [&](const py::handle& v) { q.design.sensitivity = v.cast<std::string>(); }},
      {"seed", [&](const py::handle& v) { q.design.seed = v.cast<std::uint64_t>(); }},
      {"goal", [&](const py::handle& v) { q.goal.text = v.cast<std::string>(); }},
      {"maximise", [&](const py::handle& v) { q.goal.maximise = v.cast<bool>(); }},
      {"limits", [&](const py::handle& v) { q.goal.limits = v.cast<std::vector<std::string>>(); }},
      {"precision", [&](const py::handle& v) { q.goal.precision = v.cast<double>(); }},
      {"searches", [&](const py::handle& v) { q.design.searches = v.cast<int>(); }},
      {"runs", [&](const py::handle& v) { q.design.runs = v.cast<int>(); }},
      {"accuracy", [&](const py::handle& v) { q.accuracy = optional(v); }},
      {"tolerance", [&](const py::handle& v) { q.tolerance = optional(v); }},
      {"method", [&](const py::handle& v) { q.method = v.is_none() ? "" : v.cast<std::string>(); }},
      {"estimate_error", [&](const py::handle& v) { q.estimate_error = v.cast<bool>(); }},
      {"check_effects", [&](const py::handle& v) { q.check_effects = v.cast<bool>(); }},
      {"strict", [&](const py::handle& v) { q.strict = v.cast<bool>(); }},
      {"longest", [&](const py::handle& v) { q.longest = v.cast<double>(); }},
  };
  for (const auto& [name, value] : words) {
    const auto word = name.cast<std::string>();
    try {
      takers.at(word)(value);
    } catch (const py::cast_error&) {
      throw py::type_error(word + " is of another type: " + py::repr(value).cast<std::string>());
    }
  }
}

// Values of a key at the points that are there: numbers, or words.
py::object key_values(const sim::Sweep& sweep, std::size_t axis, const std::vector<long>& points) {
  const sim::SweepAxis& a = sweep.design.axes()[axis];
  const bool numbers = a.chance || !a.numbers.empty() || sweep.goal;
  sim::VecX out(static_cast<Eigen::Index>(points.size()));
  py::list texts;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const sim::Design::Value value = sweep.design.point(points[k])[axis];
    if (numbers) out[static_cast<Eigen::Index>(k)] = value.number;
    else texts.append(value.text);
  }
  return numbers ? py::cast(out) : py::object(texts);
}

py::dict indices_of(const sim::Sweep& sweep, const sim::SweepTable& table) {
  py::dict out;
  for (const sim::Sensitivity& s : sim::sensitivities(sweep, table)) {
    py::dict keys;
    for (std::size_t k = 0; k < sweep.design.axes().size(); ++k) {
      py::dict one;
      if (k < s.sobol.size()) {
        const sim::SobolIndex& i = s.sobol[k];
        one["first"] = i.first;
        one["first_interval"] = py::make_tuple(i.first_low, i.first_high);
        one["total"] = i.total;
        one["total_interval"] = py::make_tuple(i.total_low, i.total_high);
      } else if (k < s.morris.size()) {
        one["mean_size"] = s.morris[k].mean_size;
        one["mean"] = s.morris[k].mean;
        one["deviation"] = s.morris[k].deviation;
      } else {
        continue;
      }
      keys[py::str(sweep.design.axes()[k].key)] = one;
    }
    out[py::str(s.response)] = keys;
  }
  return out;
}

py::object found_of(const sim::Sweep& sweep, const sim::SweepTable& table, const sim::FoundMinimum& found) {
  if (!sweep.goal) return py::none();
  py::dict out;
  out["point"] = found.best < 0 ? py::object(py::none()) : py::cast(found.best);
  if (found.best >= 0) {
    out["value"] = table.responses(found.best, static_cast<Eigen::Index>(sweep.goal->response));
    py::dict settings;
    for (std::size_t k = 0; k < sweep.design.axes().size(); ++k)
      settings[py::str(sweep.design.axes()[k].key)] = sweep.design.point(found.best)[k].number;
    out["settings"] = settings;
  }
  out["at_ends"] = found.at_ends;
  out["active_limits"] = found.active;
  out["warnings"] = found.warnings;
  return out;
}

py::dict table_of(const sim::Sweep& sweep, const sim::SweepTable& table) {
  std::vector<long> points;
  for (long i = 0; i < static_cast<long>(table.ends.size()); ++i)
    if (table.has(i)) points.push_back(i);
  const auto n = static_cast<Eigen::Index>(points.size());
  sim::VecX cpu(n), error(n);
  sim::MatX responses(n, table.responses.cols());
  py::list ends, error_of;
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::size_t at = points[k];
    const auto row = static_cast<Eigen::Index>(at);
    ends.append(sim::point_end_words()[table.ends[at]]);
    cpu[k] = table.cpu[row];
    error[k] = table.error[row] < 0.0 ? std::numeric_limits<double>::quiet_NaN() : table.error[row];
    error_of.append(table.error[row] < 0.0 ? std::string() : table.error_columns[table.error_column[at]]);
    responses.row(k) = table.responses.row(row);
  }
  py::dict out, keys, values, messages;
  for (std::size_t k = 0; k < sweep.design.axes().size(); ++k) keys[py::str(sweep.design.axes()[k].key)] = key_values(sweep, k, points);
  for (std::size_t k = 0; k < sweep.names.size(); ++k)
    values[py::str(sweep.names[k])] = sim::VecX(responses.col(static_cast<Eigen::Index>(k)));
  for (const auto& [point, message] : table.messages) messages[py::int_(point)] = message;
  out["point"] = points;
  out["keys"] = keys;
  out["responses"] = values;
  out["end"] = ends;
  out["cpu"] = cpu;
  out["error"] = error;
  out["error_of"] = error_of;
  out["messages"] = messages;
  return out;
}

struct Place {
  std::filesystem::path folder;
  int workers = 0;
  bool resume = false, plots = true;
};

py::dict sweep(const std::filesystem::path& file, const py::dict& words, const Place& place, const py::object& progress) {
  sim::SweepQuestion question;
  question.scene = file;
  take_words(words, question);
  Watcher watcher(progress);
  std::optional<sim::Sweep> made;
  sim::Collected all;
  sim::FoundMinimum found;
  {
    const py::gil_scoped_release free;
    made = sim::make_sweep(question, place.folder, module_fingerprint());
    std::error_code error;
    std::filesystem::create_directories(place.folder, error);
    if (error) throw FileError(place.folder.string() + ": cannot create the folder: " + error.message());
    sim::write_question(*made);
    sim::SweepShard options;
    options.workers = place.workers;
    options.resume = place.resume;
    options.progress = [&](long done, long of) {
      if (done < of) watcher.look(static_cast<double>(done) / static_cast<double>(of));
      else watcher.tell(1.0);
    };
    sim::run_shard(*made, options);
    all = made->goal ? sim::collect_searches(*made, found) : sim::collect_rows(*made);
    sim::write_table_csv(*made, all.table, place.folder / "table.csv");
    sim::write_table_hdf5(*made, all.table, place.folder / "table.h5");
    if (place.plots) film::write_sweep_report(*made, all.table, place.folder);
  }
  py::dict out = table_of(*made, all.table);
  out["indices"] = indices_of(*made, all.table);
  out["found"] = found_of(*made, all.table, found);
  return out;
}

}  // namespace

void bind_sweep(py::module_& m) {
  m.def(
      "_sweep",
      [](const std::filesystem::path& file, const py::dict& words, const py::dict& place, const py::object& progress) {
        return sweep(file, words,
                     {place["folder"].cast<std::filesystem::path>(), place["workers"].cast<int>(), place["resume"].cast<bool>(),
                      place["plots"].cast<bool>()},
                     progress);
      },
      py::arg("file"), py::arg("words"), py::arg("place"), py::arg("progress"));
}

}  // namespace flexframe::python
