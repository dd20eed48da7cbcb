// The diagnosis: what differs, where, which physics was left out, the proof, and what to run next.
'use strict';

const verdictWords = {
  'adequate': '✔ The 24-parameter model explains the recording.',
  'named': '✘ The recording holds physics that the 24-parameter model leaves out; it is named below.',
  'none of the above': '✘ The recording and the model differ, and nothing in the catalogue explains it.',
  'not enough information': '○ The recording hints at an effect but does not hold enough information to name it.',
  'data fault': '✘ The data themselves are faulty; nothing else is concluded from them.',
};

// A power of ten as people write it: p of a single test may lie far below the smallest double.
function powerOfTen(power) {
  return '10' + String(Math.round(power)).replace(/[-0-9]/g, (sign) => (sign === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[sign]));
}

function probabilityText(log10) {
  if (!Number.isFinite(log10)) {
    return '–';
  }
  return log10 > -4 ? significant(10 ** log10, 2) : powerOfTen(log10);
}

// A coefficient below 3 sigma is grey: it is fitted with the others and says nothing by itself.
function coefficientsOf(finding) {
  const parts = listOf(finding.parameters).map((p) => element('span',
      {class: Math.abs(p.value) < insignificant * p.sigma ? 'faint' : ''},
      `${textOf(p.name)} ${withSigma(p.value, p.sigma)} ${unitSymbol(p.unit)}`));
  return element('span', {}, ...parts.flatMap((part, k) => (k === 0 ? [part] : ['; ', part])));
}

const evidenceOf = (finding) => objectOf(finding.evidence);

function findingsTable(findings, id) {
  return table([
    {title: 'effect', cells: findings.map((f) => textOf(f.effect)), class: 'left'},
    {title: 'equation', cells: findings.map((f) => textOf(f.equation)), class: 'words'},
    {title: 'size ± σ', cells: findings.map(coefficientsOf), class: 'words'},
    {title: 'significance (σ)', cells: findings.map((f) => significant(f.significance, 3))},
    {title: 'p without it', cells: findings.map((f) => probabilityText(evidenceOf(f).log10_p))},
    {title: 'fall of BIC', cells: findings.map((f) => (f.stochastic ? '–' : significant(evidenceOf(f).delta_bic, 4)))},
    {title: 'held-out gain (ln likelihood)', cells: findings.map((f) => (f.stochastic ? '–' : significant(evidenceOf(f).held_out_gain, 4)))},
    {title: 'cannot be told from', cells: findings.map((f) => listOf(f.equivalent).join(', ') || '–'), class: 'words'},
    {title: 'run next', cells: findings.map((f) => textOf(f.experiment) || '–'), class: 'words'},
  ], {id});
}

// What the letters of the equations stand for.
function symbolsNote(findings) {
  const all = Object.assign({}, ...findings.map((f) => objectOf(f.symbols)));
  const words = Object.entries(all).map(([name, meaning]) => `${name}: ${textOf(meaning)}`);
  return element('p', {class: 'note symbols'}, words.length > 0 ? words.join('; ') + '.' : '');
}

function remainderWords(r) {
  const place = listOf(r.places)[0];
  return element('p', {id: 'remainder'}, `${significant(100 * r.share, 2)} % of the misfit (${significant(r.sigma, 3)} σ) is left: `
      + listOf(r.forms).map((f) => `${textOf(f.effect)} differs from its equation (${textOf(f.words)}, ${significant(100 * f.share, 2)} %)`).join('; ')
      + `. ${place ? `Largest in ${textOf(place.words)}. ` : ''}The σ of the corrected values holds what it may do to them.`);
}

// Strongest first; those that chance makes too are grey.
function placesTable(places) {
  const sorted = [...places].sort((a, b) => (b.significance ?? 0) - (a.significance ?? 0));
  return table([
    {title: 'where', cells: sorted.map((l) => textOf(l.words)), class: 'left'},
    {title: 'bias', cells: sorted.map((l) => significant(l.bias, 3))},
    {title: 'unit', cells: sorted.map((l) => unitSymbol(l.unit)), class: 'left'},
    {title: 'significance (σ)', cells: sorted.map((l) => significant(l.significance, 3))},
  ], {}, sorted.map((l) => Math.abs(l.significance) < insignificant));
}

