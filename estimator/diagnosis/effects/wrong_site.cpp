// The site's latitude is another: the Earth's rate points elsewhere. No physics of the sensors, a fault of the data.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  const Vector3 n = c.C_nb * c.earth_rate_b;  // cos, sin of the latitude, 0
  const Vector3 by_latitude = earth::rotation_rate * Vector3(-n.y(), n.x(), 0.0);
  angle.col(0) += c.C_nb.transpose() * by_latitude * c.dt;
}

}  // namespace

Effect wrong_site() {
  Effect e;
  e.id = "wrong_site";
  e.equation = "dw = dOmega/dlatitude * (latitude - the site's)";
  e.excited = "dwells, by the Earth rate's angle to gravity";
  e.experiment = "the site's coordinates, looked up again";
  e.parameters = {{"latitude", "deg", units::degree, 0.01}};
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
