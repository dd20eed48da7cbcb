// Slow lines of the sensors themselves (beats of a dither, of a power supply), taken out of the dwells.
#pragma once

#include "estimator/diagnosis/noise/noise_check.hpp"
#include "estimator/diagnosis/regression/signature_pass.hpp"

namespace selfcal::diagnosis {

// Subtracts from increments of the recording (rad, m/s) every sinusoid from 0.1 to 2 Hz that stands out of the spectrum
// of a dwell of a sensor axis: fitted together with mean and slope, dwell by dwell, so that a bias, a drift or a
// relaxation stays; the beats of `quanta` as well. A gyro's line with which gravity turns is the base's, and stays: without it the attitude at the
// dwell's end would be another. Returns each line at its strongest, amplitudes in rad/s and m/s^2.
std::vector<VibrationLine> subtract_dwell_lines(const ImuData& data, const std::vector<Segment>& segments,
                                                const Quanta& quanta, AngleVelocity& delta_theta,
                                                AngleVelocity& delta_v);

}  // namespace selfcal::diagnosis
