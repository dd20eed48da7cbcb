// The verdict and the tables.
'use strict';

function showVerdict(report) {
  const verdict = document.getElementById('verdict');
  if (!report.parameters) {
    const run = report.run;
    verdict.textContent = `${run.exit_status === 0 ? '✔' : '✘'} Run ${run.run} ${run.state}${run.reason ? ': ' + run.reason : ''}.`;
    verdict.className = run.exit_status === 0 ? 'yes' : 'no';
    return;
  }
  const lead = report.acceptable ? 'Accepted: all 24 parameters are determined and consistent with the recording. '
                                 : `Not accepted: ${report.objections.join('; ')}. `;
  verdict.textContent = (report.acceptable ? '✔ ' : '✘ ') + lead + report.consistency.words + runSentence(report.run);
  verdict.className = report.acceptable ? 'yes' : 'no';
}

function runSentence(run) {
  if (!run) {
    return '';
  }
  if (!run.coefficients?.in_force) {
    return ` The run ${run.state}: the set is not in force.`;
  }
  // Only the word of an operator puts a set into force that was not accepted.
  return run.force_reason ? ` The set was pushed and is in force, forced by ${run.user}: ${run.force_reason}.`
                          : ' The set was pushed, read back and is in force.';
}

function fillFacts(facts) {
  const list = document.getElementById('facts');
  for (const [name, value] of facts) {
    list.append(element('div', {}, element('dt', {}, name), element('dd', {}, value)));
  }
}

function showFacts(report) {
  const attitude = report.initial_attitude_deg;
  const facts = [
    ['Serial number', report.serial || '–'],
    ['Recorded', report.start_time_utc || '–'],
    ['Duration', `${significant(report.duration_s / 60, 4)} min, ${report.samples} samples at ${report.sample_rate_hz} Hz`],
    ['Site', `${significant(report.site.latitude_deg, 6)}°, ${significant(report.site.longitude_deg, 6)}°, ${significant(report.site.height_m, 3)} m`],
    ['Attitude at the start', `roll ${fixed(attitude.roll, 3)}°, pitch ${fixed(attitude.pitch, 3)}°, heading ${fixed(attitude.heading, 3)}°`],
    ['Base', report.noise.base],
    ['Computed in', `${significant(report.elapsed_s, 3)} s, ${report.passes.length} passes`],
  ];
  fillFacts(facts);
}

// Against the last calibration: the difference, its sigma, and how many of them it is.
function changeOf(parameter) {
  const change = parameter.change;
  if (!change) {
    return '–';
  }
  const decimals = decimalsFor(change.sigma);
  const size = Math.abs(change.value) / change.sigma;
  return element('span', {title: `since run ${change.run}, ${change.utc}`},
                 `${change.value >= 0 ? '+' : '−'}${Math.abs(change.value).toFixed(decimals)} (${significant(size, 2)} σ)`);
}

function stateOf(parameter) {
  if (!parameter.plausible) {
    return element('span', {class: 'bad'}, '✘ not plausible');
  }
  return parameter.determined ? element('span', {class: 'good'}, '✔ determined')
                              : element('span', {class: 'bad'}, '✘ not determined');
}

function shareBar(share) {
  const bar = element('span', {class: share > 1 ? 'bar over' : 'bar', role: 'img',
                               'aria-label': `${significant(share, 2)} of the tolerance`});
  const filled = element('span');
  filled.style.width = `${Math.min(100, 100 * share).toFixed(1)}%`;
  bar.append(filled);
  return element('span', {}, bar, ' ' + significant(share, 2));
}

