// The table of the 24, with their change since the last calibration and the corrected values of the diagnosis.
'use strict';

// Against the last calibration: the difference, its sigma, and how many of them it is.
function changeOf(parameter) {
  const change = parameter.change;
  if (!change) {
    return '–';
  }
  const size = Math.abs(change.value) / change.sigma;
  return element('span', {title: `since run ${change.run}, ${change.utc}`, class: size < insignificant ? 'faint' : ''},
                 `${signed(change.value, decimalsFor(change.sigma))} (${significant(size, 2)} σ)`);
}

// Below this many sigma a difference may be chance, and is grey.
const insignificant = 3;

function signed(value, decimals) {
  return Number.isFinite(value) ? `${value >= 0 ? '+' : '−'}${Math.abs(value).toFixed(decimals)}` : '–';
}

const modelFits = (report) => objectOf(report.consistency).verdict === 'consistent';

// No tick where anything speaks against the value: neither its own sigma nor the recording as a whole.
function stateOf(parameter, report) {
  if (parameter.plausible === false) {
    return element('span', {class: 'bad'}, '✘ not plausible');
  }
  if (parameter.determined !== true) {
    return element('span', {class: 'bad'}, '✘ not determined');
  }
  if (!modelFits(report)) {
    return element('span', {class: 'faint'}, '○ in doubt');
  }
  return parameter.usable === false ? element('span', {class: 'bad'}, '✘ not to be used')
                                    : element('span', {class: 'good'}, '✔ determined');
}

function shareBar(share) {
  const bar = element('span', {class: share > 1 ? 'bar over' : 'bar', role: 'img',
                               'aria-label': `${significant(share, 2)} of the tolerance`});
  const filled = element('span');
  filled.style.width = `${Math.min(100, 100 * share).toFixed(1)}%`;
  bar.append(filled);
  return element('span', {}, bar, ' ' + significant(share, 2));
}

// The same parameters as the diagnosis fits them together with the effects that it named or the equations that it found; null where
// there are none, and where the values above are these already.
function correctionsOf(report) {
  const d = objectOf(report.diagnosis);
  if (report.amends || (d.verdict !== 'named' && !correctedByLaws(d))) {
    return null;
  }
  const known = new Map(listOf(d.parameters).map((p) => [p.name, p]));
  return report.parameters.map((p) => known.get(p.name) ?? null);
}

function correctedColumns(report) {
  const corrections = correctionsOf(report);
  if (!corrections) {
    return [];
  }
  // In the sigma that the uncorrected value was given: how far an operator who trusts it would be led astray.
  const moves = corrections.map((c) => (c ? (c.value - c.value_without) / c.sigma_without : NaN));
  const cell = (text, k) => (Math.abs(moves[k]) >= insignificant ? element('strong', {}, text) : element('span', {class: 'faint'}, text));
  return [
    {title: 'corrected value ± σ', cells: corrections.map((c, k) => (c ? cell(withSigma(c.value, c.sigma), k) : '–'))},
    {title: 'correction in σ', cells: moves.map((move, k) => (Number.isFinite(move) ? cell(signed(move, 1), k) : '–'))},
  ];
}

// Why there are no ticks, and where the numbers are that may be used.
function doubtOf(report) {
  if (modelFits(report)) {
    return '';
  }
  const verdict = objectOf(report.diagnosis).verdict;
  const lead = 'No value is ticked, for recording and model disagree: a σ says nothing where the model is wrong. ';
  if (correctionsOf(report)) {
    const what = verdict === 'named' ? 'The diagnosis names what was left out' : 'What was left out is in no catalogue; the diagnosis below found its equation';
    return lead + what + '; the corrected values are those of the 24 fitted together with it (grey: moved by less than 3 σ).';
  }
  if (explained(objectOf(report.diagnosis))) {
    return lead + 'What was left out is in no catalogue; the diagnosis below says what was found.';
  }
  return lead + (verdict === 'data fault' ? 'The data are faulty: see the diagnosis.'
      : verdict ? 'The diagnosis names no cause, so there are no corrected values.' : 'No diagnosis was made.');
}

function showParameters(report) {
  const list = report.parameters;
  const known = list.some((p) => p.change);
  const doubt = doubtOf(report);
  const place = document.getElementById('parameter-table');
  if (doubt) {
    place.append(element('p', {class: 'bad', id: 'doubt'}, doubt));
  }
  place.append(table([
    {title: 'parameter', cells: list.map((p) => textOf(p.name)), class: 'left'},
    {title: 'value', cells: list.map((p) => fixed(p.value, decimalsFor(p.sigma)))},
    {title: 'σ', cells: list.map((p) => fixed(p.sigma, decimalsFor(p.sigma)))},
    {title: 'unit', cells: list.map((p) => unitSymbol(p.unit)), class: 'left'},
    {title: 'tolerance', cells: list.map((p) => significant(p.tolerance, 3))},
    {title: 'σ / tolerance', cells: list.map((p) => shareBar(p.sigma / p.tolerance)), class: 'left'},
    ...(known ? [{title: 'since the last calibration', cells: list.map(changeOf)}] : []),
    ...correctedColumns(report),
    {title: 'state', cells: list.map((p) => stateOf(p, report)), class: 'left'},
  ], {id: 'values'}));
  const objections = document.getElementById('objections');
  if (listOf(report.objections).length > 0) {
    const reasons = report.objections.map((words) => element('li', {class: 'bad'}, textOf(words)));
    objections.append(element('h3', {}, 'Why it is not accepted'), element('ul', {}, ...reasons));
  }
  for (const warning of listOf(report.warnings)) {
    objections.append(element('p', {class: 'bad'}, 'Warning: ' + textOf(warning)));
  }
}
