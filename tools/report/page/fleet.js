// All units: who is due, who drifts, when a limit is passed.
'use strict';

const soonDays = 30;
const unitDashes = [undefined, [8, 4], [2, 3], [10, 3, 2, 3]];

// A depot's hub says which sets it has; a set's own page has none.
function showSets(report) {
  const place = document.getElementById('set-table');
  if (!report.sets) {
    place.remove();
    return;
  }
  const sets = report.sets;
  place.append(element('h2', {}, 'Sets'), table([
    {title: 'set', cells: sets.map((s) => s.set), class: 'left'},
    {title: 'runs', cells: sets.map((s) => String(s.runs))},
    {title: 'sent last', cells: sets.map((s) => day(s.last_seen_utc)), class: 'left'},
    {title: 'refused', cells: sets.map((s) => String(s.refused))},
    {title: 'biased in', cells: sets.map((s) => (s.accused_of ? element('span', {class: 'bad'}, `✘ ${s.accused_of}`) : '–')), class: 'left'},
  ], {id: 'sets'}));
}

function dueState(unit) {
  if (unit.due_in_days === null) {
    return element('span', {class: 'bad'}, '✘ never calibrated');
  }
  if (unit.due_in_days < 0) {
    return element('span', {class: 'bad'}, `✘ overdue by ${-unit.due_in_days} days`);
  }
  return unit.due_in_days < soonDays ? element('span', {class: 'bad'}, `due in ${unit.due_in_days} days`)
                                     : element('span', {class: 'good'}, `✔ in ${unit.due_in_days} days`);
}

const day = (utc) => (utc ? utc.slice(0, 10) : '–');

function limitOf(unit) {
  const dates = unit.parameters.map((p) => p.passes_limit_utc).filter(Boolean).sort();
  return dates[0] ?? null;
}

function showUnits(report) {
  const units = [...report.units].sort((a, b) => (a.due_in_days ?? -1e9) - (b.due_in_days ?? -1e9));
  document.getElementById('unit-table').append(table([
    {title: 'unit', cells: units.map((u) => u.serial), class: 'left'},
    {title: 'last calibrated', cells: units.map((u) => day(u.last_run?.started_utc)), class: 'left'},
    {title: 'due', cells: units.map((u) => day(u.due_utc)), class: 'left'},
    ...(units.some((u) => u.due_for) ? [{title: 'for', cells: units.map((u) => u.due_for ?? '–'), class: 'left'}] : []),
    {title: 'state', cells: units.map(dueState), class: 'left'},
    {title: 'runs', cells: units.map((u) => String(u.runs.length))},
    {title: 'parameters that drift', cells: units.map((u) => String(u.parameters.filter((p) => p.drifts).length))},
    {title: 'first limit passed', cells: units.map((u) => day(limitOf(u))), class: 'left'},
    {title: 'drift before (m)', cells: units.map((u) => significant(u.last_run?.drift_before_m ?? null, 4))},
    {title: 'drift after (m)', cells: units.map((u) => significant(u.last_run?.drift_after_m ?? null, 4))},
  ], {id: 'values'}));
}

function showDrifts(report) {
  const rows = report.units.flatMap((unit) => unit.parameters
      .filter((p) => p.drifts || p.passes_limit_utc || p.warnings.length > 0).map((p) => ({serial: unit.serial, ...p})));
  const place = document.getElementById('drift-table');
  if (rows.length === 0) {
    place.append(element('p', {}, 'No parameter of any unit drifts or comes near its limit.'));
    return;
  }
  const last = (p) => p.values.at(-1);
  place.append(table([
    {title: 'unit', cells: rows.map((p) => p.serial), class: 'left'},
    {title: 'parameter', cells: rows.map((p) => p.name), class: 'left'},
    {title: 'last value', cells: rows.map((p) => significant(last(p)?.value ?? null, 4))},
    {title: 'a year', cells: rows.map((p) => significant(p.change_per_year ?? null, 3))},
    {title: 'σ', cells: rows.map((p) => significant(p.change_per_year_sigma ?? null, 2))},
    {title: 'limit', cells: rows.map((p) => significant(p.limit, 3))},
    {title: 'unit of measure', cells: rows.map((p) => unitSymbol(p.unit)), class: 'left'},
    {title: 'passes it', cells: rows.map((p) => day(p.passes_limit_utc)), class: 'left'},
    {title: 'at the earliest', cells: rows.map((p) => day(p.passes_limit_earliest_utc)), class: 'left'},
    {title: 'remarks', cells: rows.map((p) => p.warnings.join('; ') || '–'), class: 'words'},
  ], {id: 'drifts'}));
}

function trendSpec(report, name, units) {
  const of = (unit) => unit.parameters.find((p) => p.name === name);
  const years = [...new Set(units.flatMap((u) => of(u)?.values.map((v) => v.year) ?? []))].sort((a, b) => a - b);
  const known = units.map(of).find(Boolean);
  const series = units.map((unit, k) => {
    const at = new Map((of(unit)?.values ?? []).map((v) => [v.year, v]));
    return {label: unit.serial, colour: axisColours[k % 3], dash: unitDashes[k % 4], spanGaps: true, marks: true,
            values: years.map((year) => at.get(year)?.value ?? null), errors: years.map((year) => at.get(year)?.sigma ?? null)};
  });
  const limit = known?.limit;
  const largest = Math.max(...series.flatMap((s) => s.values.map((v) => Math.abs(v ?? 0))));
  return {id: 'trend-' + name, title: name, x: {label: 'time', unit: 'year', values: years},
          y: {label: 'value', unit: known?.unit ?? ''}, series,
          levels: limit && largest > 0.3 * limit ? [limit, -limit] : []};
}

function showTrends(report) {
  const place = document.getElementById('trend-plots');
  const choice = document.getElementById('unit-choice');
  choice.append(element('option', {value: ''}, 'all units'), ...report.units.map((u) => element('option', {value: u.serial}, u.serial)));
  const draw = () => {
    dropPlots(place);
    const units = report.units.filter((u) => choice.value === '' || u.serial === choice.value);
    for (const parameter of report.units[0]?.parameters ?? []) {
      const spec = trendSpec(report, parameter.name, units);
      if (spec.x.values.length > 0) {
        addPlot(place, spec);
      }
    }
  };
  if (report.units.length > 8) {   // more lines than anybody can tell apart
    choice.value = report.units[0].serial;
  }
  choice.addEventListener('change', draw);
  draw();
}

function showFleet(report) {
  document.title = 'Calibration of all units';
  const due = report.units.filter((u) => u.due_in_days === null || u.due_in_days < 0);
  const drifting = report.units.filter((u) => u.parameters.some((p) => p.drifts));
  const passing = report.units.filter(limitOf);
  const named = (units) => units.slice(0, 8).map((u) => u.serial).join(', ') + (units.length > 8 ? ' …' : '');
  const list = (units) => (units.length === 0 ? '' : ` (${named(units)})`);
  showBanner({standing: due.length === 0 ? 'good' : 'bad',
              verdict: `${due.length} of ${report.units.length} units are due${list(due)}; ${drifting.length} drift${list(drifting)}; `
                  + `${passing.length} will pass a limit within 20 years${list(passing)}.`});
  fillFacts([['As of', report.as_of_utc], ['Interval', `${significant(report.interval_days, 4)} days`],
             ['Units', String(report.units.length)]]);
  showOrigin(report);
  showSets(report);
  showUnits(report);
  showDrifts(report);
  showTrends(report);
}
