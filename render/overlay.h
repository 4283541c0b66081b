// Private to the drawing: words, bars and diagrams onto the finished picture.
#pragma once

#include "render/image.h"
#include "render/layout.h"
#include "render/view.h"

#include <span>

namespace flexframe::render {

void draw_overlay(Image& image, const Picture& picture, const Layout& layout, std::span<const ViewFrame> frames);

}  // namespace flexframe::render
