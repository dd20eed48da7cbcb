// Gravity in b on the unit sphere, seen from two opposite sides; turned by dragging or with the arrow keys.
'use strict';

function viewAxes(view) {
  const [a, e] = [view.azimuth, view.elevation];
  return {
    towards: [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)],
    right: [-Math.sin(a), Math.cos(a), 0],
    up: [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)],
  };
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function graticule() {
  const circles = [];
  const circle = (point) => Array.from({length: 61}, (_, k) => point(2 * Math.PI * k / 60));
  for (const latitude of [-60, -30, 0, 30, 60]) {
    const s = Math.sin(latitude * Math.PI / 180);
    const c = Math.cos(latitude * Math.PI / 180);
    circles.push(circle((t) => [c * Math.cos(t), c * Math.sin(t), s]));
  }
  for (let k = 0; k < 6; ++k) {
    const a = k * Math.PI / 6;
    circles.push(circle((t) => [Math.cos(t) * Math.cos(a), Math.cos(t) * Math.sin(a), Math.sin(t)]));
  }
  return circles;
}

// A label lies on the lines of the track: they end before its letters.
const halo = 'paint-order: stroke; stroke: var(--ground); stroke-width: 8px; stroke-linejoin: round';

// One side of the sphere at (cx, cy); what lies behind is left to the other side.
function drawSide(group, plan, axes, cx, cy, radius) {
  const flat = (p) => [cx + radius * dot(p, axes.right), cy - radius * dot(p, axes.up)];
  const shown = (p) => dot(p, axes.towards) >= 0;
  const line = (points, style) => {
    let path = '';
    let on = false;
    for (const point of points) {
      if (!shown(point)) {
        on = false;
        continue;
      }
      const [x, y] = flat(point);
      path += `${on ? 'L' : 'M'}${x.toFixed(1)} ${y.toFixed(1)}`;
      on = true;
    }
    group.append(svgElement('path', {d: path, style}));
  };
  group.append(svgElement('circle', {cx, cy, r: radius, style: 'fill: var(--ground); stroke: var(--faint)'}));
  for (const circle of graticule()) {
    line(circle, 'fill: none; stroke: var(--rule)');
  }
  line(plan.track.gravity_b, 'fill: none; stroke: var(--x); stroke-width: 1.6');
  [['x', [1, 0, 0]], ['y', [0, 1, 0]], ['z', [0, 0, 1]]].forEach(([name, unit]) => {
    for (const sign of [1, -1]) {
      const point = unit.map((value) => sign * value);
      if (shown(point)) {
        const [x, y] = flat(point);
        group.append(svgElement('text', {x, y: y + 19, 'text-anchor': 'middle', style: 'font-weight: bold; ' + halo},
                                (sign > 0 ? '+' : '−') + name));
      }
    }
  });
  // Positions that share a direction share a mark.
  const marks = new Map();
  for (const position of plan.positions) {
    const key = position.gravity_b.map((value) => Math.round(50 * value)).join();
    marks.set(key, {at: position.gravity_b, names: [...(marks.get(key)?.names ?? []), position.position]});
  }
  for (const {at, names} of marks.values()) {
    if (shown(at)) {
      const [x, y] = flat(at);
      group.append(svgElement('circle', {cx: x, cy: y, r: 5, style: 'fill: var(--y)'}),
                   svgElement('text', {x: x > cx ? x - 7 : x + 7, y: y - 7, 'text-anchor': x > cx ? 'end' : 'start', style: halo},
                              names.join(' ')));
    }
  }
}

function addSphere(parent, plan, number) {
  const svg = svgElement('svg', {viewBox: '0 0 780 400', role: 'img', tabindex: '0',
                                 'aria-label': `Gravity in b, schedule ${plan.name}: unit sphere, arrow keys turn it`});
  const view = {azimuth: 0.6, elevation: 0.45};
  const draw = () => {
    svg.replaceChildren();
    const axes = viewAxes(view);
    const back = {towards: axes.towards.map((v) => -v), right: axes.right.map((v) => -v), up: axes.up};
    drawSide(svg, plan, axes, 195, 195, 160);
    drawSide(svg, plan, back, 585, 195, 160);
    svg.append(svgElement('text', {x: 195, y: 392, 'text-anchor': 'middle'}, 'this side (direction of gravity in b, unit vector)'),
               svgElement('text', {x: 585, y: 392, 'text-anchor': 'middle'}, 'the other side'));
  };
  const turn = (azimuth, elevation) => {
    view.azimuth += azimuth;
    view.elevation = Math.max(-1.5, Math.min(1.5, view.elevation + elevation));
    draw();
  };
  svg.addEventListener('keydown', (event) => {
    const step = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[event.key];
    if (step) {
      turn(...step);
      event.preventDefault();
    }
  });
  svg.addEventListener('pointermove', (event) => {
    if (event.buttons === 1) {
      turn(-0.01 * event.movementX, 0.01 * event.movementY);
    }
  });
  draw();
  const part = (k) => plan.positions.map((p) => p.gravity_b[k]);
  addSvgFigure(parent, {id: 'sphere-' + number, title: plan.name, svg, columns: [
    {title: 'position', values: plan.positions.map((p) => String(p.position))},
    {title: 'gravity x_b (1)', values: part(0)}, {title: 'gravity y_b (1)', values: part(1)},
    {title: 'gravity z_b (1)', values: part(2)}]});
}