// `after`: what the second row is of; empty: there is none.
function adequacyTable(adequacy, after) {
  const rows = [objectOf(adequacy.before), ...(after ? [objectOf(adequacy.after)] : [])];
  return table([
    {title: 'model', cells: ['24 parameters', after].slice(0, rows.length), class: 'left'},
    {title: 'NIS (1 expected)', cells: rows.map((a) => significant(a.nis, 4))},
    {title: 'largest misfit (σ)', cells: rows.map((a) => significant(a.largest_located_sigma, 3))},
    {title: 'innovations white? (p)', cells: rows.map((a) => (a.whiteness_log10_p === null ? 'not judged: quantum and lines' : probabilityText(a.whiteness_log10_p)))},
    {title: 'misfit (χ² beyond its degrees of freedom)', cells: rows.map((a) => significant(a.misfit, 4))},
    {title: 'recording explained', cells: rows.map((a) => (a.accepted ? element('span', {class: 'good'}, '✔ yes')
                                                                   : element('span', {class: 'bad'}, '✘ no')))},
  ], {id: 'adequacy'});
}

// What the omission did to the 24; the numbers stand in their own table.
function correctionWords(parameters) {
  const size = (p) => Math.abs(p.value - p.value_without) / p.sigma_without;
  const moved = parameters.filter((p) => size(p) > insignificant).sort((a, b) => size(b) - size(a));
  if (moved.length === 0) {
    return 'None of the 24 is moved by more than 3 σ.';
  }
  const one = (p) => `${p.name} ${withSigma(p.value_without, p.sigma_without)} → ${withSigma(p.value, p.sigma)} ${unitSymbol(p.unit)} `
      + `(${signed((p.value - p.value_without) / p.sigma_without, 1)} σ)`;
  return `${moved.length} of the 24 ${moved.length === 1 ? 'is' : 'are'} moved by more than 3 σ, most of all ${moved.slice(0, 3).map(one).join('; ')}. `
      + 'All corrected values stand in the table of the 24.';
}

// Bias of each axis in each dwell, in which the 24 are projected out: the shape of what nothing in the catalogue explains.
function addDwellPlots(place, map) {
  const dwells = objectOf(map?.dwells);
  const count = Math.max(0, ...listOf(dwells.position));
  if (count === 0) {
    return;
  }
  const left = dwells.bias.map((bias, k) => bias - (dwells.signature[k] ?? 0));
  [['gyros', 0, 'deg/h'], ['accelerometers', 3, 'ug']].forEach(([name, first, unit]) => {
    // Beside each other, so that the bars of the three axes do not hide one another.
    const slots = [...Array(3 * count).keys()];
    const row = new Map(dwells.position.map((position, k) => [`${position} ${dwells.axis[k]}`, k]));
    const at = (slot) => row.get(`${Math.floor(slot / 3) + 1} ${first + slot % 3}`);
    const strong = (k) => Math.abs(left[k]) >= insignificant * dwells.sigma[k];
    const pick = (list, wanted) => slots.map((slot) => (at(slot) !== undefined && wanted(slot, at(slot)) ? numberOrNull(list[at(slot)]) : null));
    const series = (label, colour, wanted) => ({label, colour, points: true, values: pick(left, wanted), errors: pick(dwells.sigma, wanted)});
    addPlot(place, {
      id: `dwell-bias-${name}`,
      title: `Bias of the ${name} in each dwell, ±1 σ`,
      height: 260,
      x: {label: 'position', unit: 'number', values: slots.map((slot) => Math.floor(slot / 3) + 1 + 0.2 * (slot % 3 - 1)),
          steps: [1, 2, 5, 10, 20, 50]},
      y: {label: 'bias', unit},
      series: [...axisColours.map((axis, k) => series(axis, axis, (slot, cell) => slot % 3 === k && strong(cell))),
               series('below 3 σ', 'faint', (slot, cell) => !strong(cell))],
      level: 0,
    });
  });
}

