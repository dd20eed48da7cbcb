// The pages in a real browser, one for all of them: node test.mjs CHROMIUM [KIND PAGE.html EXPECTED.json]...
// KIND calibration: EXPECTED is what `selfcal estimate --json` said of the same recording; run: the saved run;
// failed: a saved run without a result, whose recording is gone; plan: `selfcal plan --json`; fleet: an array of the saved
// histories. With "not-" before it the page must fail, as it holds other numbers. One line for each failure; status 1.
// SELFCAL_PICTURES: a folder for screenshots at 1400 and 800 px and the PDF of each page.
// SELFCAL_FIRST_PLOT_MS: fail where the first plot takes longer (a bench: it depends on the machine).
import {readFileSync, statSync, writeFileSync} from 'node:fs';
import {pathToFileURL} from 'node:url';
import {chromium} from 'playwright-core';

const [browser_file, ...jobs] = process.argv.slice(2);
const pictures = process.env.SELFCAL_PICTURES;
let kind = '';
let expected = {};
let failures = [];
const expect = (good, words) => good || failures.push(words);

const largest_page = 3e6;
const slowest_plot_ms = Number(process.env.SELFCAL_FIRST_PLOT_MS || Infinity);

// [name, share of its pixels that are drawn: not transparent and not the colour of the first] of every plot, and of every
// SVG as the browser paints it.
const drawn_shares = async () => {
  const share = (canvas) => {
    const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let drawn = 0;
    for (let k = 0; k < data.length; k += 4) {
      drawn += data[k + 3] > 0 && (data[k] !== data[0] || data[k + 1] !== data[1] || data[k + 2] !== data[2]) ? 1 : 0;
    }
    return drawn / (data.length / 4);
  };
  const found = [...document.querySelectorAll('.plot')].map((plot) => [plot.id, plot.querySelector('canvas') ? share(plot.querySelector('canvas')) : 0]);
  for (const svg of document.querySelectorAll('svg.picture')) {
    const picture = await createImageBitmap(await svgToPng(svg));
    const canvas = document.createElement('canvas');
    canvas.width = picture.width;
    canvas.height = picture.height;
    canvas.getContext('2d').drawImage(picture, 0, 0);
    found.push([svg.id, share(canvas)]);
  }
  return found;
};

// Elements that stick out of the page or of the figure they belong to, and figures that lie over each other.
const layout_faults = () => {
  const faults = [];
  if (document.documentElement.scrollWidth > innerWidth) {
    faults.push(`page is ${document.documentElement.scrollWidth} px wide in ${innerWidth}`);
  }
  const boxes = [...document.querySelectorAll('figure')].map((figure) => ({figure, box: figure.getBoundingClientRect()}));
  boxes.forEach(({figure, box}, k) => {
    for (const inner of figure.querySelectorAll('canvas, h3, button, .legend span')) {
      const part = inner.getBoundingClientRect();
      if (part.right > box.right + 1 || part.left < box.left - 1) {
        faults.push(`${inner.tagName} sticks out of figure ${k}`);
      }
    }
    for (const other of boxes.slice(k + 1)) {
      const b = other.box;
      if (box.left < b.right - 1 && b.left < box.right - 1 && box.top < b.bottom - 1 && b.top < box.bottom - 1) {
        faults.push(`figure ${k} lies over another`);
      }
    }
  });
  return faults;
};

// Pictures that each kind of page must have, whatever else it has.
const wanted = {
  calibration: ['convergence-accel_bias_x', 'nis', 'innovations', 'gimbal', 'allan-gyro', 'allan-accel',
                'correlation-matrix', 'misfit-before'],
  run: ['convergence-accel_bias_x', 'navigation-drift', 'history-accel_bias_x', 'misfit-before'],
  failed: [],
  plan: ['timeline-0', 'timeline-1', 'sphere-0', 'sphere-1', 'forecast-accel_bias_x', 'forecast-gyro_misalignment_zy'],
  fleet: ['trend-accel_bias_x', 'trend-gyro_misalignment_zy'],
};

