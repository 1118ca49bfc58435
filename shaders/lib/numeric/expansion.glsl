// Sums of products without rounding, as expansions: Jonathan Richard Shewchuk. Adaptive Precision Floating-Point
// Arithmetic and Fast Robust Geometric Predicates. Discrete & Computational Geometry 18, 1997.

// Replaces terms by parts that have the same sum and do not overlap: zeros alone if that is zero.
void expand(inout double terms[6]) {
  for (uint i = 0u; i < 6u; ++i) {
    precise double sum = terms[i];
    for (uint k = 0u; k < i; ++k) {
      precise double next = sum + terms[k], other = next - sum;
      precise double part = (sum - (next - other)) + (terms[k] - other);
      terms[k] = part;
      sum = next;
    }
    terms[i] = sum;
  }
}
