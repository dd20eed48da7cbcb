// Lines of a recording's dwells that go on with one frequency through all of them: a dither's, and what a count makes of it. Drawn as noise of
// a band as wide as a spectrum resolves they would lose their phase within its inverse; the innovations, which sample them once a
// second, tell.
#pragma once

#include <vector>

#include "estimator/diagnosis/regression/corrected_recording.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

struct CoherentLine {
  int axis = 0;  // gyros x, y, z, accelerometers x, y, z
  double frequency_hz = 0.0;
  double amplitude = 0.0;  // rad/s or m/s^2, of the rate itself: the mean over a sample has less
};

struct CoherentLines {
  std::vector<CoherentLine> lines;
  CorrectedRecording without;  // them, in the stretches
};

// `stretches`: samples [first, last) of each that is looked at, all within dwells. Lines stand out of the mean periodogram (Hann) of pieces as
// long as the median stretch, 10 times above what is around, no wider than the window makes them: a frequency to a tenth of a bin. Mean
// square of their amplitudes, fitted stretch by stretch. None above 200 s, where nothing keeps its phase to the bin.
CoherentLines coherent_lines(const ImuData& data, const std::vector<Segment>& stretches);

}  // namespace selfcal::diagnosis
