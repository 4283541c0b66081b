// Colour maps for scalars: perceptually ordered tables, sRGB.
//
// viridis, cividis, inferno: uniform in lightness, readable in grey and by the colour-blind (cividis made for them:
// Nuñez, Anderton, Renslow 2018; viridis and inferno: Smith, van der Walt 2015). turbo: rainbow without the false bands
// of jet (Mikhailov 2019). coolwarm: diverging, for signed values (Moreland 2009). greys: linear in CIE lightness.
#pragma once

#include <glm/glm.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::render {

enum class Colormap { viridis, cividis, inferno, turbo, coolwarm, greys };

// Names as scene files write them, in the order of the enumeration.
std::vector<std::string_view> colormap_names();

// Colour at t in [0, 1] (clamped), sRGB 0..1; NaN gives mid grey.
glm::vec3 colormap_color(Colormap map, double t);

// Colours to tell bodies, series and modes apart (well apart also for the colour-blind); the second ten are lighter, the third darker,
// then they repeat. sRGB.
glm::vec3 category_color(int index);

}  // namespace flexframe::render
