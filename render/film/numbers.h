// The numbers that travel with a picture (render/picture/picture_numbers.h): vertices, their range, the colour range.
#pragma once

#include "render/picture/picture_numbers.h"

namespace flexframe::film {

render::PictureNumbers picture_numbers(const render::Picture& picture);

}  // namespace flexframe::film
