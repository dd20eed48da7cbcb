// The run around the calibration: sets over the bus, drift before and after, events, history of the unit.
'use strict';

function hideSection(id) {
  document.querySelector(`section[aria-labelledby="${id}"]`).hidden = true;
  document.querySelector(`nav a[href="#${id}"]`)?.remove();
}

function setCells(set, decimals) {
  return set ? set.parameters.map((p, k) => p.value.toFixed(decimals[k])) : decimals.map(() => '–');
}

// Beside each other, what stood in the INS, what was sent and what it gave back.
function coefficientTable(sets, parameters) {
  const known = sets.previous || sets.proposed;
  const decimals = known.parameters.map((_, k) => decimalsFor(parameters?.[k]?.sigma) + 1);
  const same = known.parameters.map((_, k) => {
    if (!sets.pushed || !sets.read_back) {
      return '–';
    }
    return sets.pushed.parameters[k].value === sets.read_back.parameters[k].value ? '✔ equal'
        : element('span', {class: 'bad'}, '✘ differs');
  });
  return table([
    {title: 'parameter', cells: known.parameters.map((p) => p.name), class: 'left'},
    {title: 'unit', cells: known.parameters.map((p) => unitSymbol(p.unit)), class: 'left'},
    {title: 'found in the INS', cells: setCells(sets.previous, decimals)},
    {title: sets.pushed ? 'pushed' : 'proposed, not sent', cells: setCells(sets.proposed, decimals)},
    {title: 'read back', cells: setCells(sets.read_back, decimals)},
    {title: 'pushed = read back', cells: same, class: 'left'},
  ], {id: 'coefficients'});
}

// Null where the drift was not measured.
function driftKnown(run) {
  return typeof run.drift_before_m === 'number' && typeof run.drift_after_m === 'number';
}

function showDrift(run) {
  if (!driftKnown(run)) {
    return;
  }
  const values = [run.drift_before_m, run.drift_after_m];
  const longest = Math.max(...values, 1e-9);
  const svg = svgElement('svg', {viewBox: '0 0 640 120', role: 'img', 'aria-label': 'Navigation drift before and after'});
  ['with the old set', 'with the new set'].forEach((name, k) => {
    const width = 380 * values[k] / longest;
    svg.append(svgElement('text', {x: 120, y: 32 + 34 * k, 'text-anchor': 'end'}, name),
               svgElement('rect', {x: 128, y: 18 + 34 * k, width, height: 20, style: `fill: var(--${k === 0 ? 'y' : 'x'})`}),
               svgElement('text', {x: 136 + width, y: 32 + 34 * k}, `${significant(values[k], 4)} m`));
  });
  svg.append(svgElement('text', {x: 128, y: 104}, 'horizontal drift (m), free-inertial, as the INS itself navigated in the run'));
  addSvgFigure(document.getElementById('drift-plot'), {id: 'navigation-drift', title: 'Navigation drift before and after', svg,
    columns: [{title: 'set', values: ['old', 'new']}, {title: 'drift (m)', values}]});
}

function showRun(report) {
  const run = report.run;
  if (!run) {
    hideSection('run');
    return;
  }
  const parts = [`Run ${run.run} of ${run.ins}, by ${run.user}, schedule ${run.schedule}, ${run.started_utc} to ${run.ended_utc || 'now'}: ${run.state}`];
  if (run.reason) parts.push(`: ${run.reason}`);
  if (run.force_reason) parts.push(`; forced: ${run.force_reason}`);
  if (driftKnown(run)) {
    parts.push(`; drift ${significant(run.drift_before_m, 4)} m before, ${significant(run.drift_after_m, 4)} m after`);
  }
  document.getElementById('run-words').textContent = parts.join('') + '.';
  // With parameters they stand below their table.
  for (const warning of report.parameters ? [] : report.warnings ?? []) {
    document.getElementById('run-story').append(element('p', {class: 'bad'}, 'Warning: ' + warning));
  }
  showDrift(run);
  const sets = run.coefficients;
  if (sets && (sets.previous || sets.proposed)) {
    const date = (set) => (set ? `version ${set.version} of ${set.date_utc} by ${set.author}` : 'none');
    document.getElementById('coefficient-table').append(
        element('p', {class: 'note'}, `Found: ${date(sets.previous)}. ${sets.pushed ? 'Pushed' : 'Proposed, not sent'}: `
            + `${date(sets.proposed)}. ${sets.in_force ? 'The new set is in force, confirmed after the INS was reset.'
                                                       : 'The new set is not in force by this run.'}`),
        coefficientTable(sets, report.parameters));
  }
  const events = run.events;
  document.getElementById('run-story').append(element('details', {},
      element('summary', {}, `${events.length} ${events.length === 1 ? 'event' : 'events'} of the run`), table([
        {title: 'UTC', cells: events.map((e) => e.utc), class: 'left'},
        {title: 'kind', cells: events.map((e) => e.kind), class: 'left'},
        {title: 'what', cells: events.map((e) => e.text), class: 'words'}])));
}

// Years as decimals, for an axis.
function yearOf(utc) {
  const at = new Date(utc);
  const year = at.getUTCFullYear();
  return year + (at - Date.UTC(year, 0, 1)) / (Date.UTC(year + 1, 0, 1) - Date.UTC(year, 0, 1));
}

function showHistory(report) {
  const history = report.history;
  if (!history || history.runs.length === 0) {
    hideSection('history');
    return;
  }
  const runs = history.runs;
  document.getElementById('history-words').textContent =
      `${runs.length} runs of ${history.serial}. Values that took effect, with 1 σ bars; dotted: limit of the type.`;
  document.getElementById('history-table').append(table([
    {title: 'run', cells: runs.map((r) => String(r.run)), class: 'left'},
    {title: 'started (UTC)', cells: runs.map((r) => r.started_utc), class: 'left'},
    {title: 'kind', cells: runs.map((r) => r.kind), class: 'left'},
    {title: 'end', cells: runs.map((r) => r.state), class: 'left'},
    {title: 'by', cells: runs.map((r) => r.user), class: 'left'},
    {title: 'drift before (m)', cells: runs.map((r) => significant(r.drift_before_m ?? null, 4))},
    {title: 'drift after (m)', cells: runs.map((r) => significant(r.drift_after_m ?? null, 4))},
    {title: 'reason', cells: runs.map((r) => r.reason), class: 'words'},
  ], {id: 'runs'}));
  const place = document.getElementById('history-plots');
  for (const parameter of history.parameters.filter((p) => p.values.length > 1)) {
    const slope = parameter.change_per_year === undefined || parameter.change_per_year === 0 ? ''
        : `, ${significant(parameter.change_per_year, 3)} ± ${significant(parameter.change_per_year_sigma, 2)} ${unitSymbol(parameter.unit)} a year`;
    addPlot(place, {
      id: 'history-' + parameter.name,
      title: parameter.name + slope,
      x: {label: 'time', unit: 'year', values: parameter.values.map((v) => yearOf(v.utc))},
      y: {label: 'value', unit: parameter.unit},
      series: [{label: 'value, ±1 σ', colour: 'x', points: true, values: parameter.values.map((v) => v.value),
                errors: parameter.values.map((v) => v.sigma)}],
    });
  }
}
