#include "protocol/recording/hdf5_handle.hpp"

namespace selfcal::hdf5 {

QuietErrors::QuietErrors() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

QuietErrors::~QuietErrors() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

std::string last_error() {
  std::string cause = "unknown cause";
  // Upward: the innermost call, where it began, comes first.
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* error, void* text) -> herr_t {
        if (n == 0 && error->desc != nullptr) {
          *static_cast<std::string*>(text) = error->desc;
        }
        return 0;
      },
      &cause);
  return cause;
}

}  // namespace selfcal::hdf5