// The dead end that is none: what the pictures tell apart, and what to record next.
function adviceForUnexplained(adequacy) {
  const nis = objectOf(adequacy?.after).nis ?? objectOf(adequacy?.before).nis;
  const advice = [
    'Do not use the 24: their σ holds for a model that this recording contradicts.',
    'See the bias in each dwell below. What returns at the same gimbal position belongs to the sensors or the gimbal; what '
        + 'grows with time to warm-up or ageing; what appears once to the site (people, wind, a moved base).',
    'Record the same schedule again and report it too: what repeats in the plots below is physics of the unit, what does '
        + 'not repeat is a disturbance, and a calibration without it may pass.',
    'If the base may have moved, record on a still base; if the unit was cold, after it has warmed up.',
  ];
  if (Number.isFinite(nis) && nis < 1.1) {
    advice.splice(1, 0, `A mean NIS of ${significant(nis, 3)} does not contradict this: the mean hides a misfit that a few `
        + 'dwells hold, for the 24 take up most of it.');
  }
  return element('ul', {id: 'advice'}, ...advice.map((words) => element('li', {}, words)));
}

// The two axes that the signature moves most, in all their cells.
function addSignaturePlots(place, d) {
  const cells = objectOf(d.map?.cells);
  if (listOf(cells.axis).length === 0) {
    return;
  }
  const power = [0, 0, 0, 0, 0, 0];
  cells.axis.forEach((axis, k) => { power[axis] += (cells.signature[k] / cells.sigma[k]) ** 2; });
  // An accelerometer's error shows in the gyros' cells too, through the position; the named sensors come first.
  const words = [...listOf(d.findings).map((f) => textOf(f.effect)), ...listOf(d.discovered).map((l) => textOf(l.axis))];
  const axisIds = ['gyro_x', 'gyro_y', 'gyro_z', 'accel_x', 'accel_y', 'accel_z'];
  const named = (axis) => (words.includes(axisIds[axis]) ? 2 : words.some((w) => w.startsWith(axis < 3 ? 'gyro' : 'accel')) ? 1 : 0);
  const seen = power.map((value, axis) => ({value, axis})).filter(({value}) => value > 25)
      .sort((a, b) => named(b.axis) - named(a.axis) || b.value - a.value).slice(0, 2);
  for (const {axis} of seen) {
    const rows = [...cells.axis.keys()].filter((k) => cells.axis[k] === axis && cells.bin[k] >= 0)
        .sort((a, b) => cells.middle_s[a] - cells.middle_s[b]);
    const pick = (list) => rows.map((k) => list[k]);
    addPlot(place, {
      id: 'signature-' + axis,
      title: `${sensorNames[axis]}: bias in each stretch of time after a turn`,
      height: 280,
      x: {label: 'time', unit: 'min', values: pick(cells.middle_s).map((at) => at / 60)},
      y: {label: 'bias', unit: axis < 3 ? 'deg/h' : 'ug'},
      series: [{label: 'recording, ±1 σ', colour: 'x', points: true, values: pick(cells.bias), errors: pick(cells.sigma)},
               {label: correctedByLaws(d) ? 'the equations found' : 'signature of the named effects', colour: 'y', dash: [6, 3], values: pick(cells.signature)}],
    });
  }
}

function showMisfitMaps(d) {
  const map = d.map;
  const cells = objectOf(map?.cells);
  if (listOf(cells.bias).length === 0) {
    return;
  }
  const maps = document.getElementById('misfit-maps');
  addMisfitMap(maps, map, 'misfit-before', 'Misfit of the 24 alone', cells.bias);
  if (cells.signature.some((value) => value !== 0)) {
    addMisfitMap(maps, map, 'misfit-after', correctedByLaws(d) ? 'What the equations leave' : 'What the named effects leave', cells.bias.map((value, k) => value - cells.signature[k]));
  }
}

