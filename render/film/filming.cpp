#include "render/film/filming.h"

#include "render/base/file.h"
#include "render/film/numbers.h"
#include "render/image/png.h"
#include "sim/base/cpu_clock.h"
#include "sim/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <new>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace flexframe::film {
namespace {

constexpr const char* input_key = "flexframe-inputs";

// What a worker tells its parent; short enough to be written in one piece.
struct Message {
  enum Kind { drawn, kept, failed } kind = drawn;
  int index = 0;  // of the picture among those asked for
  double deform = 0.0, draw = 0.0, encode = 0.0;
  std::array<char, 1024> text{};
};
static_assert(sizeof(Message) <= 4096, "longer pipe writes may interleave");

void send(int pipe, const Message& message) {
  // A parent that is gone reads nothing; the worker ends with it.
  while (::write(pipe, &message, sizeof message) < 0 && errno == EINTR) {}
}

// 16 bit pictures and vector files of the same moment, in folders beside the pictures': name by name.
std::vector<std::filesystem::path> channel_files(const Animation& animation, const FilmOptions& options, int picture) {
  std::vector<std::filesystem::path> files;
  if (animation.settings.depth_channel) files.push_back(options.folder.parent_path() / "depth" / picture_file_name(picture));
  if (animation.settings.scalar_channel) files.push_back(options.folder.parent_path() / "scalar" / picture_file_name(picture));
  if (animation.settings.linear_channel) files.push_back(options.folder.parent_path() / "linear" / picture_file_name(picture));
  if (animation.settings.vector_channel)
    files.push_back((options.folder.parent_path() / "vector" / picture_file_name(picture)).replace_extension(".svg"));
  if (animation.settings.pdf_channel)
    files.push_back((options.folder.parent_path() / "pdf" / picture_file_name(picture)).replace_extension(".pdf"));
  return files;
}

std::string vector_note(const std::string& inputs) { return fmt::format("{} {}", input_key, inputs); }

// Whether the file is whole and made from these inputs.
bool is_done(const std::filesystem::path& path, const std::string& inputs) {
  const bool pdf = path.extension() == ".pdf";
  if ((pdf || path.extension() == ".svg") && std::filesystem::exists(path)) {
    const std::vector<std::uint8_t> bytes = render::read_file(path);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return text.substr(0, 300).find(vector_note(inputs) + (pdf ? "\n" : " -->")) != std::string_view::npos &&
           text.ends_with(pdf ? "%%EOF\n" : "</svg>\n");
  }
  return std::filesystem::exists(path) && render::is_whole_png(path) && render::read_png_text(path, input_key) == inputs;
}

// Everything one worker does with one picture.
Message make_one(const Animation& animation, const FilmOptions& options, int picture, PictureMemory& memory, render::Renderer& renderer,
                 const std::string& environment) {
  Message message;
  const std::filesystem::path path = options.folder / picture_file_name(picture);
  double start = sim::cpu_seconds();
  update_picture(animation, picture, memory);
  const std::string inputs = picture_hash(memory.picture, environment);
  const std::vector<std::filesystem::path> channels = channel_files(animation, options, picture);
  if (options.resume && is_done(path, inputs) &&
      std::all_of(channels.begin(), channels.end(), [&](const auto& file) { return is_done(file, inputs); })) {
    message.kind = Message::kept;
    message.deform = sim::cpu_seconds() - start;
    return message;
  }
  double now = sim::cpu_seconds();
  message.deform = now - start;
  start = now;
  render::VectorFile vector{.svg = animation.settings.vector_channel,
                            .pdf = animation.settings.pdf_channel,
                            .dpi = animation.settings.dpi,
                            .note = vector_note(inputs),
                            .svg_file = {},
                            .pdf_file = {}};
  const render::Image image = renderer.draw(memory.picture, vector.svg || vector.pdf ? &vector : nullptr);
  for (const std::filesystem::path& file : channels) {
    if (file.extension() != ".png") {
      const std::string& text = file.extension() == ".svg" ? vector.svg_file : vector.pdf_file;
      render::write_file(file, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
      continue;
    }
    if (file.parent_path().filename() == "linear") {
      render::write_png(file, renderer.draw_linear(memory.picture),
                        {.level = 1, .linear = true, .dpi = animation.settings.dpi, .text = {{input_key, inputs}}});
      continue;
    }
    // What the numbers mean stands in the file: grey 0 and 65534, 65535 is nothing.
    double low = memory.picture.scalar_map.lower, high = memory.picture.scalar_map.upper;
    const bool depth = file.parent_path().filename() == "depth";
    const render::Image16 numbers = depth ? renderer.draw_depth(memory.picture, &low, &high) : renderer.draw_scalar(memory.picture);
    std::vector<std::pair<std::string, std::string>> text = {{input_key, inputs},
                                                             {"flexframe-range", fmt::format("{:.17g} {:.17g}", low, high)}};
    if (!depth && memory.picture.scalar_map.logarithmic) text.emplace_back("flexframe-scale", "log");
    render::write_png(file, numbers, {.level = 1, .text = std::move(text)});
  }
  now = sim::cpu_seconds();
  message.draw = now - start;
  start = now;
  render::write_png(path, image,
                    {.level = 1,
                     .dpi = animation.settings.dpi,
                     .text = {{input_key, inputs}, {render::numbers_key, render::numbers_text(picture_numbers(memory.picture))}}});
  message.encode = sim::cpu_seconds() - start;
  return message;
}

// The life of a worker: pictures from the shared counter until none is left.
[[noreturn]] void work(const Animation& animation, const FilmOptions& options, const std::vector<int>& pictures, std::atomic<int>& next,
                       int pipe, pid_t parent) {
  // A worker without its parent has nobody to draw for; the parent may be gone already.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  std::signal(SIGINT, SIG_IGN);  // the parent decides; a ctrl-C reaches the whole group
  std::signal(SIGTERM, SIG_DFL);
  ::setenv("LP_NUM_THREADS", "0", 1);
  std::string doing = "starting the renderer";
  const auto fail = [&](const std::string& reason) {
    Message message{.kind = Message::failed};
    const std::string text = fmt::format("{}: {}", doing, reason);
    std::strncpy(message.text.data(), text.c_str(), message.text.size() - 1);
    send(pipe, message);
    ::_exit(1);
  };
  try {
    // Never taken down: the process ends anyway.
    render::Renderer& renderer = *new render::Renderer(options.backend);
    std::string environment = fmt::format("drawing {} ", render::drawing_version) + renderer.info().renderer + ' ' +
                              renderer.info().version + ' ' + renderer.info().cpu;
    if (animation.settings.dpi > 0.0) environment += fmt::format(" {} dpi", animation.settings.dpi);
    PictureMemory memory;
    for (int i = next++; i < static_cast<int>(pictures.size()); i = next++) {
      doing = fmt::format("picture {}", pictures[i]);
      Message message = make_one(animation, options, pictures[i], memory, renderer, environment);
      message.index = i;
      send(pipe, message);
    }
  } catch (const std::bad_alloc&) {
    fail("out of memory");
  } catch (const std::exception& e) {
    fail(e.what());
  }
  // No clean-up: a fork shares its parent's handlers and buffers.
  ::_exit(0);
}

// Shared memory for the counter that hands out pictures.
class SharedCounter {
 public:
  SharedCounter() {
    void* memory = ::mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw DrawError(fmt::format("no shared memory for the workers: {}", std::strerror(errno)));
    counter_ = new (memory) std::atomic<int>(0);
    static_assert(std::atomic<int>::is_always_lock_free);
  }
  ~SharedCounter() { ::munmap(counter_, sizeof(std::atomic<int>)); }
  SharedCounter(const SharedCounter&) = delete;
  SharedCounter& operator=(const SharedCounter&) = delete;
  std::atomic<int>& get() { return *counter_; }

 private:
  std::atomic<int>* counter_;
};

// Workers that are killed and waited for when the scope is left, whatever the reason.
struct Workers {
  struct Child {
    pid_t pid = -1;
    bool running = true;
  };
  std::vector<Child> children;
  int pipe_read = -1;

  Workers() = default;
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  ~Workers() {
    for (const Child& child : children)
      if (child.running) ::kill(child.pid, SIGKILL);
    for (const Child& child : children)
      if (child.running)
        while (::waitpid(child.pid, nullptr, 0) < 0 && errno == EINTR) {}
    if (pipe_read >= 0) ::close(pipe_read);
  }

  // Waits for all; throws if one did not end as it should.
  void join() {
    for (Child& child : children) {
      int status = 0;
      while (::waitpid(child.pid, &status, 0) < 0 && errno == EINTR) {}
      child.running = false;
      if (WIFSIGNALED(status))
        throw DrawError(fmt::format("a drawing process was ended by signal {} ({}); the pictures so far are complete, --resume continues",
                                    WTERMSIG(status), strsignal(WTERMSIG(status))));
      if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw DrawError("a drawing process ended without an error message");
    }
  }
};

int core_count() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (::sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  return std::max(1, CPU_COUNT(&set));
}

// Removes what earlier runs left in the way: pictures to be drawn anew, and beyond the end of the whole sequence.
void clear_folder(const FilmOptions& options, const std::vector<int>& pictures, bool whole, int count) {
  namespace fs = std::filesystem;
  if (!options.resume)
    for (int k : pictures) fs::remove(options.folder / picture_file_name(k));
  render::remove_parts(options.folder, "frame_");
  for (const fs::directory_entry& entry : fs::directory_iterator(options.folder)) {
    const std::string name = entry.path().filename().string();
    if (!whole || !name.starts_with("frame_") || !name.ends_with(".png")) continue;
    const std::string digits = name.substr(6, name.size() - 10);
    if (digits.size() < 5 || digits.size() > 9 || digits.find_first_not_of("0123456789") != std::string::npos) continue;
    if (std::stol(digits) >= count) fs::remove(entry.path());
  }
}

}  // namespace

std::string picture_file_name(int picture) { return fmt::format("frame_{:05d}.png", picture); }

FilmReport film(const Animation& animation, const FilmOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const int end = options.end < 0 ? animation.count : options.end;
  if (options.first < 0 || options.first >= end || end > animation.count)
    throw sim::InputError(fmt::format("pictures {}:{} do not exist: the sequence has {} pictures, 0:{}", options.first, end,
                                      animation.count, animation.count));
  if (options.shards < 1 || options.shard < 0 || options.shard > options.shards)
    throw sim::InputError(fmt::format("shard {}/{}: must be I/N with 1 <= I <= N", options.shard, options.shards));
  std::vector<int> pictures;
  for (int k = options.first; k < end; ++k)
    if (k % options.shards == options.shard % options.shards) pictures.push_back(k);

  std::vector<std::filesystem::path> folders = {options.folder};
  for (const std::filesystem::path& file : channel_files(animation, options, 0)) folders.push_back(file.parent_path());
  for (const std::filesystem::path& folder : folders) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw FileError(fmt::format("{}: cannot create the folder: {}", folder.string(), error.message()));
  }
  const bool whole = options.first == 0 && end == animation.count && options.shards == 1;
  clear_folder(options, pictures, whole, animation.count);

