// Columns of files that hold arrays: NumPy, MATLAB.
#pragma once

#include <cstdint>
#include <span>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

enum class NumberType { f4, f8, i1, i2, i4, i8, u1, u2, u4, u8 };

std::size_t size_of(NumberType type);

// A column inside a block of bytes.
struct RawColumn {
  std::string name;
  NumberType type = NumberType::f8;
  bool big_endian = false;
  std::size_t block = 0;   // which of the blocks
  std::size_t offset = 0;  // of its first number, in bytes
  std::size_t stride = 0;  // from one number to the next
  std::size_t rows = 0;
};

struct Arrays {
  std::string form;                 // "NumPy .npz"
  std::vector<std::string> blocks;  // bytes
  std::vector<RawColumn> columns;
};

// Columns of an array of ROWS x COLUMNS, named NAME, or NAME.x NAME.y NAME.z where there are three, else NAME.1 and so on. Of
// an array that lies on its side (few rows, many columns) each row is a column.
struct ArrayShape {
  std::size_t rows = 0;
  std::size_t columns = 1;
  bool column_major = false;
};
void add_array(const std::string& name, NumberType type, bool big_endian, const ArrayShape& shape, std::size_t block,
               std::size_t offset, Arrays& arrays);

// An array as a child process hands it over: name, type, shape, bytes.
void put_array(std::string& out, const std::string& name, NumberType type, const ArrayShape& shape,
               std::string_view bytes);
// All that stand in what our own child wrote.
void add_arrays(std::string block, Arrays& arrays);

// Keeps the columns of the length that most of them have; what else there is (scalars, other rates) is left out and
// named in form(). An error (bad_input) where nothing is left.
Expected<std::unique_ptr<ColumnSource>> array_source(Arrays arrays, const std::string& file);

// One .npy image: appends its columns; NAME is empty for a file of its own. Errors name FILE.
Expected<void> add_npy(std::string image, const std::string& name, const std::string& file, Arrays& arrays);

// The whole file; nullopt: this program was built without.
Expected<Arrays> read_npz(const std::filesystem::path& file);
Expected<Arrays> read_mat(const std::filesystem::path& file);
// An HDF5 file of any program: data sets of real numbers with one or two dimensions by their paths, tables by their members, units by an attribute.
Expected<Arrays> read_hdf5_arrays(const std::filesystem::path& file);

}  // namespace selfcal::import
