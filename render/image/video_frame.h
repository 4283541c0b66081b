// Pictures as video codecs take them: luma and half as many rows and columns of two colour differences, in a stream that names its size.
#pragma once

#include "render/image/image.h"

#include <cstdint>
#include <string>
#include <vector>

namespace flexframe::render {

// Head of a YUV4MPEG2 stream of pictures of this size in pixels at so many a second; the size is rounded up to even numbers.
// Throws ArgumentError for a size or a rate that is not positive.
std::string video_stream_head(int width, int height, double frame_rate);

// Appends a picture to the stream: matrix of ITU-R BT.709, all 256 levels, colour differences 4:2:0 where luma's even columns lie and
// between its rows. Transparent pixels lie on white; a last odd row or column is repeated. Levels are right to half a level.
void append_video_frame(const Image& image, std::vector<std::uint8_t>& stream);

}  // namespace flexframe::render
