// The diagnosis: what differs, where, which physics was left out, the proof, and what to run next.
'use strict';

const verdictWords = {
  'adequate': '✔ The 24-parameter model explains the recording.',
  'named': '✘ The recording holds physics that the 24-parameter model leaves out; it is named below.',
  'none of the above': '✘ The recording and the model differ, and nothing in the catalogue explains it.',
  'not enough information': '? The recording hints at an effect but does not hold enough information to name it.',
  'data fault': '✘ The data themselves are faulty; nothing else is concluded from them.',
};

// p of a single test may lie far below the smallest double.
function probabilityText(evidence) {
  return evidence.log10_p > -4 ? significant(10 ** evidence.log10_p, 2) : `10^${evidence.log10_p.toFixed(0)}`;
}

function findingsTable(findings, id) {
  const sizes = (finding) => finding.parameters.map(
      (p) => `${p.name} ${withSigma(p.value, p.sigma)} ${unitSymbol(p.unit)}`).join('; ');
  return table([
    {title: 'effect', cells: findings.map((f) => f.effect), class: 'left'},
    {title: 'equation', cells: findings.map((f) => f.equation), class: 'words'},
    {title: 'size ± σ', cells: findings.map(sizes), class: 'words'},
    {title: 'significance (σ)', cells: findings.map((f) => significant(f.significance, 3))},
    {title: 'p without it', cells: findings.map((f) => probabilityText(f.evidence))},
    {title: 'fall of BIC', cells: findings.map((f) => (f.stochastic ? '–' : significant(f.evidence.delta_bic, 4)))},
    {title: 'held-out gain (ln likelihood)', cells: findings.map((f) => (f.stochastic ? '–' : significant(f.evidence.held_out_gain, 4)))},
    {title: 'cannot be told from', cells: findings.map((f) => f.equivalent.join(', ') || '–'), class: 'words'},
    {title: 'run next', cells: findings.map((f) => f.experiment || '–'), class: 'words'},
  ], {id});
}

function placesTable(places) {
  return table([
    {title: 'where', cells: places.map((l) => l.words), class: 'left'},
    {title: 'bias', cells: places.map((l) => significant(l.bias, 3))},
    {title: 'unit', cells: places.map((l) => unitSymbol(l.unit)), class: 'left'},
    {title: 'significance (σ)', cells: places.map((l) => significant(l.significance, 3))},
  ]);
}

function adequacyTable(adequacy) {
  const rows = [adequacy.before, adequacy.after];
  return table([
    {title: 'model', cells: ['24 parameters', 'with the named effects'], class: 'left'},
    {title: 'NIS (1 expected)', cells: rows.map((a) => significant(a.nis, 4))},
    {title: 'largest misfit (σ)', cells: rows.map((a) => significant(a.largest_located_sigma, 3))},
    {title: 'whiteness log10 p', cells: rows.map((a) => significant(a.whiteness_log10_p, 3))},
    {title: 'misfit (χ² beyond its degrees of freedom)', cells: rows.map((a) => significant(a.misfit, 4))},
    {title: 'accepted', cells: rows.map((a) => (a.accepted ? '✔ yes' : '✘ no'))},
  ], {id: 'adequacy'});
}

function correctedTable(parameters) {
  const moved = parameters.map((p) => ({...p, move: p.value - p.value_without}))
      .filter((p) => Math.abs(p.move) > p.sigma_without);
  return [`${moved.length} of the 24 moved by more than their σ`, table([
    {title: 'parameter', cells: moved.map((p) => p.name), class: 'left'},
    {title: '24 alone', cells: moved.map((p) => withSigma(p.value_without, p.sigma_without))},
    {title: 'with the effects', cells: moved.map((p) => withSigma(p.value, p.sigma))},
    {title: 'difference', cells: moved.map((p) => significant(p.move, 3))},
    {title: 'unit', cells: moved.map((p) => unitSymbol(p.unit)), class: 'left'},
    {title: 'difference (σ)', cells: moved.map((p) => significant(p.move / p.sigma_without, 3))},
  ])];
}

