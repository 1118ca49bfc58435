// Structs of the C interface that Python fills and reads, by their rows.
#pragma once

#include <deque>
#include <span>

#include "common.h"
#include "door_rows.h"  // made by door.py

namespace ballot::python {

using Rows = std::span<const door::Row>;

/// The numbers of a struct as Python gets them: texts, numbers, tuples of three, arrays of more.
Objects tuple_of(const void* from, Rows rows);

/// A struct of the C interface that Python's options have filled, by name and of the right types: ballot/_query.py
/// checks them. Copies share the texts.
template <class Struct>
class Options {
 public:
  Options(const nb::dict& given, Rows rows) : texts_(std::make_shared<std::deque<std::string>>()) {
    for (const auto [name, value] : given) set(&c, rows, nb::cast<std::string>(name), value);
  }
  Struct c;

 private:
  void set(void* to, Rows rows, const std::string& name, nb::handle value) const;
  std::shared_ptr<std::deque<std::string>> texts_;
};

/// Arrays that results go to, by the names of columns and attributes. Keeps them. Copies share the names.
template <class Struct>
class Columns {
 public:
  /// `entries`: of each column. Throws Error if an array has not as many.
  Columns(const nb::dict& given, Rows rows, std::size_t entries);
  Struct c;

 private:
  using Array = nb::ndarray<nb::ndim<1>, nb::c_contig, nb::device::cpu>;
  void set(Rows rows, const std::string& name, nb::handle array, std::size_t entries);
  void set_values(const std::string& name, const Array& to, std::size_t entries);
  std::vector<Array> arrays_;
  std::shared_ptr<std::deque<std::string>> names_ = std::make_shared<std::deque<std::string>>();
  std::shared_ptr<std::vector<BallotValues>> values_ = std::make_shared<std::vector<BallotValues>>();
};

}  // namespace ballot::python
