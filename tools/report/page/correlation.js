// The correlation matrix as a map of squares: size and colour say the same, the title says the number.
'use strict';

function correlationColour(value) {
  return value < 0 ? 'var(--y)' : 'var(--x)';
}

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
  report.correlation.forEach((row, i) => row.forEach((value, j) => {
    const half = Math.sqrt(Math.min(1, Math.abs(value ?? 0))) * (cell - 3) / 2;
    const across = left + j * cell;
    const down = top + i * cell;
    const square = svgElement('rect', {x: across + cell / 2 - half, y: down + cell / 2 - half, width: 2 * half,
                                       height: 2 * half, style: `fill: ${correlationColour(value)}`});
    const frame = svgElement('rect', {x: across, y: down, width: cell, height: cell, style: 'stroke: var(--rule)',
                                      'fill-opacity': 0});
    frame.append(svgElement('title', {}, `${names[i]} and ${names[j]}: ${significant(value, 3)}`));
    svg.append(square, frame);
  }));
  const key = svgElement('g', {transform: `translate(${left} ${top + size + 14})`},
      svgElement('rect', {width: 12, height: 12, style: 'fill: var(--x)'}), svgElement('text', {x: 17, y: 10}, 'positive'),
      svgElement('rect', {x: 80, width: 12, height: 12, style: 'fill: var(--y)'}),
      svgElement('text', {x: 97, y: 10}, 'negative; the area of a square is the size of the correlation (unit 1)'));
  svg.append(key);
  const place = document.getElementById('correlation-map');
  const figure = element('figure', {}, element('header', {}, element('h3', {}, 'Correlation matrix'),
                                               correlationTools(names, report.correlation)), svg);
  const details = element('details', {}, element('summary', {}, 'Numbers'));
  details.addEventListener('toggle', () => {
    if (details.open && details.children.length === 1) {
      details.append(table([{title: '', cells: names, class: 'left'}, ...names.map(
          (name, j) => ({title: name, cells: report.correlation.map((row) => significant(row[j], 3))}))]));
    }
  });
  figure.append(details);
  place.append(figure);
}

function correlationTools(names, rows) {
  const button = element('button', {type: 'button'}, 'CSV');
  button.addEventListener('click', () => saveBlob('correlation.csv', 'text/csv',
      ['', ...names].join(',') + '\n' + rows.map((row, i) => [names[i], ...row].join(',')).join('\n') + '\n'));
  return element('div', {class: 'tools'}, button);
}
