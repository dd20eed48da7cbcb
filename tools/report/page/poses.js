// A sensor that stands, or is turned by hand or by a table between static poses.
'use strict';

// "value ± sigma" with two digits of sigma, of raw units however small.
function figure(value, sigma) {
  const decimals = sigma > 0 ? Math.min(15, Math.max(0, 1 - Math.floor(Math.log10(sigma)))) : 6;
  return `${fixed(value, decimals)} ± ${fixed(sigma, decimals)}`;
}

const namedParts = (finding) => listOf(finding.parameters).map(objectOf).map((p) => `${textOf(p.name)} ${figure(p.value, p.sigma)}`).join(', ');

function showNamed(report) {
  const [gyros, accelerometers] = [objectOf(report.gyros), objectOf(report.accelerometers)];
  const lines = [...listOf(gyros.findings), ...listOf(accelerometers.findings)].map(objectOf).map((f) => {
    const rivals = [...listOf(f.equivalent).map(textOf), ...(f.may_be_flicker === true ? ['a bias that wanders by itself'] : [])];
    return `${textOf(f.effect)}: ${namedParts(f)}; log10 p ${fixed(f.log10_p, 1)}${rivals.length > 0 ? `; or as well ${rivals.join(', ')}` : ''}`;
  });
  const settling = objectOf(accelerometers.settling);
  if (settling.effect) {
    lines.push(`${textOf(settling.effect)}: settling after each turn with ${significant(settling.tau_s, 3)} s; log10 p ${fixed(settling.log10_p, 1)}`);
  }
  for (const jump of listOf(gyros.jumps).map(objectOf)) {
    lines.push(`Behind the gap at ${fixed(jump.time_s, 0)} s the gyros' bias is another by ` +
               listOf(jump.size).map((value, k) => figure(value, listOf(jump.sigma)[k])).join(', ') + ' (x, y, z, raw)');
  }
  for (const axis of listOf(objectOf(report.rest).axes).map(objectOf)) {
    for (const drift of listOf(axis.drifts).map(objectOf)) {
      const rivals = listOf(drift.as_well).map(objectOf).map((r) => textOf(r.effect));
      lines.push(`${textOf(axis.sensor)} ${textOf(axis.axis)}, ${textOf(drift.effect)}: ${figure(drift.value, drift.sigma)} ${textOf(drift.unit)}` +
                 (rivals.length > 0 ? `; or as well ${rivals.join(', ')}` : ''));
    }
  }
  document.getElementById('named-list').append(lines.length === 0 ? element('p', {}, 'Nothing.') :
      element('ul', {}, ...lines.map((words) => element('li', {}, words))));
}

function parameterTable(title, parameters, id) {
  const open = parameters.map((p) => p.determined !== true);
  return element('div', {}, element('h3', {}, title), table([
    {title: 'parameter', cells: parameters.map((p) => textOf(p.name)), class: 'left'},
    {title: 'value ± σ', cells: parameters.map((p, k) => (open[k] ? 'open' : figure(p.value, p.sigma)))},
    {title: 'unit', cells: parameters.map((p) => (p.unit === '1' ? '' : textOf(p.unit))), class: 'left'},
  ], {id}, open));
}

function showPoseParameters(report) {
  const place = document.getElementById('parameter-tables');
  const gyros = objectOf(report.gyros);
  const bias = listOf(gyros.bias).map((value, k) => ({name: `${gyros.earth_taken_out === true ? 'bias' : 'mean'}_${'xyz'[k]}`, unit: 'raw', value,
    sigma: listOf(gyros.bias_sigma)[k], determined: Number.isFinite(value)}));
  const held = report.by_poses === true || gyros.earth_taken_out === true || report.sensors === 'gyros';
  for (const [title, all, id] of [['Accelerometers', listOf(objectOf(report.accelerometers).parameters).map(objectOf), 'accelerometer-parameters'],
    ['Gyros', [...(held && report.sensors !== 'accelerometers' ? bias : []), ...listOf(gyros.parameters).map(objectOf)], 'gyro-parameters']]) {
    if (all.length > 0) {
      place.append(parameterTable(title, all, id));
    }
  }
  const axes = listOf(objectOf(report.rest).axes).map(objectOf);
  const of = (a, key) => objectOf(a[key]);
  if (axes.length > 0) {
    place.append(table([
      {title: 'sensor', cells: axes.map((a) => `${textOf(a.sensor)} ${textOf(a.axis)}`), class: 'left'},
      {title: 'mean ± σ', cells: axes.map((a) => `${figure(of(a, 'mean').value, of(a, 'mean').sigma)} ${textOf(of(a, 'mean').unit)}`)},
      {title: 'white noise', cells: axes.map((a) => `${significant(of(a, 'white_noise').value, 3)} ${textOf(of(a, 'white_noise').unit)}`)},
      {title: 'least Allan deviation', cells: axes.map((a) => `${of(a, 'bias_instability').bound === true ? '< ' : ''}${significant(of(a, 'bias_instability').value, 3)} ` +
          `${textOf(of(a, 'bias_instability').unit)} at ${significant(of(a, 'bias_instability').tau_s, 3)} s`)},
    ], {id: 'rest-axes'}));
  }
}

