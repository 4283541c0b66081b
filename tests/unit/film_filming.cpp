#include "film_swing.h"
#include "scratch.h"

#include "render/film/filming.h"
#include "render/film/video.h"
#include "render/image/png.h"

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <map>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

namespace test_filming {
namespace {

using namespace flexframe;
namespace fs = std::filesystem;

std::string bytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Filming : public testing::Test {
 protected:
  void SetUp() override {
    film::RenderSettings s;
    s.size = {160, 90};
    s.frame_rate = 12;
    s.speed = 1;
    s.samples = 1;
    animation = film::make_animation(results, s, nullptr);
  }

  film::FilmReport draw(const char* name, film::FilmOptions options = {}) {
    options.folder = folder / name;
    return film::film(animation, options);
  }
  // Names and bytes of all files.
  std::map<std::string, std::string> content(const char* name) {
    std::map<std::string, std::string> out;
    for (const auto& entry : fs::directory_iterator(folder / name)) out[entry.path().filename().string()] = bytes(entry.path());
    return out;
  }

  const Scratch scratch;
  const fs::path& folder = scratch.path();
  sim::Results results = test::swinging_beam();
  film::Animation animation;
};

TEST_F(Filming, SameBitsWhateverTheWorkersAndShards) {
  const film::FilmReport report = draw("one", {.workers = 1});
  EXPECT_EQ(report.pictures, 13);
  EXPECT_EQ(report.drawn, 13);
  EXPECT_GT(report.cpu_draw, 0.0);
  draw("three", {.workers = 3});
  draw("shards", {.shard = 1, .shards = 2});
  draw("shards", {.shard = 2, .shards = 2});
  const auto one = content("one");
  EXPECT_EQ(one.size(), 13u);
  EXPECT_EQ(one, content("three"));
  EXPECT_EQ(one, content("shards"));
  for (const auto& [name, data] : one) EXPECT_TRUE(render::is_whole_png(folder / "one" / name)) << name;
  EXPECT_NE(one.at("frame_00000.png"), one.at("frame_00005.png"));
}

TEST_F(Filming, RangesAndResume) {
  draw("a", {.first = 2, .end = 5});
  EXPECT_EQ(content("a").size(), 3u);
  const auto before = fs::last_write_time(folder / "a/frame_00003.png");
  // A damaged picture and one of other inputs are drawn again, the others kept.
  std::ofstream(folder / "a/frame_00002.png", std::ios::binary | std::ios::app) << "x";
  const film::FilmReport report = draw("a", {.resume = true});
  EXPECT_EQ(report.kept, 2);
  EXPECT_EQ(report.drawn, 11);
  EXPECT_EQ(fs::last_write_time(folder / "a/frame_00003.png"), before);
  draw("b");
  EXPECT_EQ(content("a"), content("b"));

  results.bodies[0].displacement *= 1.001;
  const film::FilmReport changed = draw("a", {.resume = true});
  // Picture 0 is undeformed; its colours and camera are the sequence's, which has changed.
  EXPECT_GE(changed.drawn, 12);
}

TEST_F(Filming, PicturesOfALongerRunAreRemoved) {
  fs::create_directories(folder / "a");
  for (const char* name :
       {"frame_00013.png", "frame_00100.png", ".frame_00001.png.2000000000-1.part", ".frame_00002.png.part", "notes.txt"})
    std::ofstream(folder / "a" / name) << "old";
  // What a living process writes is its own affair: two shards may share a folder.
  const std::string living = ".frame_00003.png." + std::to_string(::getpid()) + "-7.part";
  std::ofstream(folder / "a" / living) << "half";
  draw("a");
  const auto files = content("a");
  EXPECT_EQ(files.size(), 15u);
  EXPECT_TRUE(files.contains(living));
  EXPECT_TRUE(files.contains("notes.txt"));
}

TEST_F(Filming, RefusesRangesThatAreNot) {
  for (const film::FilmOptions& options :
       {film::FilmOptions{.first = 13}, film::FilmOptions{.first = 3, .end = 3}, film::FilmOptions{.end = 14},
        film::FilmOptions{.shard = 3, .shards = 2}, film::FilmOptions{.shards = 0}})
    EXPECT_THROW(draw("x", options), sim::InputError);
  EXPECT_FALSE(fs::exists(folder / "x"));
}

TEST_F(Filming, AFolderThatCannotBeIsAnError) {
  fs::create_directories(folder);
  std::ofstream(folder / "file") << "x";
  try {
    draw("file/frames");
    ADD_FAILURE();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("file"), std::string::npos);
  }
}

TEST_F(Filming, AFailingWriteNamesThePicture) {
  // A folder in a picture's place.
  fs::create_directories(folder / "a/frame_00004.png/inside");
  try {
    draw("a", {.resume = true});
    ADD_FAILURE();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("frame_00004.png"), std::string::npos) << e.what();
  }
}

