// Values of BALLOT_PRODUCTS: how a kernel computes differences of products without cancellation, and what the device
// must support for it. See lib/numeric/products.glsl.
#ifndef BALLOT_PRODUCTS_H
#define BALLOT_PRODUCTS_H

#define PRODUCTS_SPLIT 0    // no requirement
#define PRODUCTS_FLOAT64 1  // shaderFloat64
#define PRODUCTS_FMA 2      // an fma() that rounds once

#endif  // BALLOT_PRODUCTS_H