async function check_plots(page, where) {
  for (const id of wanted[kind]) {
    expect(await page.$('#' + id), `${where}: no picture ${id}`);
  }
  for (const [name, share] of await page.evaluate(drawn_shares)) {
    expect(share > 0.005, `${where}: picture ${name} is empty (${share})`);
  }
  const labels = await page.$$eval('.plot', (plots) => plots.map((plot) => plot.getAttribute('aria-label')));
  for (const label of labels) {
    expect(/: .+\(.+\) against .+\(.+\)$/.test(label), `${where}: an axis without unit: ${label}`);
  }
  for (const fault of await page.evaluate(layout_faults)) {
    failures.push(`${where}: ${fault}`);
  }
}

const rows_of = (page, id) => page.$$eval(`#${id} tbody tr`, (lines) => lines.map(
    (line) => [...line.cells].map((cell) => cell.textContent.trim())));

// A number as shown: within half of its last digit.
function shows(text, value) {
  const last = 10 ** -(text?.replace(/e.*/, '').split('.')[1]?.length ?? 0) * 10 ** Number(/e(.*)/.exec(text ?? '')?.[1] ?? 0);
  return Math.abs(Number(text) - value) <= 0.501 * last;
}

async function check_parameters(page, parameters) {
  const document_in_page = JSON.parse(await page.$eval('#document', (element) => element.textContent));
  const rows = await rows_of(page, 'values');
  expect(rows.length === 24, `${rows.length} rows in the table`);
  parameters.forEach((parameter, k) => {
    const held = document_in_page.parameters[k];
    for (const key of ['name', 'unit', 'value', 'sigma', 'determined', 'tolerance']) {
      expect(held[key] === parameter[key], `${parameter.name}: ${key} ${held[key]} in the page, ${parameter[key]} in the JSON`);
    }
    const [name, value, sigma] = rows[k] ?? [];
    const state = rows[k]?.at(-1);
    expect(name === parameter.name, `row ${k}: ${name}`);
    expect(shows(value, parameter.value), `${name}: shows ${value} for ${parameter.value}`);
    expect(shows(sigma, parameter.sigma), `${name}: shows sigma ${sigma} for ${parameter.sigma}`);
    expect(/not determined/.test(state) === !parameter.determined, `${name}: shows ${state}`);
  });
}

async function check_estimate(page) {
  await check_parameters(page, expected.parameters);
  const verdict = await page.textContent('#verdict');
  expect(verdict.includes(expected.acceptable ? 'Accepted' : 'Not accepted'), `verdict: ${verdict}`);
  expect((await rows_of(page, 'adequacy')).length === 2, 'no table of before and after');
}

async function check_run(page) {
  await check_parameters(page, expected.result.parameters);
  const rows = await rows_of(page, 'coefficients');
  expect(rows.length === 24, `${rows.length} rows of coefficients`);
  rows.forEach(([name, , previous, pushed, read_back], k) => {
    const sets = expected.coefficients;
    for (const [text, set] of [[previous, sets.previous], [pushed, sets.pushed], [read_back, sets.read_back]]) {
      expect(shows(text, set.parameters[k].value), `${name}: shows ${text} for ${set.parameters[k].value}`);
    }
  });
  const changes = (await rows_of(page, 'values')).map((cells) => cells[6]);
  expect(changes.every((text) => /^[+−][\d.]+ \([\d.e+-]+ σ\)$/.test(text)), `change since the last calibration: ${changes[0]}`);
  const drift = /drift ([\d.]+) m before, ([\d.]+) m after/.exec(await page.textContent('#run-words')) ?? [];
  expect(shows(drift[1], expected.drift_before_m) && shows(drift[2], expected.drift_after_m), `drift: ${drift}`);
}

async function check_failed(page) {
  const text = await page.textContent('main');
  expect((await page.textContent('#verdict')).includes(expected.reason), 'the reason is not told');
  expect(text.includes('Warning: no curves') && text.includes(expected.recording), 'the missing recording is not told');
  expect(await page.$('#navigation-drift') === null, 'a drift is shown that was not measured');
}

async function check_plan(page) {
  const rows = await rows_of(page, 'values');
  expected.parameters.forEach((parameter, k) => {
    const [name, , tolerance, sigma, , met] = rows[k] ?? [];
    expect(name === parameter.name && shows(sigma, parameter.sigma), `${name}: shows ${sigma} for ${parameter.sigma}`);
    expect(shows(tolerance, parameter.tolerance), `${name}: shows ${tolerance} for ${parameter.tolerance}`);
    expect(met.includes(parameter.determined ? 'yes' : 'no'), `${name}: shows ${met}`);
  });
  // Turning the sphere by keyboard changes what is seen.
  const before = await page.$eval('#sphere-0', (svg) => svg.innerHTML);
  await page.focus('#sphere-0');
  await page.keyboard.press('ArrowRight');
  expect(before !== await page.$eval('#sphere-0', (svg) => svg.innerHTML), 'arrow keys do not turn the sphere');
}