TEST_F(Filming, ProgressMayStopIt) {
  struct Stop {};
  int calls = 0;
  const auto stop = [&](int, int) {
    if (++calls > 2) throw Stop{};
  };
  EXPECT_THROW(draw("a", {.workers = 2, .progress = stop}), Stop);
  for (const auto& [name, data] : content("a")) EXPECT_TRUE(render::is_whole_png(folder / "a" / name)) << name;
}

TEST_F(Filming, KilledAtAnyMomentItLeavesWholePicturesAndResumes) {
  draw("whole");
  for (int wait : {120, 200, 280, 360, 450}) {
    const pid_t child = ::fork();
    if (child == 0) {
      try {
        draw("killed", {.resume = true, .workers = 2});
      } catch (...) {}
      ::_exit(0);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(wait));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    if (!fs::exists(folder / "killed")) continue;
    for (const auto& entry : fs::directory_iterator(folder / "killed")) {
      if (entry.path().extension() != ".png") continue;
      EXPECT_TRUE(render::is_whole_png(entry.path())) << entry.path();
    }
  }
  // Workers of killed parents end by themselves.
  draw("killed", {.resume = true});
  EXPECT_EQ(content("whole"), content("killed"));
}

TEST_F(Filming, AKilledWorkerIsAnError) {
  // The worker that finds no graphics memory is the common case; here the test ends one.
  const auto kill_children = [](int done, int) {
    if (done < 1) return;
    std::ifstream children("/proc/self/task/" + std::to_string(::getpid()) + "/children");
    for (pid_t pid; children >> pid;) ::kill(pid, SIGKILL);
  };
  EXPECT_THROW(draw("a", {.workers = 2, .progress = kill_children}), std::runtime_error);
}

TEST_F(Filming, VideoHasEveryPicture) {
  film::VideoWriter video(folder / "film.mp4", 12.0);
  std::vector<std::string> fed;
  draw("a", {.workers = 3, .finished = [&](const fs::path& picture) {
               EXPECT_TRUE(render::is_whole_png(picture));
               fed.push_back(picture.filename().string());
               video.add(picture);
             }});
  ASSERT_EQ(fed.size(), 13u);
  EXPECT_TRUE(std::is_sorted(fed.begin(), fed.end()));
  const film::VideoReport report = video.finish();
  ASSERT_TRUE(report.made) << report.note;
  EXPECT_GT(fs::file_size(folder / "film.mp4"), 1000u);

  // Without pictures, with one that is missing, and one that nobody finishes: a reason, and no file.
  film::VideoWriter nothing(folder / "nothing.mp4", 12.0);
  EXPECT_FALSE(nothing.finish().made);
  film::VideoWriter gap(folder / "gap.mp4", 12.0);
  gap.add(folder / "a/frame_00000.png");
  gap.add(folder / "a/frame_00099.png");
  const film::VideoReport none = gap.finish();
  EXPECT_FALSE(none.made);
  EXPECT_NE(none.note.find("frame_00099.png"), std::string::npos) << none.note;
  {
    film::VideoWriter dropped(folder / "dropped.mp4", 12.0);
    for (int k = 0; k < 13; ++k) dropped.add(folder / "a" / film::picture_file_name(k));
  }
  for (const auto& entry : fs::directory_iterator(folder))
    EXPECT_TRUE(entry.is_directory() || entry.path().filename() == "film.mp4") << entry.path();
}

}  // namespace

}  // namespace test_filming
