// Are two pictures the same? The gate is simple, the measures are for the report.
//
// Gate: equal values, or all of: at most `share` of the pixels differ by more than `levels` in some channel; nowhere do `cluster` pixels
// that touch (also by a corner) differ by more than `cluster_levels`, or such a group by `weight` levels in all (a decimal point that is
// gone), or `faint` touching pixels by more than `faint_levels` (a pale line); the mean difference is at most `mean`, and in no field of
// 64 x 64 pixels are all lighter or darker by `local` in a channel, in the mean. A processor with other vector
// instructions changes single pixels by a few levels and passes; a minus sign that is gone, a small patch of another colour, a shift of
// every pixel by two levels, a deformation 0.1 % off do not. The table of pairs that the gate is made from: tests/unit/render_compare.cpp.
// Pictures of 16 bits (depth, scalar) are compared in their own units, by `Gate16`.
// Measures: largest and mean difference, SSIM (Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error
// visibility to structural similarity", 2004, on luma, Gaussian window 11 x 11, sigma 1.5) and FLIP (Andersson, Nilsson,
// Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: a difference evaluator for alternating images", 2020, 67 pixels a degree).
#pragma once

#include "render/image/image.h"

#include <limits>
#include <span>
#include <string>

namespace flexframe::render {

// Limits in units of a picture's own values (255 or 65535 is full).
struct Gate {
  int levels = 2;           // differences up to this are none
  double share = 5e-5;      // of the pixels that may differ by more
  int cluster_levels = 16;  // pixels that differ by more than this
  int cluster = 4;          // may not touch in such a number
  double mean = 0.1;        // over channels and pixels
  long weight = 160;        // sum of the differences of pixels that touch and differ by more than cluster_levels
  int faint_levels = 7;     // other processors' single pixels stay below
  int faint = 8;            // pixels that differ by more than that may not touch in such a number
  double local = 0.75;      // mean of the signed difference over a field
};
// 16 bits: a pixel of another processor's depth is off by a few units of rounding; 256 units are 0.4 % of the range. A single pixel of a
// silhouette may fall the other way by the whole range.
inline constexpr Gate gate16{.levels = 32,
                             .share = 5e-5,
                             .cluster_levels = 256,
                             .cluster = 4,
                             .mean = 8.0,
                             .weight = std::numeric_limits<long>::max(),
                             .faint_levels = 256,
                             .faint = 4,
                             .local = std::numeric_limits<double>::infinity()};

struct CompareOptions {
  Gate gate{};           // of pictures with 8 bits
  Gate deep = gate16;    // of pictures with 16 bits
  bool exact = false;    // only equal pixels pass
  bool measures = true;  // SSIM, FLIP and the heat map, where the pictures are not equal
  // One byte a pixel, row by row from the top: pixels with another value than 0 are not looked at. Empty: all are.
  std::span<const std::uint8_t> ignored{};
};

// A rectangle of pixels; x, y: its upper left corner from that of the picture.
struct PixelBox {
  int x = 0, y = 0, width = 0, height = 0;
  bool operator==(const PixelBox&) const = default;
};

struct ImageDifference {
  bool passes = false;
  bool equal = false;     // every byte of the pixels
  bool same_size = true;  // false: nothing below is measured
  bool measured = false;  // SSIM and FLIP
  int full = 255;         // 65535 where the pictures have 16 bits
  int largest = 0;        // of `full`
  double mean = 0.0;      // over channels and pixels, of `full`
  long pixels_over = 0;   // with a channel over `levels`
  long cluster = 0;       // most pixels over `cluster_levels` that touch one another
  std::string broken;     // where it does not pass: which of the gate's limits
  long ignored = 0;       // pixels that were not looked at; shares and means are those of the others
  PixelBox box;           // the smallest with all pixels over `levels`, or with all that differ where none is
  double share_over = 0.0;
  double ssim = 1.0;  // mean over the whole picture; 1: equal
  double flip = 0.0;  // likewise; 0: equal
  Image heat;         // FLIP of each pixel through inferno; empty if not measured
};

// Calls visit(name, number) for what was measured: the names that JSON and Python have.
template <class Visit>
void for_each_number(const ImageDifference& d, Visit&& visit) {
  visit("largest", d.largest);
  visit("full", d.full);
  visit("mean", d.mean);
  visit("cluster", d.cluster);
  visit("pixels_over", d.pixels_over);
  visit("share_over", d.share_over);
  visit("ssim", d.ssim);
  visit("flip", d.flip);
}

// baseline and candidate with 3 or 4 channels; alpha counts in the gate, SSIM and FLIP see the pictures over white, equal where they are
// ignored. Throws ArgumentError if `ignored` is neither empty nor of the pictures' size, or leaves nothing to look at.
ImageDifference compare_images(const Image& baseline, const Image& candidate, const CompareOptions& options = {});
// One channel each; no SSIM and no FLIP: they are measures of what an eye sees. The heat map shows the difference over the largest one.
ImageDifference compare_images(const Image16& baseline, const Image16& candidate, const CompareOptions& options = {});

// The part of a picture in a box. Throws ArgumentError if it reaches beyond the picture.
Image cut_out(const Image& image, const PixelBox& box);

// Mean structural similarity and mean FLIP alone; pictures of one size.
double compute_ssim(const Image& a, const Image& b);
double compute_flip(const Image& reference, const Image& test, Image* heat = nullptr);

}  // namespace flexframe::render
