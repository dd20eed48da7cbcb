// The tables of passes, consistency, segments and what was not determined.
'use strict';

function showPasses(report) {
  const passes = listOf(report.passes);
  document.getElementById('pass-table').append(table([
    {title: 'pass', cells: passes.map((p, k) => `${k + 1} ${textOf(p.direction)}`), class: 'left'},
    {title: 'data (s)', cells: passes.map((p) => significant(p.seconds, 5))},
    {title: 'mean NIS (1 expected)', cells: passes.map((p) => significant(p.nis_mean, 4))},
    {title: 'largest move (σ)', cells: passes.map((p) => significant(p.largest_move_sigma, 3))},
  ]));
}

function showConsistency(report) {
  const c = objectOf(report.consistency);
  document.getElementById('consistency-words').textContent =
      `${textOf(c.words)} Mean NIS ${significant(c.nis_mean, 4)}, ${significant(c.nis_low, 4)} to ` +
      `${significant(c.nis_high, 4)} expected of a right model; whiteness p ${c.whiteness_p_value === 0 ? 'below 10⁻³⁰⁰' : '= ' + significant(c.whiteness_p_value, 2)}; ` +
      `forward and reverse passes differ by at most ${significant(c.parity_max_sigma, 2)} σ.`;
  const n = objectOf(report.noise);
  document.getElementById('noise-words').textContent =
      `In use: angle random walk ${significant(n.gyro_arw_deg_per_sqrt_h, 3)} °/√h, velocity random walk ` +
      `${significant(n.accel_vrw_ug_per_sqrt_hz, 3)} µg/√Hz, position ${significant(n.position_sigma_m, 3)} m. ` +
      'Below: Allan deviation of each sensor, from the dwells, and the noise terms of IEEE Std 952 that it supports.';
}

function showSegments(report) {
  const dwells = listOf(report.segments).filter((segment) => segment.kind === 'dwell');
  const details = element('details', {}, element('summary', {}, `The ${dwells.length} positions as numbers`), table([
    {title: 'position', cells: dwells.map((d, k) => String(k + 1)), class: 'left'},
    {title: 'from (s)', cells: dwells.map((d) => fixed(d.start_s, 1))},
    {title: 'to (s)', cells: dwells.map((d) => fixed(d.end_s, 1))},
    {title: 'outer (°)', cells: dwells.map((d) => fixed(d.outer_deg, 2))},
    {title: 'inner (°)', cells: dwells.map((d) => fixed(d.inner_deg, 2))},
    {title: 'NIS', cells: dwells.map((d) => significant(d.nis_mean, 4))},
    {title: 'updates', cells: dwells.map((d) => textOf(d.epochs))},
  ]));
  document.getElementById('segment-table').append(details);
}

// The parts of a direction that make it up, largest first: enough of them that a tenth of its square is left out.
function mainParts(direction) {
  const parts = Object.entries(objectOf(direction)).filter(([, part]) => Number.isFinite(part))
      .sort((a, b) => Math.abs(b[1]) - Math.abs(a[1]));
  const whole = parts.reduce((sum, [, part]) => sum + part * part, 0);
  let kept = 0;
  return parts.filter(([, part]) => {
    const wanted = kept < 0.9 * whole;
    kept += part * part;
    return wanted;
  });
}

const directionsShown = 6;

function showUndetermined(report) {
  const place = document.getElementById('undetermined');
  const directions = listOf(report.undetermined);
  if (directions.length === 0) {
    place.append(element('p', {}, 'Every direction in the space of the 24 parameters was determined to its tolerance.'));
    return;
  }
  for (const direction of directions.slice(0, directionsShown)) {
    const parts = mainParts(direction.direction_in_tolerances)
        .map(([name, part]) => `${part < 0 ? '−' : '+'}${Math.abs(part).toFixed(2)} ${name}`);
    place.append(element('p', {}, textOf(direction.words) + ' ',
                         element('span', {class: 'note'}, `(in tolerances: ${parts.join(', ')})`)));
  }
  if (directions.length > directionsShown) {
    place.append(element('p', {class: 'note'}, `And ${directions.length - directionsShown} more directions.`));
  }
}
