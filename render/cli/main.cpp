// The program: words of the command line to one subcommand, exceptions to exit codes.
#include "render/cli/commands.h"
#include "render/cli/export.h"
#include "render/cli/terminal.h"
#include "render/cli/version.h"

#include "render/draw/renderer.h"
#include "sim/base/error.h"
#include "sim/base/files_read.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <new>
#include <system_error>
#include <vector>

namespace {

using namespace flexframe;

constexpr const char* description = R"(Flexible multibody simulation and its pictures, without a display.

  flexframe run examples/slider_crank.toml     simulate and draw: results, histories, PNG pictures, video

Exit codes: 0 done; 1 failed, or pictures differ; 2 wrong usage or bad input; 130 interrupted.)";

int run_program(int argc, char** argv) {
  cli::Program program("flexframe", description, cli::version_text);
  const std::vector<cli::Command> commands = {
      cli::add_run(program),     cli::add_simulate(program), cli::add_render(program),    cli::add_check(program),
      cli::add_info(program),    cli::add_reduce(program),   cli::add_modes(program),     cli::add_deform(program),
      cli::add_compare(program), cli::add_effects(program),  cli::add_study(program),     cli::add_export(program),
      cli::add_new(program),     cli::add_response(program), cli::add_load_path(program), cli::add_spectrum(program),
      cli::add_sweep(program),   cli::add_collect(program),  cli::add_import(program),
  };
  if (!program.parse(argc, argv)) return 0;
  const sim::FilesRead read(sim::FilesRead::Keep::paths);  // for require_not_read
  for (const cli::Command& command : commands) {
    if (!command.words.given()) continue;
    const bool asked =
        command.answers || command.words.given("--json") || command.words.given("--list") || command.words.given("--dry-run");
    if (cli::verbosity() == cli::Verbosity::quiet && !asked) cli::silence_stdout();
    const int code = command.action();
    // Results that did not reach their reader are no success.
    if (std::fflush(stdout) != 0 || std::ferror(stdout)) throw std::system_error(errno, std::generic_category(), "cannot write to stdout");
    return code;
  }
  throw std::logic_error("internal error: a subcommand without an action");
}

int report(int code, const char* message) {
  fmt::print(stderr, "flexframe: {}\n", message);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  cli::secure_streams();
  render::tune_process();
  cli::watch_interrupts();
  try {
    return run_program(argc, argv);
  } catch (const cli::UsageError& e) {
    return report(2, e.what());
  } catch (const InputError& e) {
    return report(2, e.what());
  } catch (const cli::Interrupted& e) {
    return report(130, e.what());
  } catch (const std::bad_alloc&) {
    return report(1, "out of memory");
  } catch (const std::system_error& e) {
    // Who reads the pipe has seen enough (flexframe check S | head): nothing to tell.
    return e.code() == std::errc::broken_pipe ? 1 : report(1, e.what());
  } catch (const std::exception& e) {
    return report(1, e.what());
  }
}
