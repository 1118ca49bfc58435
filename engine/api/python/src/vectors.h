// Vectors and matrices as Python hands them over: float32, or float64.
#pragma once

#include "common.h"

namespace ballot::python {

template <class Number>
using Triples = nb::ndarray<const Number, nb::shape<-1, 3>, nb::device::cpu>;
template <class Number>
using Matrices = nb::ndarray<const Number, nb::shape<-1, 12>, nb::c_contig, nb::device::cpu>;

/// Vectors of three numbers, and the bytes from one to the next: float32, or float64. Keeps the array.
struct Vectors {
  explicit Vectors(const nb::handle& given) {
    if (nb::try_cast(given, in_double, false))
      doubles = read(in_double);
    else
      numbers = read(single = nb::cast<Triples<float>>(given, false));
  }
  std::size_t count() const { return doubles.empty() ? single.shape(0) : in_double.shape(0); }
  Triples<float> single;
  Triples<double> in_double;
  std::size_t stride = 0;
  std::span<const float> numbers;
  std::span<const double> doubles;  // instead

 private:
  template <class Number>
  std::span<const Number> read(const Triples<Number>& array) {
    const std::size_t rows = array.shape(0);
    stride = rows > 1 ? std::size_t(array.stride(0)) * sizeof(Number) : 3 * sizeof(Number);
    if (array.stride(1) != 1 || stride < 3 * sizeof(Number))
      throw Error(BALLOT_ERROR_ARGUMENT,
                  "vectors: the three numbers of a row must lie side by side, and rows must not overlap");
    if (rows == 0) return {};
    return {array.data(), (rows - 1) * (stride / sizeof(Number)) + 3};
  }
};

/// Matrices of instances: float32, or float64. Keeps the array.
struct MatrixArray {
  explicit MatrixArray(const nb::handle& given) {
    if (nb::try_cast(given, in_double, false))
      doubles = {in_double.data(), in_double.size()};
    else
      single = nb::cast<Matrices<float>>(given, false), numbers = {single.data(), single.size()};
  }
  Matrices<float> single;
  Matrices<double> in_double;
  std::span<const float> numbers;
  std::span<const double> doubles;  // instead
};

}  // namespace ballot::python
