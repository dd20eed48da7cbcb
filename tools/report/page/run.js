// The run around the calibration: sets over the bus, drift before and after, events, history of the unit.
'use strict';

function hideSection(id) {
  document.querySelector(`section[aria-labelledby="${id}"]`).hidden = true;
  document.querySelector(`nav a[href="#${id}"]`)?.remove();
}

const setValue = (set, name) => listOf(set?.parameters).find((p) => p.name === name)?.value;

// Each coefficient before the run and after it, in the sigma of the new value where that is known; and what the INS gave
// back.
function coefficientTable(sets, parameters) {
  const known = sets.previous || sets.proposed;
  const names = listOf(known.parameters).map((p) => textOf(p.name));
  const sigmas = names.map((name) => listOf(parameters).find((p) => p.name === name)?.sigma);
  const decimals = sigmas.map((sigma) => Math.min(6, decimalsFor(sigma) + 1));
  const cells = (set) => names.map((name, k) => fixed(setValue(set, name), decimals[k]));
  const change = names.map((name) => setValue(sets.proposed, name) - setValue(sets.previous, name));
  const changeCell = (text, k) => element('span', {class: Math.abs(change[k]) < insignificant * sigmas[k] ? 'faint' : ''}, text);
  const same = names.map((name) => {
    if (!sets.pushed || !sets.read_back) {
      return '–';
    }
    return setValue(sets.pushed, name) === setValue(sets.read_back, name) ? '✔ equal' : element('span', {class: 'bad'}, '✘ differs');
  });
  return table([
    {title: 'parameter', cells: names, class: 'left'},
    {title: 'unit', cells: listOf(known.parameters).map((p) => unitSymbol(p.unit)), class: 'left'},
    {title: 'before: found in the INS', cells: cells(sets.previous)},
    {title: sets.pushed ? 'after: pushed' : 'after: proposed, not sent', cells: cells(sets.proposed)},
    {title: 'change', cells: change.map((value, k) => changeCell(signed(value, decimals[k]), k))},
    ...(sigmas.some((sigma) => sigma > 0) ? [{title: 'change in σ of the new value',
      cells: change.map((value, k) => changeCell(signed(value / sigmas[k], 1), k))}] : []),
    {title: 'read back', cells: cells(sets.read_back)},
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

function setWords(set) {
  return set ? `version ${textOf(set.version)} of ${textOf(set.date_utc)} by ${textOf(set.author)}` : 'none';
}

function showRun(report) {
  const run = report.run;
  if (!run) {
    hideSection('run');
    return;
  }
  const parts = [`Run ${textOf(run.run)} of ${textOf(run.ins)}, ${textOf(run.kind) || 'calibration'} by ${textOf(run.user)}, schedule ${textOf(run.schedule) || '–'}, `
      + `${textOf(run.started_utc)} to ${textOf(run.ended_utc) || 'now'}: ${textOf(run.state)}`];
  if (run.source) parts.push(`; not calibrated over the bus: recording of ${textOf(run.source)}`);
  if (run.reason) parts.push(`: ${textOf(run.reason)}`);
  if (run.force_reason) parts.push(`; forced: ${textOf(run.force_reason)}`);
  if (driftKnown(run)) {
    parts.push(`; drift ${significant(run.drift_before_m, 4)} m before, ${significant(run.drift_after_m, 4)} m after`);
  }
  document.getElementById('run-words').textContent = parts.join('') + '.';
  // With parameters they stand below their table.
  for (const warning of report.parameters ? [] : listOf(report.warnings)) {
    document.getElementById('run-story').append(element('p', {class: 'bad'}, 'Warning: ' + textOf(warning)));
  }
  showDrift(run);
  const sets = objectOf(run.coefficients);
  if (sets.previous || sets.proposed) {
    document.getElementById('coefficient-table').append(
        element('p', {class: 'note'}, `Before: ${setWords(sets.previous)}. ${sets.pushed ? 'Pushed' : 'Proposed, not sent'}: `
            + `${setWords(sets.proposed)}. ${textOf(objectOf(report.force).words)}`),
        coefficientTable(sets, report.parameters));
  }
  const events = listOf(run.events);
  document.getElementById('run-story').append(element('details', {},
      element('summary', {}, `${events.length} ${events.length === 1 ? 'event' : 'events'} of the run`), table([
        {title: 'UTC', cells: events.map((e) => textOf(e.utc)), class: 'left'},
        {title: 'kind', cells: events.map((e) => textOf(e.kind)), class: 'left'},
        {title: 'what', cells: events.map((e) => textOf(e.text)), class: 'words'}])));
}

// Years as decimals, for an axis.
function yearOf(utc) {
  const at = new Date(utc);
  const year = at.getUTCFullYear();
  return year + (at - Date.UTC(year, 0, 1)) / (Date.UTC(year + 1, 0, 1) - Date.UTC(year, 0, 1));
}

function showHistory(report) {
  const history = report.history;
  if (listOf(history?.runs).length === 0) {
    hideSection('history');
    return;
  }
  const runs = history.runs;
  document.getElementById('history-words').textContent =
      `${runs.length} runs of ${history.serial}. Values that took effect, with 1 σ bars; dotted: limit of the type.`;
  document.getElementById('history-table').append(table([
    {title: 'run', cells: runs.map((r) => textOf(r.run)), class: 'left'},
    {title: 'started (UTC)', cells: runs.map((r) => textOf(r.started_utc)), class: 'left'},
    {title: 'kind', cells: runs.map((r) => textOf(r.kind)), class: 'left'},
    {title: 'end', cells: runs.map((r) => textOf(r.state)), class: 'left'},
    {title: 'by', cells: runs.map((r) => textOf(r.user)), class: 'left'},
    {title: 'drift before (m)', cells: runs.map((r) => significant(r.drift_before_m ?? null, 4))},
    {title: 'drift after (m)', cells: runs.map((r) => significant(r.drift_after_m ?? null, 4))},
    {title: 'reason', cells: runs.map((r) => textOf(r.reason)), class: 'words'},
  ], {id: 'runs'}));
  const place = document.getElementById('history-plots');
  for (const parameter of listOf(history.parameters).filter((p) => listOf(p.values).length > 1)) {
    const slope = !parameter.change_per_year || Math.abs(parameter.change_per_year) < insignificant * parameter.change_per_year_sigma ? ''
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
