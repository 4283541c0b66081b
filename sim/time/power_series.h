// Taylor series of w' = (A + t A1) p + B w + load, p' = w + load: products of a small matrix with one vector after another, all in
// registers as wide as the processor has them; every number is computed by the same operations in the same order, whatever their width.
#pragma once

namespace flexframe::sim {

// Columns of 2 rows numbers: those of w, padded with zeros to `rows`, and those of p likewise. Times are shares of `length` (s).
struct PowerSeries {
  int n = 0, rows = 0;  // rows: a multiple of 8, n or more
  double length = 0.0;
  const double* matrix = nullptr;   // rows x 3 n: length A1, B, A at the beginning
  const double* loads = nullptr;    // three columns: powers 0, 1, 2 of the share
  const double* weights = nullptr;  // rows numbers, zero beyond n
  double negligible = 0.0;          // a term whose weighted numbers of w are all below that
};

// Fills terms: a column of zeros, the state at the beginning (both set by the caller), and a column for each power of the share, until two
// terms in a row are negligible. Returns how many columns stand behind the first one, 0 where most_terms powers do not do.
int expand(const PowerSeries& series, int most_terms, double* terms);

// Of the columns at `terms`, which stand `stride` numbers apart, the first `size` numbers each.
struct Powers {
  const double* terms;
  int stride, size, count;
};
// out = sum over the columns of column k times x^k.
void evaluate_powers(const Powers& powers, double x, double* out);
// At four x at once, a column of `size` each; size: a multiple of 8.
void evaluate_powers_four(const Powers& powers, const double* x, double* out);

}  // namespace flexframe::sim
