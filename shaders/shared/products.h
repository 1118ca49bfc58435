// BALLOT_PRODUCTS: how differences of products are computed without cancellation, and what a device must have for it; see
// lib/numeric/products.glsl.
#ifndef BALLOT_PRODUCTS_H
#define BALLOT_PRODUCTS_H

#define PRODUCTS_SPLIT 0    // nothing
#define PRODUCTS_FLOAT64 1  // shaderFloat64
#define PRODUCTS_FMA 2      // an fma() that rounds once

#endif  // BALLOT_PRODUCTS_H