  FilmReport report;
  report.pictures = static_cast<int>(pictures.size());
  report.workers = std::clamp(options.workers > 0 ? options.workers : core_count(), 1, std::max(1, report.pictures));
  if (pictures.empty()) return report;

  SharedCounter counter;
  Workers workers;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw DrawError(fmt::format("no pipe to the workers: {}", std::strerror(errno)));
  workers.pipe_read = ends[0];
  const pid_t parent = ::getpid();
  for (int w = 0; w < report.workers; ++w) {
    const pid_t pid = ::fork();
    if (pid == 0) {
      ::close(ends[0]);
      work(animation, options, pictures, counter.get(), ends[1], parent);
    }
    if (pid < 0) {
      const int reason = errno;
      if (w == 0) ::close(ends[1]);
      if (w == 0) throw DrawError(fmt::format("cannot start a drawing process: {}", std::strerror(reason)));
      report.workers = w;
      break;
    }
    workers.children.push_back({pid, true});
  }
  ::close(ends[1]);

  std::vector<bool> there(pictures.size(), false);
  size_t next = 0;
  // Messages until the last worker has closed its end.
  for (;;) {
    pollfd wait{.fd = ends[0], .events = POLLIN, .revents = 0};
    const int ready = ::poll(&wait, 1, 200);
    if (options.progress) options.progress(report.drawn + report.kept, report.pictures);
    if (ready <= 0) continue;
    Message message;
    const ssize_t got = ::read(ends[0], &message, sizeof message);
    if (got < 0 && errno == EINTR) continue;
    if (got != static_cast<ssize_t>(sizeof message)) break;
    if (message.kind == Message::failed) throw DrawError(message.text.data());
    ++(message.kind == Message::drawn ? report.drawn : report.kept);
    report.cpu_deform += message.deform;
    report.cpu_draw += message.draw;
    report.cpu_encode += message.encode;
    there[message.index] = true;
    for (; next < there.size() && there[next]; ++next)
      if (options.finished) options.finished(options.folder / picture_file_name(pictures[next]));
    if (options.progress) options.progress(report.drawn + report.kept, report.pictures);
  }
  workers.join();
  if (report.drawn + report.kept != report.pictures) throw DrawError("the drawing processes ended before all pictures were drawn");
  report.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

}  // namespace flexframe::film