async function check_fleet(page) {
  const rows = await rows_of(page, 'values');
  expect(rows.length === expected.length, `${rows.length} units`);
  for (const history of expected) {
    const row = rows.find((cells) => cells[0] === history.serial) ?? [];
    const last = history.runs.map((run) => run.started_utc).sort().at(-1);
    expect(row[1] === last.slice(0, 10), `${history.serial}: last calibrated ${row[1]}, not ${last}`);
    const due = new Date(Date.parse(last) + 365 * 86400e3).toISOString().slice(0, 10);
    expect(row[2] === due, `${history.serial}: due ${row[2]}, not ${due}`);
  }
  // The units' parameters were made to drift, or not (report_page_test).
  const drifts = await rows_of(page, 'drifts');
  const drifting = drifts.map((cells) => cells[0] + ' ' + cells[1]);
  expect(drifting.includes('SN-0002 accel_bias_z'), `accel_bias_z of SN-0002 does not drift: ${drifting}`);
  expect(!drifting.some((text) => text.startsWith('SN-0001')), `SN-0001 drifts: ${drifting}`);
  // 9 sigma a year, and 18 sigma from the last value to the limit: two years, found to a week. Calendar years differ from
  // the mean one by 0.3 %.
  const [, , , slope, , , , passes] = drifts.find((cells) => cells[0] === 'SN-0002') ?? [];
  const values = expected.find((history) => history.serial === 'SN-0002').parameters
      .find((parameter) => parameter.name === 'accel_bias_z').values;
  expect(Math.abs(slope / (9 * values[0].sigma) - 1) < 0.01, `slope ${slope} a year for 9 sigma of ${values[0].sigma}`);
  expect(Math.abs(Date.parse(passes) - Date.parse('2027-03-01')) < 11 * 86400e3, `passes its limit on ${passes}`);
  await page.selectOption('#unit-choice', 'SN-0002');
  expect(await page.$('#trend-accel_bias_x'), 'the choice of a unit leaves no plots');
}

async function check_saving(page, id) {
  for (const [type, begin] of [['CSV', ''], ['JSON', '['], ['SVG', '<svg'], ['PNG', '']]) {
    const [download] = await Promise.all([
      page.waitForEvent('download'), page.click(`figure:has(#${id}) button:text-is("${type}")`)]);
    const content = readFileSync(await download.path(), type === 'PNG' ? 'latin1' : 'utf8');
    const good = type === 'PNG' ? content.slice(1, 4) === 'PNG' : content.startsWith(begin);
    expect(good && content.length > 300, `saving ${type} of ${id}: ${content.length} bytes, begins ${JSON.stringify(content.slice(0, 20))}`);
  }
}

async function check_keyboard(page) {
  await page.focus('#gimbal');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowRight');
  const readout = await page.$eval('figure:has(#gimbal) .readout', (element) => element.textContent);
  expect(/time .*min.*outer.*°/.test(readout), `arrow keys read out: "${readout}"`);
}

// Printed before the page has finished itself: nothing may be missing on paper. A picture more or less is kilobytes.
async function check_paper(page, where) {
  const pdf = await page.pdf({format: 'A4', preferCSSPageSize: true});
  const count = pdf.toString('latin1').match(/\/Type \/Page\b(?!s)/g)?.length ?? 0;
  expect(count >= 1 && count <= 20, `${where}: ${count} A4 pages`);
  const again = (await page.pdf({format: 'A4', preferCSSPageSize: true})).toString('latin1').match(/\/Type \/Page\b(?!s)/g)?.length;
  expect(count === again, `${where}: ${count} A4 pages of a page that has just been opened, ${again} later`);
  expect(await page.evaluate(() => document.documentElement.dataset.ready) === 'true', `${where}: printed half`);
  for (const [name, share] of await page.evaluate(drawn_shares)) {
    expect(share > 0.005, `${where}: picture ${name} is empty on paper (${share})`);
  }
  if (pictures) {
    writeFileSync(`${pictures}/${kind}-a4.pdf`, pdf);
  }
  // The width between the margins of A4, 186 mm: there is no scrolling on paper.
  await page.emulateMedia({media: 'print'});
  await page.setViewportSize({width: 703, height: 1032});
  const cut = await page.evaluate(() => [...document.querySelectorAll('main *')].filter(
      (part) => part.checkVisibility() && part.getBoundingClientRect().right > innerWidth + 0.5).map((part) => `${part.tagName} ${part.textContent.slice(0, 30)}`));
  expect(cut.length === 0, `${where}: beyond the edge of the paper: ${cut.slice(0, 3).join('; ')}`);
}

