// How much of what laws make an effect of the catalogue can make: whether a name may stand in their place at all; and what effects and laws together
// make of the recording.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <stop_token>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
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

  // An effect and one of the laws, both fitted anew beside what is named and was taken out (`recording.beside`): what the recording's square
  // falls by, and by how much less for the law alone.
  struct BesideOneLaw {
    diagnosis::ModelEffect effect;
    double gain = 0.0, more = 0.0;
  };
  // Each effect of a sensor with the constant and the law that go with it best, largest gain first.
  std::vector<BesideOneLaw> beside_one_law() const;
  // What the recording's square falls by where all laws are fitted anew, beside the same.
  double gain_of_laws() const;

 private:
  struct Variant {
    const diagnosis::Effect* effect = nullptr;
    double constant = NAN;
    std::vector<int> columns;
  };
  double share(const Variant& variant, const Eigen::VectorXd& signature) const;
  double gain_beside_named(std::vector<int> columns) const;

  Eigen::VectorXd coefficient_;
  std::vector<Variant> variants_;
  std::vector<int> named_;  // columns of recording.beside
  ColumnSums sums_;
};

}  // namespace selfcal::discovery
