// The page of a plan: one schedule, or two beside each other.
'use strict';

const planColours = ['x', 'y'];
const planDashes = [undefined, [7, 4]];

function planSummary(plans) {
  const words = plans.map((plan) => {
    const missed = plan.parameters.filter((p) => !p.determined).map((p) => p.name);
    const minutes = significant(plan.duration_s / 60, 3);
    return missed.length === 0 ? `${plan.name} meets every tolerance in ${minutes} min.`
        : `${plan.name} (${minutes} min) leaves ${missed.length} of ${plan.parameters.length} beyond tolerance: ${missed.join(', ')}.`;
  });
  return {standing: plans[0].meets_tolerances ? 'good' : 'bad', verdict: words.join(' ')};
}

function showAccuracy(plans) {
  const first = plans[0].parameters;
  const columns = [{title: 'parameter', cells: first.map((p) => p.name), class: 'left'},
                   {title: 'unit', cells: first.map((p) => unitSymbol(p.unit)), class: 'left'},
                   {title: 'tolerance', cells: first.map((p) => significant(p.tolerance ?? null, 3))}];
  for (const plan of plans) {
    columns.push({title: `σ, ${plan.name}`, cells: plan.parameters.map((p) => significant(p.sigma, 3))},
                 {title: 'of the tolerance', cells: plan.parameters.map((p) => (p.tolerance ? shareBar(p.sigma / p.tolerance) : '–')), class: 'left'},
                 {title: 'met', cells: plan.parameters.map((p) => (p.determined ? element('span', {class: 'good'}, '✔ yes')
                                                                             : element('span', {class: 'bad'}, '✘ no'))), class: 'left'});
  }
  if (plans.length > 1) {
    columns.push({title: 'ratio of σ, second to first', cells: first.map((p, k) => significant(plans[1].parameters[k].sigma / p.sigma, 3))});
  }
  document.getElementById('accuracy-table').append(table(columns, {id: 'values'}));
  for (const plan of plans) {
    for (const warning of plan.warnings) {
      document.getElementById('plan-warnings').append(element('p', {class: 'bad'}, `${plan.name}: ${warning}`));
    }
  }
}

function showTimelines(plans) {
  const place = document.getElementById('timeline-plots');
  const longest = Math.max(...plans.map((plan) => plan.duration_s)) / 60;
  plans.forEach((plan, number) => {
    addPlot(place, {
      id: 'timeline-' + number,
      title: `${plan.name}: ${plan.positions.length} positions, ${significant(plan.duration_s / 60, 3)} min`,
      x: {label: 'time', unit: 'min', values: plan.track.time_s.map((at) => at / 60), range: [0, longest]},
      y: {label: 'gimbal angle', unit: 'deg', steps: angleSteps},
      series: [{label: 'outer', colour: 'x', values: plan.track.outer_deg},
               {label: 'inner', colour: 'y', dash: [6, 3], values: plan.track.inner_deg}],
    });
    const positions = plan.positions;
    place.append(element('details', {}, element('summary', {}, `${plan.name}: the positions as numbers`), table([
      {title: 'position', cells: positions.map((p) => String(p.position)), class: 'left'},
      {title: 'from (s)', cells: positions.map((p) => p.start_s.toFixed(1))},
      {title: 'dwell (s)', cells: positions.map((p) => p.dwell_s.toFixed(1))},
      {title: 'outer (°)', cells: positions.map((p) => p.outer_deg.toFixed(1))},
      {title: 'inner (°)', cells: positions.map((p) => p.inner_deg.toFixed(1))}])));
  });
}

// Both schedules on one axis: every end of a position of either, gaps where the other has none.
function showForecasts(plans) {
  const place = document.getElementById('forecast-plots');
  const times = [...new Set(plans.flatMap((plan) => plan.history.map((h) => h.end_s)))].sort((a, b) => a - b);
  plans[0].parameters.forEach((parameter, index) => {
    const series = plans.map((plan, number) => {
      const at = new Map(plan.history.map((h) => [h.end_s, h.sigma[index]]));
      return {label: plan.name, colour: planColours[number], dash: planDashes[number], spanGaps: true,
              values: times.map((time) => at.get(time) ?? null)};
    });
    const seen = series.flatMap((s) => s.values).filter((v) => v > 0);
    const level = parameter.tolerance;
    // Whole decades: uPlot counts a logarithmic axis up from its lower end.
    const low = 10 ** Math.floor(Math.log10(Math.min(...seen, level ?? Infinity)));
    const high = 10 ** Math.ceil(Math.log10(Math.max(...seen, level ?? 0)));
    addPlot(place, {
      id: 'forecast-' + parameter.name,
      title: parameter.name,
      x: {label: 'time', unit: 'min', values: times.map((time) => time / 60)},
      y: {label: 'σ', unit: parameter.unit, log: true, range: [low, high]},
      series, level,
    });
  });
}

function showPlan(report) {
  document.title = 'Calibration plan';
  const plans = report.plans;
  showBanner(planSummary(plans));
  const at = report.installation;
  fillFacts([
    ['Base', `roll ${fixed(at.roll_deg, 2)}°, pitch ${fixed(at.pitch_deg, 2)}°, heading ${fixed(at.heading_deg, 2)}°`],
    ['Site', `latitude ${significant(at.latitude_deg, 4)}°, height ${significant(at.height_m, 3)} m`],
    ['Angle random walk', `${significant(at.gyro_arw_deg_per_sqrt_h, 3)} °/√h`],
    ['Velocity random walk', `${significant(at.accel_vrw_ug_per_sqrt_hz, 3)} µg/√Hz`],
    ['Known position', `${significant(at.position_sigma_m, 3)} m at 1 Hz`],
  ]);
  showOrigin(report);
  later(() => showAccuracy(plans), () => showTimelines(plans),
        ...plans.map((plan, number) => () => addSphere(document.getElementById('sphere-plots'), plan, number)),
        () => showForecasts(plans));
}