// The two axes that the signature moves most, in all their cells.
function addSignaturePlots(place, map, findings) {
  const cells = map.cells;
  const power = [0, 0, 0, 0, 0, 0];
  cells.axis.forEach((axis, k) => { power[axis] += (cells.signature[k] / cells.sigma[k]) ** 2; });
  // An accelerometer's error shows in the gyros' cells too, through the position; the named sensors come first.
  const named = (axis) => (findings.some((f) => f.effect.startsWith(axis < 3 ? 'gyro' : 'accel')) ? 1 : 0);
  const seen = power.map((value, axis) => ({value, axis})).filter(({value}) => value > 25)
      .sort((a, b) => named(b.axis) - named(a.axis) || b.value - a.value).slice(0, 2);
  for (const {axis} of seen) {
    const rows = [...cells.axis.keys()].filter((k) => cells.axis[k] === axis && cells.bin[k] >= 0)
        .sort((a, b) => cells.middle_s[a] - cells.middle_s[b]);
    const pick = (list) => rows.map((k) => list[k]);
    addPlot(place, {
      id: 'signature-' + axis,
      title: `${sensorNames[axis]}: bias per position and time since the turn`,
      height: 280,
      x: {label: 'time', unit: 'min', values: pick(cells.middle_s).map((at) => at / 60)},
      y: {label: 'bias', unit: axis < 3 ? 'deg/h' : 'ug'},
      series: [{label: 'recording, ±1 σ', colour: 'x', points: true, values: pick(cells.bias), errors: pick(cells.sigma)},
               {label: 'signature of the named effects', colour: 'y', dash: [6, 3], values: pick(cells.signature)}],
    });
  }
}

function showDiagnosis(report) {
  const d = report.diagnosis;
  if (!d) {
    hideSection('diagnosis');
    return;
  }
  document.getElementById('diagnosis-words').textContent =
      `${verdictWords[d.verdict] || d.verdict} False alarms: ${significant(100 * d.false_alarm_rate, 2)} % of recordings.`;
  const place = document.getElementById('diagnosis-tables');
  const add = (title, ...content) => place.append(element('h3', {}, title), ...content);
  if (d.data_faults.length > 0) {
    add('Faults of the data', element('ul', {}, ...d.data_faults.map(
        (f) => element('li', {class: 'bad'}, `${f.words} (first at sample ${f.first_sample}, ${f.count} in all)`))));
    return;
  }
  add('Before and after', adequacyTable(d.adequacy));
  if (d.findings.length > 0) {
    add('Effects left out, best first', findingsTable(d.findings, 'findings'));
  }
  if (d.suspected.length > 0) {
    add('Too weak to name; it would show with', element('ul', {}, ...d.suspected.map(
        (f) => element('li', {}, `${f.effect} (${significant(f.significance, 2)} σ): ${f.experiment}`))));
  }
  if (d.rejected.length > 0) {
    add('Fitted best, but rejected by what remains', findingsTable(d.rejected, 'rejected'));
  }
  if (d.findings.length > 0) {
    const [words, corrected] = correctedTable(d.parameters);
    add('What the omission did to the 24', element('p', {class: 'note'}, words + '.'), corrected);
  }
  if (d.located.length > 0) {
    add('Largest misfits, each place tested on its own', placesTable(d.located));
  }
  if (d.unexplained && d.remaining.length > 0) {
    add('What remains', placesTable(d.remaining));
  }
  if (d.undetectable_here.length > 0) {
    place.append(element('p', {class: 'note'}, 'Not detectable here at typical size: ' + d.undetectable_here.join(', ') + '.'));
  }
  addSignaturePlots(document.getElementById('signature-plots'), d.map, d.findings);
  const maps = document.getElementById('misfit-maps');
  addMisfitMap(maps, d.map, 'misfit-before', 'Misfit of the 24 alone', d.map.cells.bias);
  if (d.map.cells.signature.some((value) => value !== 0)) {
    addMisfitMap(maps, d.map, 'misfit-after', 'What the named effects leave',
                 d.map.cells.bias.map((value, k) => value - d.map.cells.signature[k]));
  }
}
