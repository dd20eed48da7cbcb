// Lines that a coarse quantum makes of a steady rate. Private to this folder.
#pragma once

namespace selfcal::diagnosis {

// An axis in a dwell: its mean rate (rad/s or m/s^2) counted in quanta (rad or m/s; 0: none) whose remainders are carried on.
struct CountedRate {
  double mean_rate = 0.0;
  double wanders = 0.0;  // either side of the mean
  double quantum = 0.0;
  double sample_rate_hz = 0.0;
};

// Whether the remainders make a line of this frequency, to `width_hz`, and at least `amplitude` (of the rate, as its unit). The remainder is a
// saw's tooth of one quantum and mean_rate/quantum cycles a second; its k-th harmonic is an angle or a velocity of quantum/(pi k), and is
// folded at half the sampling rate; where the rate wanders it is k times as wide.
bool beat_of_quantum(const CountedRate& counted, double frequency_hz, double amplitude, double width_hz);

}  // namespace selfcal::diagnosis
