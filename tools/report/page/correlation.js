// The correlation matrix as a map of squares: size and colour say the same, the title says the number.
'use strict';

function showCorrelation(report) {
  const names = report.parameters.map((parameter) => parameter.name);
  const cell = 26;
  const left = 190;
  const top = 175;
  const size = names.length * cell;
  const svg = svgElement('svg', {viewBox: `0 0 ${left + size + 10} ${top + size + 40}`, role: 'img',
                                 'aria-label': 'Correlation of the 24 parameters\' errors'});
  names.forEach((name, k) => {
    const along = left + k * cell + cell / 2;
    const down = top + k * cell + cell / 2 + 4;
    svg.append(svgElement('text', {x: left - 6, y: down, 'text-anchor': 'end'}, name));
    svg.append(svgElement('text', {transform: `translate(${along + 4} ${top - 6}) rotate(-90)`}, name));
  });
  report.correlation.forEach((row, i) => later(() => row.forEach((value, j) => {
    const title = `${names[i]} and ${names[j]}: ${significant(value, 3)}`;
    svg.append(sigmaSquare(left + j * cell, top + i * cell, cell, cell, (value ?? 0) * fullSigma, title));
  })));
  svg.append(svgElement('g', {transform: `translate(${left} ${top + size + 14})`},
      svgElement('rect', {width: 12, height: 12, style: 'fill: var(--x)'}), svgElement('text', {x: 17, y: 10}, 'positive'),
      svgElement('rect', {x: 80, width: 12, height: 12, style: 'fill: var(--y)'}),
      svgElement('text', {x: 97, y: 10}, 'negative; the area of a square is the size of the correlation (unit 1)')));
  addSvgFigure(document.getElementById('correlation-map'), {
    id: 'correlation-matrix', title: 'Correlation matrix', svg,
    columns: [{title: 'parameter', values: names},
              ...names.map((name, j) => ({title: name, values: report.correlation.map((row) => row[j])}))]});
}
