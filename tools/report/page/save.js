// Saving what a plot shows: CSV, JSON, SVG, PNG.
'use strict';

function saveBlob(name, type, content) {
  const link = element('a', {download: name});
  link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], {type}));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// All numbers of a plot as columns, units in the titles.
function plotColumns(spec) {
  const title = (what, unit) => (unit ? `${what} (${unitSymbol(unit)})` : what);
  const columns = [{title: title(spec.x.label, spec.x.unit), values: spec.x.values}];
  for (const series of spec.series) {
    columns.push({title: title(series.label, spec.y.unit), values: series.values});
    if (series.errors) {
      columns.push({title: title('σ of ' + series.label.replace(', ±1 σ', ''), spec.y.unit), values: series.errors});
    }
  }
  return columns;
}

// columns: [{title, values}]
function columnsCsv(columns) {
  const quote = (text) => (/[",\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text);
  const lines = [columns.map((column) => quote(column.title)).join(',')];
  for (let row = 0; row < columns[0].values.length; ++row) {
    lines.push(columns.map((column) => quote(String(column.values[row] ?? ''))).join(','));
  }
  return lines.join('\n') + '\n';
}

// The plot again as vectors, from uPlot's own scales and ticks.
function svgText(spec, plot, ticks) {
  const ratio = devicePixelRatio;
  const width = plot.width;
  const top = 24;
  const height = plot.height + top;
  const place = (value, scale) => plot.valToPos(value, scale, true) / ratio;
  const box = {left: plot.bbox.left / ratio, top: plot.bbox.top / ratio,
               width: plot.bbox.width / ratio, height: plot.bbox.height / ratio};
  const text = cssColour('text');
  const body = svgElement('g', {transform: `translate(0 ${top})`, 'font-family': 'sans-serif', 'font-size': 11});
  body.append(svgElement('rect', {x: box.left, y: box.top, width: box.width, height: box.height, fill: 'none',
                                  stroke: cssColour('rule')}));
  for (const {at, label} of ticks.x) {
    body.append(svgElement('text', {x: place(at, 'x'), y: box.top + box.height + 14, 'text-anchor': 'middle',
                                    fill: text}, label));
  }
  for (const {at, label} of ticks.y) {
    body.append(svgElement('text', {x: box.left - 5, y: place(at, 'y') + 4, 'text-anchor': 'end', fill: text}, label));
  }
  body.append(svgElement('text', {x: box.left + box.width / 2, y: box.top + box.height + 30, 'text-anchor': 'middle',
                                  fill: text}, axisTitle(spec.x)));
  body.append(svgElement('text', {transform: `translate(12 ${box.top + box.height / 2}) rotate(-90)`,
                                  'text-anchor': 'middle', fill: text}, axisTitle(spec.y)));
  const clip = svgElement('clipPath', {id: 'inside'}, svgElement('rect', {x: box.left, y: box.top, width: box.width,
                                                                          height: box.height}));
  const lines = svgElement('g', {'clip-path': 'url(#inside)', fill: 'none'});
  for (const series of spec.series) {
    lines.append(svgSeries(spec, series, place));
  }
  body.append(svgElement('defs', {}, clip), lines);
  const svg = svgElement('svg', {xmlns: svgNamespace, width, height, viewBox: `0 0 ${width} ${height}`},
                         svgElement('rect', {width, height, fill: cssColour('ground')}),
                         svgElement('text', {x: 8, y: 16, 'font-family': 'sans-serif', 'font-size': 13, fill: text},
                                    spec.title), body);
  return new XMLSerializer().serializeToString(svg);
}

function svgSeries(spec, series, place) {
  const colour = cssColour(series.colour);
  const group = svgElement('g');
  for (const [x, low, high] of errorBars(spec, series)) {
    const across = place(x, 'x').toFixed(2);
    group.append(svgElement('line', {x1: across, x2: across, y1: place(low, 'y').toFixed(2), y2: place(high, 'y').toFixed(2),
                                     stroke: colour}));
  }
  let path = '';
  spec.x.values.forEach((x, row) => {
    const y = (series.shown || series.values)[row];
    if (y === null || y === undefined) {
      path += path.endsWith(' ') || path === '' ? '' : ' ';
      return;
    }
    const at = `${place(x, 'x').toFixed(2)} ${place(y, 'y').toFixed(2)}`;
    if (series.points) {
      group.append(svgElement('circle', {cx: at.split(' ')[0], cy: at.split(' ')[1], r: 3, fill: colour}));
    } else {
      path += (path === '' || path.endsWith(' ') ? 'M' : 'L') + at;
    }
  });
  if (path !== '') {
    group.append(svgElement('path', {d: path, stroke: colour, 'stroke-width': series.thin ? 0.8 : 1.6,
                                     'stroke-dasharray': (series.dash || []).join(' ')}));
  }
  return group;
}

// The canvas under a title and a legend.
function pngBlob(spec, plot) {
  const source = plot.ctx.canvas;
  const ratio = devicePixelRatio;
  const head = 44 * ratio;
  const canvas = element('canvas');
  canvas.width = source.width;
  canvas.height = source.height + head;
  const to = canvas.getContext('2d');
  to.fillStyle = cssColour('ground');
  to.fillRect(0, 0, canvas.width, canvas.height);
  to.fillStyle = cssColour('text');
  to.font = `${14 * ratio}px sans-serif`;
  to.fillText(spec.title, 8 * ratio, 18 * ratio);
  to.font = `${11 * ratio}px sans-serif`;
  let across = 8 * ratio;
  for (const series of spec.series) {
    to.fillStyle = cssColour(series.colour);
    to.fillText('■ ' + series.label, across, 36 * ratio);
    across += to.measureText('■ ' + series.label).width + 14 * ratio;
  }
  to.drawImage(source, 0, head);
  return new Promise((resolve) => canvas.toBlob(resolve, 'image/png'));
}
