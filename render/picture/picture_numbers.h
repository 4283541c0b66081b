// What a picture shows, as numbers that travel in its PNG file: a colour range that is 1 % off changes no pixel by more than image
// comparison allows, and a deformation 0.01 % off hardly one, but both show here.
#pragma once

#include "render/picture/picture.h"

#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace flexframe::render {

inline constexpr const char* numbers_key = "flexframe-numbers";  // keyword of the PNG's text

struct PictureNumbers {
  long vertices = 0;                                // of all surfaces
  std::string hash;                                 // of their positions and poses, hexadecimal
  glm::dvec3 lower{0.0}, upper{0.0};                // world, m: box around the surfaces' own boxes
  std::optional<std::pair<double, double>> colors;  // values at the ends of the colour map; none: not coloured by values
};

// One line "vertices 8 hash 0f lower 0 0 0 upper 1 1 1 colors 0 0.002"; numbers with 17 digits.
std::string numbers_text(const PictureNumbers& numbers);
// None if the text is not of that form or a number is not finite.
std::optional<PictureNumbers> parse_numbers(std::string_view text);

// Empty if they agree, else a sentence that says what differs. Ranges agree to 1e-4 of the box or of the colour range: what another
// processor's rounding reaches through a simulation at tolerance 1e-6 is a hundredth of that.
std::string numbers_difference(const PictureNumbers& baseline, const PictureNumbers& candidate);

}  // namespace flexframe::render
