// The misfit map: position x sensor x time since the turn. The area of a square is the size in sigma, its colour the sign.
'use strict';

const sensorNames = ['gyro x', 'gyro y', 'gyro z', 'accelerometer x', 'accelerometer y', 'accelerometer z'];
const fullSigma = 6;   // a square fills its cell from here on

function binNames(map) {
  return ['turn', ...map.edges_s.slice(1).map((end, k) => `${map.edges_s[k]}–${end}`)];
}

function sigmaSquare(x, y, width, height, z, title) {
  const part = Math.sqrt(Math.min(1, Math.abs(z) / fullSigma));
  const group = svgElement('g');
  group.append(svgElement('rect', {x: x + width * (1 - part) / 2, y: y + height * (1 - part) / 2, width: width * part,
                                   height: height * part, style: `fill: var(--${z < 0 ? 'y' : 'x'})`}),
               svgElement('rect', {x, y, width, height, style: 'stroke: var(--rule)', 'fill-opacity': 0},
                          svgElement('title', {}, title)));
  return group;
}

// One sensor: positions across, time since the turn downwards.
function sensorPanel(map, axis, z, at) {
  const cells = map.cells;
  const bins = binNames(map);
  const positions = Math.max(...cells.position);
  const width = 300 / positions;
  const height = 15;
  const panel = svgElement('g', {transform: `translate(${at.x} ${at.y})`});
  panel.append(svgElement('text', {x: 0, y: -6, 'font-weight': 'bold'}, sensorNames[axis]));
  bins.forEach((name, k) => panel.append(svgElement('text', {x: -5, y: k * height + 11, 'text-anchor': 'end'}, name)));
  const every = Math.ceil(positions / 20);
  for (let p = 1; p <= positions; p += every) {
    panel.append(svgElement('text', {x: (p - 0.5) * width, y: bins.length * height + 12, 'text-anchor': 'middle',
                                     style: 'font-size: 9px'}, String(p)));
  }
  cells.axis.forEach((cellAxis, k) => {
    if (cellAxis === axis) {
      const title = `${sensorNames[axis]}, position ${cells.position[k]}, ${bins[cells.bin[k] + 1]}: ${significant(z[k], 3)} σ`;
      panel.append(sigmaSquare((cells.position[k] - 1) * width, (cells.bin[k] + 1) * height, width, height, z[k], title));
    }
  });
  panel.append(svgElement('text', {x: 150, y: bins.length * height + 26, 'text-anchor': 'middle'}, 'position (number)'),
               svgElement('text', {transform: `translate(-52 ${bins.length * height / 2}) rotate(-90)`,
                                   'text-anchor': 'middle'}, 'time since turn (s)'));
  return panel;
}

function addMisfitMap(parent, map, id, title, bias) {
  const z = bias.map((value, k) => value / map.cells.sigma[k]);
  const svg = svgElement('svg', {viewBox: '0 0 780 500', role: 'img', 'aria-label': title + ', in sigma'});
  for (let axis = 0; axis < 6; ++axis) {
    later(() => svg.append(sensorPanel(map, axis, z, {x: 70 + 395 * (axis % 2), y: 20 + 155 * Math.floor(axis / 2)})));
  }
  svg.append(svgElement('rect', {x: 70, y: 482, width: 11, height: 11, style: 'fill: var(--x)'}),
             svgElement('text', {x: 86, y: 491}, 'too high'),
             svgElement('rect', {x: 150, y: 482, width: 11, height: 11, style: 'fill: var(--y)'}),
             svgElement('text', {x: 166, y: 491}, `too low; the area of a square is the misfit in σ, full from ${fullSigma} σ on`));
  const names = binNames(map);
  const cells = map.cells;
  addSvgFigure(parent, {id, title, svg, columns: [
    {title: 'sensor', values: cells.axis.map((axis) => sensorNames[axis])},
    {title: 'position', values: cells.position.map(String)},
    {title: 'time since turn (s)', values: cells.bin.map((bin) => names[bin + 1])},
    {title: 'bias', values: bias},
    {title: 'σ', values: cells.sigma},
    {title: 'unit', values: cells.axis.map((axis) => (axis < 3 ? 'deg/h' : 'ug'))},
    {title: 'bias/σ', values: z}]});
}