function showReadOuts(report) {
  const read = objectOf(report.read_outs);
  const axes = listOf(read.axes).map(objectOf);
  if (axes.length === 0) {
    return hideSection('read-outs');
  }
  const place = document.getElementById('read-out-tables');
  const response = (a, k) => figure(listOf(a.response)[k], listOf(a.response_sigma)[k]);
  place.append(table([
    {title: 'axis', cells: axes.map((a) => textOf(a.axis)), class: 'left'}, {title: 'by', cells: axes.map((a) => textOf(a.by)), class: 'left'},
    {title: 'rows', cells: axes.map((a) => textOf(a.rows))},
    ...[0, 1, 2].map((k) => ({title: `response of ${'xyz'[k]}`, cells: axes.map((a) => response(a, k))})),
    {title: 'nonlinearity', cells: axes.map((a) => (a.nonlinearity ? (a.nonlinearity.named === true ? 'named' : 'not seen') : '–'))},
  ], {id: 'read-out-axes'}));
  const clock = objectOf(read.clock);
  if (Number.isFinite(clock.delay_s)) {
    place.append(element('p', {}, `The read-outs are ${clock.delay_s < 0 ? 'early' : 'late'} by ${figure(Math.abs(clock.delay_s), clock.delay_sigma_s)} s.`));
  }
}

function showAttitude(report) {
  const a = objectOf(report.attitude);
  if (!a.reading && !a.failure) {
    return hideSection('attitude');
  }
  const place = document.getElementById('attitude-words');
  const say = (words) => place.append(element('p', {}, words));
  if (a.failure) {
    say(`It is no reference: ${textOf(a.failure)}.`);
  }
  if (a.reading) {
    say(`${textOf(a.reading)}: ${textOf(a.samples)} values over ${fixed(a.seconds, 0)} s, noise ${significant(1e3 * a.noise_rad, 3)} mrad an axis.`);
  }
  const clock = objectOf(a.clock);
  if (clock.seen === true) {
    say(`It is ${clock.delay_s < 0 ? 'early' : 'late'} by ${figure(1e3 * Math.abs(clock.delay_s), 1e3 * clock.delay_sigma_s)} ms, and its clock ` +
        `${clock.drift_ppm < 0 ? 'slow' : 'fast'} by ${figure(Math.abs(clock.drift_ppm), clock.drift_sigma_ppm)} ppm.`);
  }
  const bias = listOf(a.gyro_bias).map((value, k) => ({name: `bias_${'xyz'[k]}`, unit: 'raw', value, sigma: listOf(a.gyro_bias_sigma)[k], determined: true}));
  for (const [title, all, id] of [['Gyros', [...bias, ...listOf(a.gyros).map(objectOf)], 'attitude-gyros'],
    ['Accelerometers', listOf(objectOf(a.gravity).accelerometers).map(objectOf), 'attitude-accelerometers']]) {
    if (all.length > 0) {
      document.getElementById('attitude-tables').append(parameterTable(title, all, id));
    }
  }
}

function showPoseNoise(report) {
  const place = document.getElementById('noise-plots');
  for (const [title, points, id] of [['gyros', listOf(objectOf(report.gyros).noise_at_rest), 'rest-gyros'],
    ['accelerometers', listOf(objectOf(report.accelerometers).noise_at_rest), 'rest-accelerometers']]) {
    const all = points.map(objectOf);
    if (all.length < 2) {
      continue;
    }
    addPlot(place, {
      id, title: `Allan deviation of the ${title}`, height: 260,
      x: {label: 'averaging time', unit: 's', log: true, values: all.map((p) => p.tau_s)},
      y: {label: 'Allan deviation', unit: 'raw', log: true},
      series: axisColours.map((axis, k) => ({label: axis, colour: axis, dash: axisDashes[k], points: true, small: true,
        values: all.map((p) => (listOf(p.deviation)[k] > 0 ? p.deviation[k] : null))})),
    });
  }
  if (!place.firstChild) {
    hideSection('noise');
  }
}

function showTried(report) {
  const place = document.getElementById('tried-tables');
  for (const [title, tried] of [['Gyros', listOf(objectOf(report.gyros).tried)], ['Accelerometers', listOf(objectOf(report.accelerometers).tried)]]) {
    const all = tried.map(objectOf);
    if (all.length > 0) {
      place.append(element('div', {}, element('h3', {}, title), table([
        {title: 'effect', cells: all.map((e) => textOf(e.effect)), class: 'left'},
        {title: 'log10 p', cells: all.map((e) => fixed(e.log10_p, 1))},
      ])));
    }
  }
  if (!place.firstChild) {
    hideSection('tried');
  }
}

function showPoses(report) {
  document.title = `${textOf(objectOf(report.input).name) || 'A log'} by its poses`;
  const left = listOf(report.left_out).map(objectOf);
  const clipped = listOf(report.clipped).map(objectOf);
  later(() => showVerdict(report), () => showOrigin(report), () => fillFacts([
    ['Poses', textOf(report.poses)], ['At rest', `${fixed(report.static_s, 0)} of ${fixed(report.duration_s, 0)} s`],
    ...(left.length > 0 ? [['Left out', `${left.length} parts: ${textOf(left[0].words)}`]] : []),
    ...(clipped.length > 0 ? [['Clipped', clipped.map((c) => `${textOf(c.sensor)} ${textOf(c.axis)}`).join(', ')]] : []),
  ]), () => showNamed(report), () => showPoseParameters(report), () => showReadOuts(report), () => showAttitude(report), () => showPoseNoise(report), () => showTried(report),
        () => document.getElementById('unseen-list').append(...listOf(report.invisible).map((words) => element('li', {}, textOf(words)))));
}
