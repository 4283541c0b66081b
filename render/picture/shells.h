// The closed parts of a mesh, and which way they look.
#pragma once

#include "render/picture/mesh.h"

namespace flexframe::render {

struct Shells {
  bool closed = false;  // every edge has one neighbour and all agree about inside: back faces are never seen
  int turned = 0;       // parts that were inside out
};

// Turns closed parts that look inwards outwards, unless they are cavities of others: of a part drawn without its back faces nothing would
// be seen but the inside of its far walls. Copies of a position count as one.
Shells turn_shells_outwards(Mesh& mesh);

}  // namespace flexframe::render
