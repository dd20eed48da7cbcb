// What is plotted.
'use strict';

const axisColours = ['x', 'y', 'z'];
const axisDashes = [undefined, [8, 4], [2, 3]];   // told apart without colour too

// The virtual time of the passes laid end to end, in minutes, with a gap (null) between passes.
function passAxis(report) {
  const axis = {minutes: [], passOf: [], epochOf: [], marks: []};
  let offset = 0;
  report.passes.forEach((pass, number) => {
    if (pass.epoch_s.length === 0) {
      return;
    }
    const begin = Math.min(...pass.epoch_s);
    const end = Math.max(...pass.epoch_s);
    const worked = pass.epoch_s.map((at, epoch) => ({epoch, at: pass.direction === 'forward' ? at - begin : end - at}));
    worked.sort((a, b) => a.at - b.at);
    if (number > 0) {
      axis.marks.push(offset / 60);
      axis.minutes.push(offset / 60);
      axis.passOf.push(null);
      axis.epochOf.push(null);
    }
    for (const {epoch, at} of worked) {
      axis.minutes.push((offset + at) / 60);
      axis.passOf.push(number);
      axis.epochOf.push(epoch);
    }
    offset += end - begin;
  });
  return axis;
}

// Wide enough for the 3 sigma band over the later part of each pass. Every pass starts from ignorance, where the band
// is thousands of times wider: shown whole, the end would be a flat line.
function convergenceRange(sigmas, final, sigma) {
  const sorted = sigmas.filter((value) => value !== null).sort((a, b) => a - b);
  const later = sorted.length > 0 ? sorted[Math.floor(0.3 * (sorted.length - 1))] : 0;
  const half = Math.max(8 * sigma, 4 * later, 1e-12);
  return [final - half, final + half];
}

function showConvergence(report) {
  const place = document.getElementById('convergence-plots');
  const axis = passAxis(report);
  report.parameters.forEach((parameter, index) => later(() => {
    const pick = (key) => axis.passOf.map(
        (pass, row) => (pass === null ? null : report.passes[pass][key][axis.epochOf[row]][index]));
    const values = pick('epoch_values');
    const sigmas = pick('epoch_sigmas');
    const range = convergenceRange(sigmas, parameter.value, parameter.sigma);
    // Drawn once the band has come near the picture: before that the estimate is noise a thousand times its height.
    const near = (list) => list.map((value, row) => (sigmas[row] !== null && 3 * sigmas[row] < range[1] - range[0] ? value : null));
    const at = (sign) => values.map((value, row) => (value === null ? null : value + sign * 3 * sigmas[row]));
    addPlot(place, {
      id: 'convergence-' + parameter.name,
      title: parameter.name,
      x: {label: 'time worked through', unit: 'min', values: axis.minutes},
      y: {label: 'estimate', unit: parameter.unit, range},
      series: [{label: 'estimate', colour: 'x', values, shown: near(values)},
               {label: '+3 σ', colour: 'x', thin: true, dash: [3, 3], values: at(1), shown: near(at(1))},
               {label: '−3 σ', colour: 'x', thin: true, dash: [3, 3], values: at(-1), shown: near(at(-1))}],
      band: [2, 3],
      marks: axis.marks,
    });
  }));
}

function showNis(report) {
  const middle = (segment) => (segment.start_s + segment.end_s) / 120;
  const counted = report.segments.filter((segment) => segment.epochs > 0);
  const values = (kind) => counted.map((segment) => (segment.kind === kind ? segment.nis_mean : null));
  const top = Math.max(2, 1.15 * Math.max(...counted.map((segment) => segment.nis_mean)));
  addPlot(document.getElementById('nis-plot'), {
    id: 'nis',
    title: 'Normalised innovation squared, each dwell and rotation (1 expected)',
    x: {label: 'time', unit: 'min', values: counted.map(middle)},
    y: {label: 'NIS per degree of freedom', unit: '1', range: [0, top]},
    series: [{label: 'dwell', colour: 'x', points: true, values: values('dwell')},
             {label: 'rotation', colour: 'y', points: true, values: values('rotation')}],
    level: 1,
  });
}

// A thousand points a line: the mean of each stretch would hide what the picture is for, so every k-th is shown.
function showInnovations(report) {
  const all = report.innovations;
  const step = Math.ceil(all.time_s.length / 1500);
  const thin = (list) => list.filter((_, k) => k % step === 0);
  addPlot(document.getElementById('innovation-plot'), {
    id: 'innovations',
    title: 'Innovations of the last answer over their predicted σ (unit variance expected; dotted: ±3 σ)',
    x: {label: 'time', unit: 'min', values: thin(all.time_s).map((at) => at / 60)},
    y: {label: 'innovation / σ', unit: '1'},
    series: ['north', 'up', 'east'].map((axis, k) => ({label: axis, colour: axisColours[k], points: true, small: true,
                                                      values: thin(all[axis])})),
    levels: [3, -3],
  });
}

function showGimbal(report) {
  const gimbal = report.gimbal;
  addPlot(document.getElementById('gimbal-plot'), {
    id: 'gimbal',
    title: 'Gimbal angles',
    x: {label: 'time', unit: 'min', values: gimbal.time_s.map((at) => at / 60)},
    y: {label: 'read-out', unit: 'deg'},
    series: [{label: 'outer', colour: 'x', values: gimbal.outer_deg},
             {label: 'inner', colour: 'y', dash: [6, 3], values: gimbal.inner_deg}],
  });
}

function showAllan(report) {
  const place = document.getElementById('allan-plots');
  const allan = report.allan;
  if (allan.tau_s.length === 0) {
    place.append(element('p', {}, 'No dwell was long enough for an Allan deviation.'));
    return;
  }
  const add = (id, title, unit, columns) => addPlot(place, {
    id,
    title,
    height: 280,
    x: {label: 'averaging time', unit: 's', log: true, values: allan.tau_s},
    y: {label: 'Allan deviation', unit, log: true},
    series: columns.map((values, k) => ({label: axisColours[k], colour: axisColours[k], dash: axisDashes[k], values})),
  });
  add('allan-gyro', 'Gyros', 'deg/h', allan.gyro_deg_per_h);
  add('allan-accel', 'Accelerometers', 'ug', allan.accel_ug);
}
