// Each map is 33 control points joined by a Catmull-Rom curve; within 2/255 of the published maps (cividis 5/255 in one blue corner).
#include "render/picture/colormap.h"

#include "render/picture/picture.h"

#include <algorithm>
#include <cmath>

namespace flexframe::render {
namespace {

constexpr int points = 33;
struct Point {
  short r, g, b;
};  // sRGB, thousandths
using Table = std::array<Point, points>;

constexpr Table viridis_points = {{{267, 5, 329},   {277, 50, 376},  {282, 95, 417},  {283, 135, 453}, {279, 175, 483}, {271, 213, 507},
                                   {259, 251, 524}, {245, 287, 537}, {230, 321, 545}, {215, 354, 551}, {200, 386, 555}, {186, 417, 557},
                                   {173, 447, 558}, {161, 477, 558}, {150, 506, 557}, {138, 536, 555}, {128, 565, 551}, {121, 594, 544},
                                   {120, 624, 534}, {131, 653, 521}, {155, 682, 503}, {193, 710, 481}, {241, 737, 455}, {299, 762, 423},
                                   {363, 787, 387}, {433, 809, 345}, {508, 829, 299}, {587, 847, 249}, {669, 862, 195}, {753, 875, 143},
                                   {836, 886, 102}, {917, 896, 101}, {993, 906, 144}}};

constexpr Table cividis_points = {{{0, 135, 305},   {0, 158, 357},   {0, 179, 414},   {17, 198, 441},  {102, 220, 436}, {153, 242, 430},
                                   {194, 264, 426}, {230, 286, 424}, {263, 307, 423}, {294, 329, 424}, {323, 350, 426}, {352, 372, 430},
                                   {380, 394, 435}, {407, 416, 442}, {434, 439, 451}, {460, 461, 461}, {487, 484, 471}, {516, 507, 473},
                                   {546, 530, 472}, {576, 554, 469}, {607, 578, 464}, {638, 602, 457}, {669, 627, 449}, {701, 652, 438},
                                   {733, 678, 425}, {766, 704, 410}, {799, 731, 392}, {833, 759, 371}, {867, 786, 346}, {902, 815, 317},
                                   {937, 844, 281}, {973, 874, 234}, {996, 909, 218}}};

constexpr Table inferno_points = {{{1, 0, 14},      {14, 11, 72},    {42, 28, 141},   {81, 43, 214},   {128, 47, 290},  {182, 40, 354},
                                   {237, 37, 396},  {289, 45, 418},  {340, 62, 429},  {390, 80, 433},  {439, 99, 432},  {489, 116, 426},
                                   {539, 134, 416}, {588, 152, 401}, {637, 170, 382}, {686, 191, 359}, {733, 214, 332}, {778, 241, 302},
                                   {820, 273, 269}, {858, 309, 233}, {892, 350, 197}, {921, 395, 158}, {945, 445, 119}, {964, 497, 78},
                                   {977, 553, 38},  {985, 610, 25},  {988, 669, 60},  {985, 730, 122}, {976, 791, 197}, {962, 852, 287},
                                   {949, 911, 396}, {952, 961, 525}, {988, 998, 645}}};

constexpr Table turbo_points = {{{190, 72, 232},  {225, 163, 450}, {251, 252, 632}, {268, 337, 779}, {276, 420, 890}, {276, 500, 965},
                                 {259, 578, 999}, {215, 657, 981}, {160, 733, 925}, {113, 803, 848}, {93, 863, 765},  {118, 910, 690},
                                 {192, 947, 599}, {299, 976, 495}, {421, 994, 391}, {540, 999, 300}, {638, 991, 236}, {721, 967, 207},
                                 {799, 928, 204}, {870, 877, 215}, {929, 817, 226}, {971, 752, 226}, {992, 681, 206}, {996, 595, 172},
                                 {985, 502, 132}, {961, 408, 92},  {925, 323, 58},  {880, 252, 35},  {823, 191, 19},  {755, 137, 9},
                                 {675, 89, 4},    {583, 49, 5},    {480, 16, 11}}};

constexpr Table coolwarm_points = {{{230, 299, 754}, {266, 353, 801}, {304, 407, 845}, {343, 459, 884},  {383, 509, 917}, {424, 558, 946},
                                    {467, 605, 968}, {510, 648, 985}, {553, 689, 995}, {596, 726, 1000}, {639, 759, 998}, {681, 789, 990},
                                    {722, 814, 976}, {761, 834, 957}, {799, 850, 932}, {833, 860, 901},  {865, 865, 865}, {898, 849, 821},
                                    {924, 827, 774}, {944, 801, 727}, {959, 770, 678}, {967, 734, 629},  {970, 694, 579}, {967, 650, 530},
                                    {958, 603, 482}, {944, 552, 434}, {924, 497, 388}, {899, 440, 343},  {869, 378, 300}, {835, 313, 259},
                                    {796, 241, 221}, {753, 157, 184}, {706, 16, 150}}};

constexpr std::array<std::string_view, 6> names = {"viridis", "cividis", "inferno", "turbo", "coolwarm", "greys"};

const Table& table_of(Colormap map) {
  switch (map) {
    case Colormap::cividis:
      return cividis_points;
    case Colormap::inferno:
      return inferno_points;
    case Colormap::turbo:
      return turbo_points;
    case Colormap::coolwarm:
      return coolwarm_points;
    default:
      return viridis_points;
  }
}

glm::dvec3 value(const Table& table, int i) {
  const auto at = [&](int k) { return glm::dvec3(table[k].r, table[k].g, table[k].b) / 1000.0; };
  if (i < 0) return 2.0 * at(0) - at(1);
  if (i >= points) return 2.0 * at(points - 1) - at(points - 2);
  return at(i);
}

// Grey of CIE lightness L in 0..100.
double grey_of_lightness(double lightness) {
  const double f = (lightness + 16.0) / 116.0;
  const double y = lightness > 8.0 ? f * f * f : lightness / 903.3;
  return y <= 0.0031308 ? 12.92 * y : 1.055 * std::pow(y, 1.0 / 2.4) - 0.055;
}

}  // namespace

std::vector<std::string_view> colormap_names() { return {names.begin(), names.end()}; }

glm::vec3 colormap_color(Colormap map, double t) {
  if (std::isnan(t)) return glm::vec3(0.5f);
  t = std::clamp(t, 0.0, 1.0);
  if (map == Colormap::greys) return glm::vec3(static_cast<float>(grey_of_lightness(8.0 + 88.0 * t)));
  const Table& table = table_of(map);
  const double x = t * (points - 1);
  const int i = std::min(static_cast<int>(x), points - 2);
  const double f = x - i;
  const glm::dvec3 p0 = value(table, i - 1), p1 = value(table, i), p2 = value(table, i + 1), p3 = value(table, i + 2);
  const glm::dvec3 c = p1 + 0.5 * f * (p2 - p0 + f * (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + f * (3.0 * (p1 - p2) + p3 - p0)));
  return glm::vec3(glm::clamp(c, 0.0, 1.0));
}

glm::vec3 category_color(int index) {
  // Found by a search: any two are at least 24 apart in CIELAB, the first four 33, for full sight and for want of red, green or blue
  // cones (Machado, Oliveira, Fernandes, "A physiologically-based model for simulation of color vision deficiency", 2009).
  static constexpr std::array<std::array<int, 3>, 10> colors = {{{31, 98, 168},
                                                                 {245, 97, 14},
                                                                 {162, 119, 85},
                                                                 {130, 12, 73},
                                                                 {128, 42, 235},
                                                                 {242, 126, 177},
                                                                 {245, 181, 161},
                                                                 {84, 66, 16},
                                                                 {191, 196, 99},
                                                                 {21, 177, 244}}};
  const auto& c = colors[(index % 10 + 10) % 10];
  const glm::vec3 color = glm::vec3(c[0], c[1], c[2]) / 255.0f;
  // Of equal colours nobody knows which is which; these are 14 apart at least.
  const int ten = (index % 30 + 30) % 30 / 10;
  return ten == 1 ? glm::mix(color, glm::vec3(1.0f), 0.4f) : ten == 2 ? 0.55f * color : color;
}

glm::vec3 map_color(const ScalarMap& map, double share) {
  if (map.levels > 1) share = (std::min(std::floor(std::clamp(share, 0.0, 1.0) * map.levels), map.levels - 1.0) + 0.5) / map.levels;
  const glm::vec3 color = colormap_color(map.colormap, share);
  return map.lightened ? 0.13f + 0.84f * color : color;
}

double scalar_share(const ScalarMap& map, double value) {
  if (map.logarithmic && map.lower > 0.0 && map.upper > map.lower)
    return value > 0.0 ? std::log(value / map.lower) / std::log(map.upper / map.lower) : -1e30;
  const double range = map.upper - map.lower;
  return range != 0.0 ? (value - map.lower) / range : 0.5;
}

glm::vec3 scalar_color(const ScalarMap& map, double value) {
  if (!std::isfinite(value)) return glm::vec3(0.5f);
  return map_color(map, std::clamp(scalar_share(map, value), 0.0, 1.0));
}

}  // namespace flexframe::render
