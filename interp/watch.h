// Long calls that may be given up: whoever waits for a map or a drawing's setup is asked now and then, and may throw to stop it.
//
//   const Watch watch([&] { if (stop_wanted) throw Stopped(); });      until it goes out of scope, for calls of this thread
//   const Map map = make_map(nodes, mesh);                             throws Stopped within a fraction of a second
#pragma once

#include <functional>

namespace flexframe::interp {

// Asked in the thread that made it, between pieces of work; a second one hides the first as long as it lives.
class Watch {
 public:
  // ask: called often, at times a million times a second; may throw whatever shall end the call.
  explicit Watch(std::function<void()> ask);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

 private:
  friend void look();
  std::function<void()> ask_;
  Watch* before_;
};

// Asks the watch of this thread, if it has one; throws what that throws. Some nanoseconds without one.
void look();

// Calls work, which cannot look up itself (a factorisation of a library's). Under a watch it runs in a thread beside and, if the watch
// throws, is left to end there by itself: so it must own all that it touches. Throws what work throws.
void look_beside(std::function<void()> work);

}  // namespace flexframe::interp