function showDiagnosisTables(d) {
  const place = document.getElementById('diagnosis-tables');
  const add = (title, ...content) => place.append(element('h3', {}, title), ...content);
  const findings = listOf(d.findings);
  const rejected = listOf(d.rejected);
  const suspected = listOf(d.suspected);
  const after = correctedByLaws(d) ? 'with the equations below' : findings.length > 0 ? 'with the named effects' : '';
  add(after ? 'Before and after' : 'Recording against model', adequacyTable(objectOf(d.adequacy), after));
  const found = listOf(d.discovered).length + listOf(d.processes).length > 0;
  if (found) {
    const symbols = lawSymbols(listOf(d.discovered).map((l) => textOf(l.expression)));
    add('Found beyond the catalogue', discoveredTable(listOf(d.discovered), listOf(d.processes), 'discovered'), element('p', {class: 'note symbols'}, symbols ? symbols + '.' : ''),
        ...classTables(listOf(d.discovered)), insteadNote(d.instead), nextExperiment(listOf(d.discovered)));
  }
  if (correctedByLaws(d)) {
    add('What the omission did to the 24', element('p', {class: 'note', id: 'corrections'}, correctionWords(listOf(d.parameters))));
  }
  const described = listOf(d.described);
  if (described.length > 0) {
    const unsure = described.map(objectOf).filter((law) => law.unsure);
    add('Only described', element('p', {class: 'note'}, unsure.length > 0
        ? 'Several equations explain what this axis does, and none of them holds on another plan more probably than not. The best one describes this recording and is '
          + 'not to be used on another.'
        : 'What these sensors do has a form that is none of those tried. The equations describe this recording and are not to be used on another.'),
    discoveredTable(described, [], 'described'), ...classTables(unsure), ...(unsure.length > 0 ? [nextExperiment(unsure)] : []));
  }
  if (d.unexplained && !explained(d)) {
    add('What to do', adviceForUnexplained(d.adequacy));
  }
  if (findings.length > 0) {
    add('Effects left out, best first', findingsTable(findings, 'findings'), symbolsNote(findings));
    if (d.remainder) {
      add('What the equations leave of it', remainderWords(d.remainder));
    }
    add('What the omission did to the 24', element('p', {class: 'note', id: 'corrections'}, correctionWords(listOf(d.parameters))));
  }
  if (suspected.length > 0) {
    add('Too weak to name; it would show with', element('ul', {}, ...suspected.map(
        (f) => element('li', {}, `${textOf(f.effect)} (${significant(f.significance, 2)} σ): ${textOf(f.experiment) || 'a longer recording'}`))));
  }
  if (rejected.length > 0) {
    add('Fitted best, but rejected by what remains', findingsTable(rejected, 'rejected'), symbolsNote(rejected));
  }
  if (listOf(d.located).length > 0) {
    add('Largest misfits of the 24 alone, each place tested on its own', placesTable(d.located));
  }
  if (d.unexplained && listOf(d.remaining).length > 0) {
    add(correctedByLaws(d) ? 'What remains beside the equations' : explained(d) ? 'What the catalogue leaves' : 'What remains', placesTable(d.remaining));
  }
  if (listOf(d.undetectable_here).length > 0) {
    place.append(element('p', {class: 'note'}, 'Not detectable here at typical size: ' + d.undetectable_here.map(textOf).join(', ') + '.'));
  }
}

function showDiagnosis(report) {
  const d = report.diagnosis;
  if (!d) {
    hideSection('diagnosis');
    return;
  }
  document.getElementById('diagnosis-words').textContent =
      `${explained(d) ? '✘ The recording holds what no catalogue does; it is described below.' : verdictWords[d.verdict] || textOf(d.verdict)} False alarms: ${significant(100 * d.false_alarm_rate, 2)} % of recordings.`;
  const faults = listOf(d.data_faults);
  if (faults.length > 0) {
    document.getElementById('diagnosis-tables').append(element('h3', {}, 'Faults of the data'), element('ul', {}, ...faults.map(
        (f) => element('li', {class: 'bad'}, `${textOf(f.words)} (first at sample ${textOf(f.first_sample)}, ${textOf(f.count)} in all)`))));
    return;
  }
  showDiagnosisTables(d);
  if ((d.unexplained && !correctedByLaws(d)) || d.verdict === 'not enough information') {
    addDwellPlots(document.getElementById('dwell-plots'), d.map);
  }
  addSignaturePlots(document.getElementById('signature-plots'), d);
  showMisfitMaps(d);
}
