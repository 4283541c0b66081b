// Are two pictures the same? The gate is simple, the measures are for the report.
//
// Gate: equal bytes, or at most `share` of the pixels differ by more than `levels` in some channel. 2/255 and 0.005 % let a
// processor with other vector instructions through (it changes single pixels) and catch a deformation that is 0.1 % off.
// Measures: largest and mean difference, SSIM (Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error
// visibility to structural similarity", 2004, on luma, Gaussian window 11 x 11, sigma 1.5) and FLIP (Andersson, Nilsson,
// Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: a difference evaluator for alternating images", 2020, 67 pixels a degree).
#pragma once

#include "render/image/image.h"

namespace flexframe::render {

struct CompareOptions {
  int levels = 2;           // of 255: differences up to this are none
  double share = 5e-5;      // of the pixels that may differ by more
  bool exact = false;       // only equal pixels pass
  bool measures = true;     // SSIM, FLIP and the heat map, where the pictures are not equal
};

struct ImageDifference {
  bool passes = false;
  bool equal = false;       // every byte of the pixels
  bool same_size = true;    // false: nothing below is measured
  int largest = 0;          // of 255
  double mean = 0.0;        // over channels and pixels, of 255
  long pixels_over = 0;     // with a channel over `levels`
  double share_over = 0.0;
  double ssim = 1.0;        // mean; 1: equal
  double flip = 0.0;        // mean; 0: equal
  Image heat;               // FLIP of each pixel through inferno; empty if not measured
};

// baseline and candidate with 3 or 4 channels; alpha counts in the gate, SSIM and FLIP see the pictures over white.
ImageDifference compare_images(const Image& baseline, const Image& candidate, const CompareOptions& options = {});

// Mean structural similarity and mean FLIP alone; pictures of one size.
double compute_ssim(const Image& a, const Image& b);
double compute_flip(const Image& reference, const Image& test, Image* heat = nullptr);

}  // namespace flexframe::render