// Nothing beside the window, and no table that has to be scrolled for its last columns; those of a plot's numbers may.
async function check_width(page, where) {
  const cut = await page.evaluate(() => [...document.querySelectorAll('main *')].filter((part) => !part.closest('details') &&
      part.checkVisibility() && part.getBoundingClientRect().right > innerWidth + 0.5).map(
      (part) => `${part.tagName} ${part.textContent.slice(0, 30)}`));
  expect(cut.length === 0, `${where}: beside the window: ${cut.slice(0, 3).join('; ')}`);
}

async function open(browser, page_file, where, width, scheme) {
  const context = await browser.newContext({viewport: {width, height: 1000}, colorScheme: scheme, offline: true});
  const page = await context.newPage();
  page.on('console', (message) => failures.push(`${where}: console: ${message.text()}`));
  page.on('pageerror', (error) => failures.push(`${where}: ${error.message}`));
  page.on('request', (request) => expect(/^(file|data|blob):/.test(request.url()), `${where}: asks for ${request.url()}`));
  await page.goto(pathToFileURL(page_file).href, {waitUntil: 'domcontentloaded'});
  return page;
}

async function check_page(browser, page_file) {
  expect(statSync(page_file).size < largest_page, `${statSync(page_file).size} bytes`);
  for (const [width, scheme] of [[1400, 'light'], [800, 'dark']]) {
    const where = `${kind}, ${width} px ${scheme}`;
    const page = await open(browser, page_file, where, width, scheme);
    await page.waitForSelector('html[data-ready]', {state: 'attached'});
    if (wanted[kind].length > 0) {
      await page.waitForFunction(() => performance.getEntriesByName('first-plot').length > 0);
      const first_plot = await page.evaluate(() => performance.getEntriesByName('first-plot')[0].startTime);
      expect(first_plot < slowest_plot_ms, `${where}: first plot after ${first_plot} ms`);
      console.log(`${where}: first plot painted after ${Math.round(first_plot)} ms`);
    }
    await check_plots(page, where);
    await check_width(page, where);
    if (width === 1400) {
      await {calibration: check_estimate, run: check_run, failed: check_failed, plan: check_plan, fleet: check_fleet}[kind](page);
      if (kind === 'calibration') {
        await check_keyboard(page);
        await check_saving(page, 'nis');
        await check_saving(page, 'misfit-before');
      }
    }
    if (pictures) {
      await page.screenshot({path: `${pictures}/${kind}-${width}.png`, fullPage: true});
    }
    await page.context().close();
  }
  const page = await open(browser, page_file, `${kind}, paper`, 1400, 'light');
  await check_paper(page, `${kind}, paper`);
  await page.context().close();
}

// The test itself must be able to fail.
async function check_other_numbers(browser, page_file) {
  const page = await open(browser, page_file, kind, 1400, 'light');
  await page.waitForSelector('html[data-ready]', {state: 'attached'});
  await check_estimate(page);
  await page.context().close();
  const found = failures.length;
  failures = found > 0 ? [] : ["the page passes with another calibration's numbers"];
}

const browser = await chromium.launch({executablePath: browser_file, args: ['--no-sandbox']});
let failed = 0;
try {
  while (jobs.length > 0) {
    const [name, page_file, json_file] = jobs.splice(0, 3);
    kind = name.replace(/^not-/, '');
    expected = JSON.parse(readFileSync(json_file, 'utf8'));
    failures = [];
    await (name === kind ? check_page : check_other_numbers)(browser, page_file);
    failures.forEach((words) => console.error(words));
    failed += failures.length;
  }
} finally {
  await browser.close();
}
process.exitCode = failed > 0 ? 1 : 0;