function showParameters(report) {
  const list = report.parameters;
  const known = list.some((p) => p.change);
  document.getElementById('parameter-table').append(table([
    {title: 'parameter', cells: list.map((p) => p.name), class: 'left'},
    {title: 'value', cells: list.map((p) => p.value.toFixed(decimalsFor(p.sigma)))},
    {title: 'σ', cells: list.map((p) => p.sigma.toFixed(decimalsFor(p.sigma)))},
    {title: 'unit', cells: list.map((p) => unitSymbol(p.unit)), class: 'left'},
    {title: 'tolerance', cells: list.map((p) => significant(p.tolerance, 3))},
    {title: 'σ / tolerance', cells: list.map((p) => shareBar(p.sigma / p.tolerance)), class: 'left'},
    ...(known ? [{title: 'since the last calibration', cells: list.map(changeOf)}] : []),
    {title: 'state', cells: list.map(stateOf), class: 'left'},
  ], {id: 'values'}));
  const objections = document.getElementById('objections');
  if (report.objections.length > 0) {
    const reasons = report.objections.map((words) => element('li', {class: 'bad'}, words));
    objections.append(element('h3', {}, 'Why it is not accepted'), element('ul', {}, ...reasons));
  }
  for (const warning of report.warnings) {
    objections.append(element('p', {class: 'bad'}, 'Warning: ' + warning));
  }
}

function showPasses(report) {
  const passes = report.passes;
  document.getElementById('pass-table').append(table([
    {title: 'pass', cells: passes.map((p, k) => `${k + 1} ${p.direction}`), class: 'left'},
    {title: 'data (s)', cells: passes.map((p) => significant(p.seconds, 5))},
    {title: 'mean NIS (1 expected)', cells: passes.map((p) => significant(p.nis_mean, 4))},
    {title: 'largest move (σ)', cells: passes.map((p) => significant(p.largest_move_sigma, 3))},
  ]));
}

function showConsistency(report) {
  const c = report.consistency;
  document.getElementById('consistency-words').textContent =
      `${c.words} Mean NIS ${significant(c.nis_mean, 4)}, ${significant(c.nis_low, 4)} to ` +
      `${significant(c.nis_high, 4)} expected of a right model; whiteness p = ${significant(c.whiteness_p_value, 2)}; ` +
      `forward and reverse passes differ by at most ${significant(c.parity_max_sigma, 2)} σ.`;
  const n = report.noise;
  document.getElementById('noise-words').textContent =
      `In use: angle random walk ${significant(n.gyro_arw_deg_per_sqrt_h, 3)} °/√h, velocity random walk ` +
      `${significant(n.accel_vrw_ug_per_sqrt_hz, 3)} µg/√Hz, position ${significant(n.position_sigma_m, 3)} m. ` +
      'Allan deviation of each sensor, from the dwells.';
}

function showSegments(report) {
  const dwells = report.segments.filter((segment) => segment.kind === 'dwell');
  const details = element('details', {}, element('summary', {}, `The ${dwells.length} positions as numbers`), table([
    {title: 'position', cells: dwells.map((d, k) => String(k + 1)), class: 'left'},
    {title: 'from (s)', cells: dwells.map((d) => d.start_s.toFixed(1))},
    {title: 'to (s)', cells: dwells.map((d) => d.end_s.toFixed(1))},
    {title: 'outer (°)', cells: dwells.map((d) => d.outer_deg.toFixed(2))},
    {title: 'inner (°)', cells: dwells.map((d) => d.inner_deg.toFixed(2))},
    {title: 'NIS', cells: dwells.map((d) => significant(d.nis_mean, 4))},
    {title: 'updates', cells: dwells.map((d) => String(d.epochs))},
  ]));
  document.getElementById('segment-table').append(details);
}

function showUndetermined(report) {
  const place = document.getElementById('undetermined');
  if (report.undetermined.length === 0) {
    place.append(element('p', {}, 'Every direction in the space of the 24 parameters was determined to its tolerance.'));
    return;
  }
  for (const direction of report.undetermined) {
    const parts = Object.entries(direction.direction_in_tolerances)
        .filter(([, part]) => Math.abs(part) > 0.1).sort((a, b) => Math.abs(b[1]) - Math.abs(a[1]))
        .map(([name, part]) => `${part < 0 ? '−' : '+'}${Math.abs(part).toFixed(2)} ${name}`);
    place.append(element('p', {}, direction.words + ' ',
                         element('span', {class: 'note'}, `(in tolerances: ${parts.join(', ')})`)));
  }
}
