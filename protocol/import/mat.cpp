// MATLAB's .mat, versions 4, 5 and 7.3, read with matio in a child process: it does not survive every damaged file.
#include <fmt/format.h>
#include <matio.h>

#include <memory>
#include <optional>

#include "protocol/import/array_source.hpp"
#include "protocol/recording/isolated_parse.hpp"

namespace selfcal::import {
namespace {

constexpr std::size_t most_bytes = std::size_t{1} << 35;
constexpr int deepest = 4;  // structures in structures

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};

std::optional<NumberType> type_of(const matvar_t& variable) {
  switch (variable.class_type) {
    case MAT_C_DOUBLE: return NumberType::f8;
    case MAT_C_SINGLE: return NumberType::f4;
    case MAT_C_INT8: return NumberType::i1;
    case MAT_C_INT16: return NumberType::i2;
    case MAT_C_INT32: return NumberType::i4;
    case MAT_C_INT64: return NumberType::i8;
    case MAT_C_UINT8: return NumberType::u1;
    case MAT_C_UINT16: return NumberType::u2;
    case MAT_C_UINT32: return NumberType::u4;
    case MAT_C_UINT64: return NumberType::u8;
    default: return std::nullopt;
  }
}

// Each matrix of real numbers; structures by their fields.
void put_variable(std::string& out, const std::string& name, matvar_t* variable, int depth) {
  if (variable == nullptr || depth > deepest) {
    return;
  }
  if (variable->class_type == MAT_C_STRUCT) {
    const unsigned fields = Mat_VarGetNumberOfFields(variable);
    char* const* names = Mat_VarGetStructFieldnames(variable);
    for (unsigned k = 0; k < fields && names != nullptr; ++k) {
      put_variable(out, name + "." + names[k], Mat_VarGetStructFieldByIndex(variable, k, 0), depth + 1);
    }
    return;
  }
  const auto type = type_of(*variable);
  if (!type || variable->isComplex != 0 || variable->rank != 2 || variable->data == nullptr) {
    return;
  }
  const std::size_t rows = variable->dims[0];
  const std::size_t columns = variable->dims[1];
  const std::size_t size = size_of(*type);
  if (rows == 0 || columns == 0 || rows > most_bytes / size / columns || variable->nbytes != rows * columns * size) {
    return;
  }
  constexpr bool column_major = true;
  put_array(out, name, *type, {rows, columns, column_major},
            {static_cast<const char*>(variable->data), variable->nbytes});
}

Expected<std::string> variables_of(const std::string& file) {
  const std::unique_ptr<mat_t, CloseFile> open(Mat_Open(file.c_str(), MAT_ACC_RDONLY));
  if (!open) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot read as .mat", file));
  }
  std::string out;
  while (const std::unique_ptr<matvar_t, FreeVariable> variable{Mat_VarReadNext(open.get())}) {
    put_variable(out, variable->name == nullptr ? "" : variable->name, variable.get(), 0);
    if (out.size() > most_bytes) {
      return fail(ErrorKind::bad_input, fmt::format("{}: more than {} bytes of numbers", file, most_bytes));
    }
  }
  return out;
}

}  // namespace

Expected<Arrays> read_mat(const std::filesystem::path& file) {
  Expected<std::string> bytes = bytes_isolated(file.string(), [&file] { return variables_of(file.string()); });
  if (!bytes) {
    return tl::unexpected(bytes.error());
  }
  if (bytes->empty()) {  // written as HDF5 by another program, whose arrays do not say their class as MATLAB's do
    Expected<Arrays> others = read_hdf5_arrays(file);
    if (others && !others->columns.empty()) {
      return others;
    }
  }
  Arrays arrays;
  arrays.form = "MATLAB .mat";
  add_arrays(std::move(*bytes), arrays);
  return arrays;
}

}  // namespace selfcal::import
