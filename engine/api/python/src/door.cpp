#include "door.h"

#include <algorithm>

namespace ballot::python {

namespace {

template <class T>
const T& at(const void* from, std::size_t offset) {
  return *reinterpret_cast<const T*>(static_cast<const char*>(from) + offset);
}
template <class T>
T& at(void* from, std::size_t offset) {
  return *reinterpret_cast<T*>(static_cast<char*>(from) + offset);
}

const door::Row& find(Rows rows, const std::string& name) {
  for (const door::Row& row : rows)
    if (row.name == name) return row;
  throw Error(BALLOT_ERROR_ARGUMENT, name + ": no member of this name");
}

template <class T>
nb::object numbers_of(const void* from, const door::Row& row) {
  const T* all = &at<T>(from, row.offset);
  if (row.count == 1) return nb::cast(all[0]);
  if (row.count == 2) return nb::make_tuple(all[0], all[1]);
  if (row.count == 3) return nb::make_tuple(all[0], all[1], all[2]);
  return nb::cast(array_of(std::vector<T>(all, all + row.count), {row.count / 4, 4}));
}

nb::object value_of(const void* from, const door::Row& row) {
  switch (row.type) {
    case door::Type::Chars: {  // whatever its bytes are
      const char* text = &at<char>(from, row.offset);
      return nb::steal(PyUnicode_DecodeUTF8(text, Py_ssize_t(std::strlen(text)), "replace"));
    }
    case door::Type::Bool:
      return nb::cast(at<BallotBool>(from, row.offset) != 0);
    case door::Type::UInt32:
      return numbers_of<std::uint32_t>(from, row);
    case door::Type::UInt64:
      return numbers_of<std::uint64_t>(from, row);
    case door::Type::Float32:
      return numbers_of<float>(from, row);
    case door::Type::Float64:
      return numbers_of<double>(from, row);
    default:
      throw Error(BALLOT_ERROR_ARGUMENT, std::string(row.name) + " is not read");
  }
}

}  // namespace

Objects tuple_of(const void* from, Rows rows) {
  nb::list all;
  for (const door::Row& row : rows) all.append(value_of(from, row));
  return nb::borrow<Objects>(nb::tuple(all));
}

template <class Struct>
void Options<Struct>::set(void* to, Rows rows, const std::string& name, nb::handle value) const {
  const door::Row& row = find(rows, name);
  switch (row.type) {
    case door::Type::Text:
      at<BallotText>(to, row.offset) = texts_->emplace_back(nb::cast<std::string>(value)).c_str();
      break;
    case door::Type::Bool:
      at<BallotBool>(to, row.offset) = nb::cast<bool>(value);
      break;
    case door::Type::UInt32:
      at<std::uint32_t>(to, row.offset) = nb::cast<std::uint32_t>(value);
      break;
    case door::Type::Float32:
      at<float>(to, row.offset) = nb::cast<float>(value);
      break;
    case door::Type::Float64:
      for (unsigned k = 0; k < row.count; ++k)
        (&at<double>(to, row.offset))[k] = nb::cast<double>(row.count == 1 ? value : nb::handle(nb::object(value[k])));
      break;
    default:
      throw Error(BALLOT_ERROR_ARGUMENT, name + " is not set");
  }
}

template <class Struct>
Columns<Struct>::Columns(const nb::dict& given, Rows rows, std::size_t entries) {
  for (const auto [name, array] : given) set(rows, nb::cast<std::string>(name), array, entries);
  if constexpr (requires { c.values; })
    c.values = values_->data(), c.value_count = values_->size();
  else if (!values_->empty())
    throw Error(BALLOT_ERROR_ARGUMENT, names_->front() + " is no column");
}

/// Takes the array of an attribute.
template <class Struct>
void Columns<Struct>::set_values(const std::string& name, const Array& to, std::size_t entries) {
  if (to.dtype() != nb::dtype<float>()) throw nb::type_error((name + ": the array has another dtype").c_str());
  if (entries ? to.size() % entries != 0 : to.size() != 0)
    throw Error(BALLOT_ERROR_ARGUMENT, name + " has " + std::to_string(to.size()) + " numbers; expected some of each");
  values_->push_back({names_->emplace_back(name).c_str(), static_cast<float*>(to.data())});
}

template <class Struct>
void Columns<Struct>::set(Rows rows, const std::string& name, nb::handle array, std::size_t entries) {
  const Array& to = arrays_.emplace_back(nb::cast<Array>(array, false));
  const auto found = std::ranges::find(rows, name, [](const door::Row& row) { return std::string(row.name); });
  if (found == rows.end()) return set_values(name, to, entries);
  const door::Row& row = *found;
  if (row.type == door::Type::Sums) {
    if (to.dtype() != nb::dtype<double>()) throw nb::type_error((name + ": the array has another dtype").c_str());
    at<BallotSums>(&c, row.offset) = {static_cast<double*>(to.data()), to.size()};
    return;
  }
  const std::size_t count = row.type == door::Type::Hits ? 4 : row.count;
  if (to.size() != entries * count)
    throw Error(BALLOT_ERROR_ARGUMENT,
                name + " has " + std::to_string(to.size()) + " numbers; expected " + std::to_string(entries * count));
  const bool fits = row.type == door::Type::UInt32s   ? to.dtype() == nb::dtype<std::uint32_t>()
                    : row.type == door::Type::Bools   ? to.dtype() == nb::dtype<std::uint8_t>()
                    : row.type == door::Type::Doubles ? to.dtype() == nb::dtype<double>()
                                                      : to.dtype() == nb::dtype<float>();
  if (!fits) throw nb::type_error((name + ": the array has another dtype").c_str());
  at<void*>(&c, row.offset) = to.data();
}

template class Options<BallotQuery>;
template class Options<BallotSceneOptions>;
template class Columns<BallotHits>;
template class Columns<BallotNearest>;
template class Columns<BallotClearance>;

}  // namespace ballot::python
