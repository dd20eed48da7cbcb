// One plot: a figure with title, legend, uPlot canvas, read-out, saving, and its numbers as a table.
//
// spec: {id, title, height, x: {label, unit, values, log}, y: {label, unit, log, asinh, steps, range: [low, high]},
//        (asinh: linear up to this value on either side of zero and logarithmic beyond; steps: the steps that the ticks
//        may have)
//        series: [{label, colour, values, shown, errors, dash, points, marks, thin, spanGaps}] (shown: what is drawn, where
//        not all values; errors: half a bar; points: no line, small: small ones; marks: points on the line),
//        band: [upper, lower] (series numbers), marks: [x, ...] (dotted vertical lines),
//        level or levels: y (dotted horizontal lines)}
'use strict';

const livePlots = [];
const narrowest = 240;
const widthOf = (host) => Math.max(narrowest, host.clientWidth);
const widths = new ResizeObserver((changes) => {
  const hosts = new Set(changes.map((change) => change.target));
  livePlots.filter((state) => hosts.has(state.host)).forEach((state) => state.fit());
});

// Four rows of plots fit a sheet.
function plotHeight(spec) {
  const onPaper = document.documentElement.classList.contains('print');
  return Math.round((spec.height || 230) * (onPaper ? 0.86 : 1));
}

function drawMarks(spec, plot) {
  const {ctx, bbox} = plot;
  ctx.save();
  ctx.strokeStyle = cssColour('faint');
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
  ctx.beginPath();
  for (const x of spec.marks || []) {
    const across = plot.valToPos(x, 'x', true);
    ctx.moveTo(across, bbox.top);
    ctx.lineTo(across, bbox.top + bbox.height);
  }
  for (const level of levelsOf(spec)) {
    const down = plot.valToPos(level, 'y', true);
    ctx.moveTo(bbox.left, down);
    ctx.lineTo(bbox.left + bbox.width, down);
  }
  ctx.stroke();
  ctx.restore();
}

function levelsOf(spec) {
  return spec.levels ?? (spec.level === undefined ? [] : [spec.level]);
}

// [[x, low, high], ...] of the bars of a series.
function errorBars(spec, series) {
  return (series.errors ?? []).map((half, row) => [spec.x.values[row], series.values[row] - half, series.values[row] + half])
      .filter((bar, row) => Number.isFinite(series.errors[row]) && Number.isFinite(series.values[row]));
}

function drawErrors(spec, plot) {
  const {ctx, bbox} = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  for (const series of spec.series) {
    ctx.strokeStyle = cssColour(series.colour);
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([]);
    ctx.beginPath();
    for (const [x, low, high] of errorBars(spec, series)) {
      const across = plot.valToPos(x, 'x', true);
      ctx.moveTo(across, plot.valToPos(low, 'y', true));
      ctx.lineTo(across, plot.valToPos(high, 'y', true));
    }
    ctx.stroke();
  }
  ctx.restore();
}

// Room for every value, its bar and the levels; and for a single point at all.
function paddedRange(spec, which) {
  if (spec[which].log) {
    return undefined;
  }
  const values = which === 'x' ? spec.x.values
      : spec.series.flatMap((series) => [...(series.shown ?? series.values), ...errorBars(spec, series).flatMap((bar) => bar.slice(1))])
          .concat(levelsOf(spec));
  const finite = values.filter((value) => Number.isFinite(value));
  if (finite.length === 0) {
    return undefined;
  }
  const low = Math.min(...finite);
  const high = Math.max(...finite);
  const room = high > low ? 0.05 * (high - low) : Math.max(1e-9, 0.05 * Math.abs(high), which === 'x' ? 0.05 : 0);
  return [low - room, high + room];
}

function seriesOptions(series) {
  const colour = cssColour(series.colour);
  return {
    label: series.label,
    stroke: colour,
    width: series.points ? 0 : series.thin ? 0.8 : 1.6,
    dash: series.dash,
    spanGaps: Boolean(series.spanGaps),
    paths: series.points ? () => null : undefined,
    points: {show: Boolean(series.points || series.marks), size: series.small ? 2.5 : 6, fill: colour, stroke: colour},
  };
}

function plotOptions(spec, width, ticks, readout) {
  // With bars or single points uPlot's own range is too narrow. A zoom by dragging sets the scale past this.
  const bars = spec.series.some((series) => series.errors);
  const scale = (which) => {
    const axis = spec[which];
    const range = axis.range ?? (bars ? paddedRange(spec, which) : undefined);
    const kind = axis.log ? {distr: 3} : axis.asinh ? {distr: 4, asinh: axis.asinh} : {distr: 1};
    return {time: false, ...kind, ...(range ? {range: (plot, low, high) => zoomed(plot, low, high, range, which)} : {})};
  };
  return {
    width,
    height: plotHeight(spec),
    legend: {show: false},
    cursor: {drag: {x: true, y: false}},
    scales: {x: scale('x'), y: scale('y')},
    axes: [axisOptions(spec, 'x', ticks), axisOptions(spec, 'y', ticks)],
    series: [{label: spec.x.label}, ...spec.series.map(seriesOptions)],
    bands: spec.band ? [{series: spec.band, fill: cssColour('band')}] : [],
    hooks: {
      draw: [(plot) => drawMarks(spec, plot), (plot) => drawErrors(spec, plot)],
      setCursor: [(plot) => showReadout(spec, plot, readout)],
    },
  };
}

// uPlot asks for a range both for all data and for a stretch chosen by dragging.
function zoomed(plot, low, high, range, which) {
  const values = plot.data?.[0] ?? [];
  const whole = which === 'y' || values.length === 0 || (low <= values[0] && high >= values[values.length - 1]);
  return whole ? range : [low, high];
}

