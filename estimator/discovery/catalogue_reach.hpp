// How much of what laws make an effect of the catalogue can make: whether a name may stand in their place at all.
#pragma once

#include <Eigen/Core>
#include <stop_token>
#include <vector>

#include "estimator/diagnosis/effects/effect.hpp"
#include "estimator/discovery/column_pass.hpp"
#include "estimator/discovery/discovery.hpp"

namespace selfcal::discovery {

class CatalogueReach {
 public:
  // One pass over the recording: columns of the laws, and of each effect of a sensor at each value that its constant is tried at.
  CatalogueReach(const UnitRecording& recording, const std::vector<LawTerm>& laws, const Eigen::VectorXd& coefficient,
                 const std::stop_token& stop = {});

  // Largest share of the square of the sum of the laws for which `in_place_of` says so that one effect takes up, fitted anew. 0: of none.
  double share(const std::vector<bool>& in_place_of) const;
  // The same of this effect, and of the sum that it makes best.
  double largest_share(const diagnosis::Effect& effect) const;

 private:
  struct Variant {
    const diagnosis::Effect* effect = nullptr;
    std::vector<int> columns;
  };
  double share(const Variant& variant, const Eigen::VectorXd& signature) const;

  Eigen::VectorXd coefficient_;
  std::vector<Variant> variants_;
  ColumnSums sums_;
};

}  // namespace selfcal::discovery
