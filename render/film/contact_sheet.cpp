#include "render/film/contact_sheet.h"

#include "render/film/filming.h"
#include "render/image/png.h"

#include <algorithm>
#include <cmath>

namespace flexframe::film {

void write_contact_sheet(const std::filesystem::path& folder, int first, int pictures, int count, const std::filesystem::path& path) {
  count = std::min(count, pictures);
  if (count < 1) return;
  constexpr int widest = 1920, narrowest = 160, gap = 4;
  const int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
  const int width = std::max(narrowest, widest / columns - gap);
  std::vector<render::Image> images;
  for (int k = 0; k < count; ++k) {
    const int number = first + (count > 1 ? static_cast<int>(static_cast<long long>(k) * (pictures - 1) / (count - 1)) : 0);
    const render::Image image = render::read_png(folder / picture_file_name(number));
    images.push_back(render::reduce_image(image, width, std::max(1, image.height)));
  }
  render::write_png(path, render::contact_sheet(images, columns, gap), {.level = 6, .text = {}});
}

}  // namespace flexframe::film
