// The Allan deviation of each sensor and the noise terms fitted to it.
'use strict';

// A term is drawn where it makes at least this part of the fitted variance: the lines then show which one rules where.
const drawnPart = 0.03;
const termStyles = {
  'quantisation': {colour: 'z', dash: [2, 3]},
  'random walk': {colour: 'y', dash: [8, 4]},
  'bias instability': {colour: 'z', dash: [10, 3, 2, 3]},
  'rate random walk': {colour: 'y', dash: [3, 3]},
  'ramp': {colour: 'faint', dash: [6, 3]},
};

const deviationOf = (term, tau) => term.at_one_second * tau ** term.slope;

function allanPlot(place, allan, sensor, index) {
  const gyro = index < 3;
  const values = (gyro ? allan.gyro_deg_per_h : allan.accel_ug)[index % 3];
  const tau = allan.tau_s;
  const terms = listOf(sensor.terms);
  const whole = tau.map((at) => Math.hypot(...terms.map((term) => deviationOf(term, at))));
  addPlot(place, {
    id: `allan-${gyro ? 'gyro' : 'accel'}-${axisColours[index % 3]}`,
    title: textOf(sensor.sensor),
    height: 260,
    x: {label: 'averaging time', unit: 's', log: true, values: tau},
    y: {label: 'Allan deviation', unit: gyro ? 'deg/h' : 'ug', log: true},
    series: [
      {label: 'measured, ±1 σ', colour: 'x', points: true, small: true, values: values.map((v) => (v > 0 ? v : null)),
       errors: values.map((value, k) => numberOrNull(value * allan.relative_sigma?.[k]))},
      ...(terms.length > 1 ? [{label: 'sum of the terms', colour: 'text', thin: true, values: whole}] : []),
      ...terms.map((term) => ({label: `${term.name} ${withSigma(term.value, term.sigma)} ${term.unit}`, ...termStyles[term.kind],
        values: tau.map((at, k) => deviationOf(term, at)),
        shown: tau.map((at, k) => (deviationOf(term, at) ** 2 >= drawnPart * whole[k] ** 2 ? deviationOf(term, at) : null))})),
    ],
  });
}

// One row a sensor, one column a term: what an IMU's data sheet states.
function noiseTable(sensors, id) {
  const kinds = [...new Set(sensors.flatMap((s) => listOf(s.known).map((k) => k.kind)))];
  const columns = kinds.map((kind) => {
    const known = sensors[0].known.find((k) => k.kind === kind);
    return {title: `${known.name} (${known.unit})`, cells: sensors.map((s) => {
      const term = listOf(s.terms).find((t) => t.kind === kind);
      return term ? withSigma(term.value, term.sigma) : element('span', {class: 'faint'}, '–');
    })};
  });
  return table([{title: 'sensor', cells: sensors.map((s) => textOf(s.sensor)), class: 'left'}, ...columns,
                {title: 'misfit (1 expected)', cells: sensors.map((s) => significant(s.misfit, 2))}], {id});
}

function showAllan(report) {
  const place = document.getElementById('allan-plots');
  const allan = objectOf(report.allan);
  const sensors = listOf(allan.sensors);
  if (listOf(allan.tau_s).length === 0 || sensors.length !== 6) {
    place.append(element('p', {}, 'No dwell was long enough for an Allan deviation.'));
    return;
  }
  document.getElementById('noise-table').append(noiseTable(sensors.slice(0, 3), 'gyro-noise'), noiseTable(sensors.slice(3), 'accel-noise'),
      element('p', {class: 'note'}, 'Parts of the Allan variance at averaging time τ: quantisation 3Q²/τ², random walk N²/τ, bias '
      + 'instability (2 ln 2/π) B², rate random walk K²τ/3, ramp R²τ²/2. A dash: the dwells are too short, or the term too '
      + 'small, to tell it from the others.'));
  sensors.forEach((sensor, index) => allanPlot(place, allan, sensor, index));
}
