// What tells one kind of force from another for those who only need to know where it acts.
#pragma once

#include "sim/scene/scene.h"

namespace flexframe::sim {

struct ForceTraits {
  bool force = false, moment = false;  // what it may pass on at its frame
  bool between = false;                // acts on the frame `from` too
  bool value = false;                  // the scene gives its size, along a direction
};

constexpr ForceTraits traits(ForceKind kind) {
  switch (kind) {
    case ForceKind::force:
    case ForceKind::distributed:
      return {.force = true, .value = true};
    case ForceKind::torque:
      return {.moment = true, .value = true};
    case ForceKind::drag:
      return {.force = true};
    case ForceKind::spring_damper:
      return {.force = true, .between = true};
    case ForceKind::bushing:
    case ForceKind::contact:
      return {.force = true, .moment = true, .between = true};
    case ForceKind::user:
      return {.force = true, .moment = true};
  }
  return {};
}

}  // namespace flexframe::sim
