// What is plotted.
'use strict';

const axisColours = ['x', 'y', 'z'];
const angleSteps = [1, 2, 5, 10, 15, 30, 45, 90, 180, 360, 720];
const axisDashes = [undefined, [8, 4], [2, 3]];   // told apart without colour too

// The virtual time of the passes laid end to end, in minutes, with a gap (null) between passes.
function passAxis(report) {
  const axis = {minutes: [], passOf: [], epochOf: [], marks: []};
  let offset = 0;
  listOf(report.passes).forEach((pass, number) => {
    if (listOf(pass.epoch_s).length === 0) {
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

// What the answer is measured from: the estimate less the answer, linear within a sigma of it and logarithmic beyond,
// so that the first minutes and the last are both seen.
function convergenceScale(parameter, moves, sigmas) {
  const smallest = Math.min(...sigmas.filter((value) => value > 0));
  const linear = parameter.sigma > 0 ? parameter.sigma : Number.isFinite(smallest) ? smallest : 1;
  const sizes = moves.map((move, row) => Math.abs(move) + 3 * (sigmas[row] ?? 0)).filter(Number.isFinite);
  const half = Math.max(10 * linear, ...sizes.map((size) => 1.3 * size));
  return {asinh: linear, range: [-half, half]};
}

function showConvergence(report) {
  const place = document.getElementById('convergence-plots');
  const axis = passAxis(report);
  report.parameters.forEach((parameter, index) => later(() => {
    const pick = (key) => axis.passOf.map(
        (pass, row) => (pass === null ? null : numberOrNull(report.passes[pass][key]?.[axis.epochOf[row]]?.[index])));
    const values = pick('epoch_values');
    const sigmas = pick('epoch_sigmas');
    if (!Number.isFinite(parameter.value) || !values.some(Number.isFinite)) {
      return;
    }
    const at = (sign) => values.map((value, row) => (value === null || sigmas[row] === null ? null : value + sign * 3 * sigmas[row]));
    const less = (list) => list.map((value) => (value === null ? null : value - parameter.value));
    const line = (label, list, more) => ({label, colour: 'x', values: list, shown: less(list), ...more});
    addPlot(place, {
      id: 'convergence-' + parameter.name,
      title: `${parameter.name}: ${withSigma(parameter.value, parameter.sigma)} ${unitSymbol(parameter.unit)}`,
      x: {label: 'time worked through', unit: 'min', values: axis.minutes},
      y: {label: 'estimate − answer', unit: parameter.unit, ...convergenceScale(parameter, less(values), sigmas)},
      series: [line('estimate', values), line('+3 σ', at(1), {thin: true, dash: [3, 3]}),
               line('−3 σ', at(-1), {thin: true, dash: [3, 3]})],
      band: [2, 3],
      marks: axis.marks,
      level: 0,
    });
  }));
}

// One time axis for the plots of the recording, so that they stand under each other.
const wholeTime = (report) => (report.duration_s > 0 ? [0, report.duration_s / 60] : undefined);

function showNis(report) {
  const middle = (segment) => (segment.start_s + segment.end_s) / 120;
  const counted = listOf(report.segments).filter((segment) => segment.epochs > 0 && Number.isFinite(segment.nis_mean));
  if (counted.length === 0) {
    return;
  }
  const values = (kind) => counted.map((segment) => (segment.kind === kind ? segment.nis_mean : null));
  const top = Math.max(2, 1.15 * Math.max(...counted.map((segment) => segment.nis_mean)));
  addPlot(document.getElementById('nis-plot'), {
    id: 'nis',
    title: 'Normalised innovation squared (NIS) of each dwell and rotation, per degree of freedom (1 expected)',
    x: {label: 'time', unit: 'min', values: counted.map(middle), range: wholeTime(report)},
    y: {label: 'mean NIS', unit: '1', range: [0, top]},
    series: [{label: 'dwell', colour: 'x', points: true, values: values('dwell')},
             {label: 'rotation', colour: 'y', points: true, values: values('rotation')}],
    level: 1,
  });
}

// A thousand points a line: the mean of each stretch would hide what the picture is for, so every k-th is shown.
function showInnovations(report) {
  const all = objectOf(report.innovations);
  if (listOf(all.time_s).length === 0) {
    return;
  }
  const step = Math.ceil(all.time_s.length / 1500);
  const thin = (list) => list.filter((_, k) => k % step === 0);
  addPlot(document.getElementById('innovation-plot'), {
    id: 'innovations',
    title: 'Innovations of the last answer over their predicted σ (unit variance expected; dotted: ±3 σ)',
    x: {label: 'time', unit: 'min', values: thin(all.time_s).map((at) => at / 60), range: wholeTime(report)},
    y: {label: 'innovation / σ', unit: '1'},
    series: ['north', 'up', 'east'].map((axis, k) => ({label: axis, colour: axisColours[k], points: true, small: true,
                                                      values: thin(all[axis])})),
    levels: [3, -3],
  });
}

function showGimbal(report) {
  const gimbal = objectOf(report.gimbal);
  if (listOf(gimbal.time_s).length === 0) {
    return;
  }
  addPlot(document.getElementById('gimbal-plot'), {
    id: 'gimbal',
    title: 'Gimbal angles',
    x: {label: 'time', unit: 'min', values: gimbal.time_s.map((at) => at / 60), range: wholeTime(report)},
    y: {label: 'read-out', unit: 'deg', steps: angleSteps},
    series: [{label: 'outer', colour: 'x', values: gimbal.outer_deg},
             {label: 'inner', colour: 'y', dash: [6, 3], values: gimbal.inner_deg}],
  });
}