function showReadout(spec, plot, readout) {
  const row = plot.cursor.idx;
  if (row === null || row === undefined) {
    readout.textContent = '';
    return;
  }
  const parts = [`${spec.x.label} ${significant(spec.x.values[row])} ${unitSymbol(spec.x.unit || '')}`];
  for (const series of spec.series) {
    if (Number.isFinite(series.values[row])) {
      parts.push(`${series.label} ${significant(series.values[row], 5)} ${unitSymbol(spec.y.unit || '')}`);
    }
  }
  readout.textContent = parts.join(' · ');
}

function legend(spec) {
  const entries = spec.series.map((series) => {
    const colour = `var(--${series.colour})`;
    const mark = series.points ? svgElement('circle', {cx: 10, cy: 5, r: 3, fill: colour})
        : svgElement('line', {x1: 0, y1: 5, x2: 20, y2: 5, stroke: colour, 'stroke-width': 2,
                              'stroke-dasharray': (series.dash || []).join(' ')});
    return element('span', {}, svgElement('svg', {width: 20, height: 10, 'aria-hidden': 'true'}, mark), series.label);
  });
  return element('div', {class: 'legend'}, ...entries);
}

function numbersTable(spec) {
  const details = element('details', {}, element('summary', {}, 'Numbers'));
  details.addEventListener('toggle', () => {
    if (details.open && details.children.length === 1) {
      details.append(table(plotColumns(spec).map(
          (column) => ({title: column.title, cells: column.values.map((value) => significant(value, 6))}))));
    }
  });
  return details;
}

// Left and right move the cursor from point to point, Escape undoes a zoom.
function addKeys(host, state) {
  host.addEventListener('keydown', (event) => {
    state.drawOnce();
    const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    if (step !== undefined) {
      const count = state.plot.data[0].length;
      const row = Math.min(count - 1, Math.max(0, (state.plot.cursor.idx ?? -1) + step));
      state.plot.setCursor({left: state.plot.valToPos(state.plot.data[0][row], 'x'), top: 20});
      event.preventDefault();
    } else if (event.key === 'Escape') {
      state.plot.setData(state.plot.data, true);
    }
  });
}

// Whether there is anything to draw: times or the like that are numbers, and a value beside one of them.
function drawable(spec) {
  const drawn = (series) => listOf(series.shown ?? series.values);
  return spec.x.values.length > 0 && spec.x.values.every(Number.isFinite) &&
      spec.series.some((series) => drawn(series).some(Number.isFinite));
}

// The frame stands at once, with room for the picture; the first plot of a page is drawn at once, the others later.
function addPlot(parent, spec) {
  if (!drawable(spec)) {
    parent.append(element('p', {class: 'note'}, `${spec.title}: the document holds no numbers to draw.`));
    return;
  }
  const host = element('div', {class: 'plot', tabindex: '0', role: 'img', id: spec.id,
                               style: `min-height: ${plotHeight(spec)}px`,
                               'aria-label': `${spec.title}: ${axisTitle(spec.y)} against ${axisTitle(spec.x)}`});
  const readout = element('div', {class: 'readout'});
  const state = {spec, host, ticks: {x: [], y: []}, plot: null};
  const button = (label, action) => {
    const made = element('button', {type: 'button', title: `Save "${spec.title}" as ${label}`}, label);
    made.addEventListener('click', () => {
      state.drawOnce();
      action();
    });
    return made;
  };
  const tools = element('div', {class: 'tools'},
      button('CSV', () => saveBlob(spec.id + '.csv', 'text/csv', columnsCsv(plotColumns(spec)))),
      button('JSON', () => saveBlob(spec.id + '.json', 'application/json', JSON.stringify(plotColumns(spec)))),
      button('SVG', () => saveBlob(spec.id + '.svg', 'image/svg+xml', svgText(spec, state.plot, state.ticks))),
      button('PNG', async () => saveBlob(spec.id + '.png', 'image/png', await pngBlob(spec, state.plot))));
  parent.append(element('figure', {}, element('header', {}, element('h3', {}, spec.title), tools), legend(spec), host,
                        readout, numbersTable(spec)));
  state.draw = () => {
    if (state.plot) {
      state.plot.destroy();
    }
    host.style.minHeight = `${plotHeight(spec)}px`;
    const data = [spec.x.values, ...spec.series.map((series) => listOf(series.shown ?? series.values).map(numberOrNull))];
    state.plot = new uPlot(plotOptions(spec, widthOf(host), state.ticks, readout), data, host);
  };
  // The frame is as wide as its neighbours and the window leave it, whenever they change.
  state.fit = () => {
    if (state.plot && state.plot.width !== widthOf(host)) {
      state.plot.setSize({width: widthOf(host), height: plotHeight(spec)});
    }
  };
  // A plot that was taken away meanwhile is not drawn.
  state.drawOnce = () => {
    if (!state.plot && livePlots.includes(state)) {
      state.draw();
    }
  };
  addKeys(host, state);
  livePlots.push(state);
  widths.observe(host);
  if (livePlots.length === 1 && performance.getEntriesByName('first-plot').length === 0) {
    // Next, once the frames beside it stand.
    sooner(state.drawOnce, () => letPaint('first-plot'));
  } else {
    later(state.drawOnce);
  }
}

// Takes the plots of a place away again.
function dropPlots(place) {
  for (let k = livePlots.length - 1; k >= 0; --k) {
    if (place.contains(livePlots[k].host)) {
      widths.unobserve(livePlots[k].host);
      livePlots[k].plot?.destroy();
      livePlots.splice(k, 1);
    }
  }
  place.replaceChildren();
}

function redrawPlots() {
  knownColours.clear();
  for (const state of livePlots) {
    state.draw();
  }
}
