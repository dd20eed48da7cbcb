// A recording laid over its simulation, with the bands that their length allows.
'use strict';

const overlayPlaces = {'spectra': 'spectra', 'Allan deviation': 'allan', 'innovations': 'innovations',
                       'histogram of the innovations': 'histogram'};

function overlayPlot(given) {
  const curve = objectOf(given);
  const [x, y] = [objectOf(curve.x), objectOf(curve.y)];
  const place = Object.hasOwn(overlayPlaces, textOf(curve.what)) ? overlayPlaces[curve.what] : '';
  if (!place || listOf(curve.values).length === 0) {
    return;
  }
  const logX = x.log === true;
  const logY = y.log === true;
  const drawn = (list) => listOf(list).map((value) => (Number.isFinite(value) && (!logY || value > 0) ? value : null));
  const line = (label, key, more) => ({label, values: drawn(curve[key]), ...more});
  addPlot(document.getElementById(`${place}-plots`), {
    id: `overlay-${textOf(curve.id)}`,
    title: textOf(curve.title),
    height: 260,
    x: {label: textOf(x.label), unit: textOf(x.unit), log: logX, values: curve.values},
    y: {label: textOf(y.label), unit: textOf(y.unit), log: logY},
    series: [line('recording', 'recording', {colour: 'x', points: true, small: true}),
             line('simulation', 'simulation', {colour: 'y'}),
             line('95 %, high', 'high', {colour: 'y', thin: true, dash: [3, 3]}),
             line('95 %, low', 'low', {colour: 'y', thin: true, dash: [3, 3]})],
    band: [3, 4],
  });
}

function showJudgements(report) {
  const all = listOf(report.judgements).map(objectOf);
  const percent = (share) => `${fixed(100 * share, 1)} %`;
  document.getElementById('judgement-table').append(table([
    {title: 'what', cells: all.map((j) => textOf(j.what)), class: 'left'},
    {title: 'points', cells: all.map((j) => textOf(j.points))},
    {title: 'inside the band', cells: all.map((j) => percent(j.share))},
    {title: 'expected', cells: all.map((j) => percent(j.expected_share))},
    {title: 'least', cells: all.map((j) => percent(j.least_share))},
    {title: '', cells: all.map((j) => element('span', {class: j.agrees ? '' : 'bad'}, j.agrees ? '✔ agrees' : '✘ differs')), class: 'left'},
  ], {id: 'judgements'}));
  const worst = all.flatMap((j) => listOf(j.worst).map(textOf));
  if (worst.length > 0) {
    document.getElementById('judgement-places').append(
        element('p', {}, 'Where they differ, the worst first:'), element('ul', {}, ...worst.map((words) => element('li', {}, words))));
  }
}

function showOverlay(report) {
  document.title = `${textOf(objectOf(report.input).name)} over ${textOf(report.against)}`;
  later(() => showVerdict(report), () => showOrigin(report),
        () => fillFacts([['Simulation', textOf(report.against)]]), () => showJudgements(report),
        ...listOf(report.curves).map((curve) => () => overlayPlot(curve)));
}
