// The page in a real browser: node test.mjs REPORT.html ESTIMATE.json CHROMIUM [SCREENSHOT-FOLDER]
// ESTIMATE.json is what `selfcal estimate --json` said of the same recording. One line for each failure; status 1.
import {readFileSync, statSync, writeFileSync} from 'node:fs';
import {pathToFileURL} from 'node:url';
import {chromium} from 'playwright-core';

const [page_file, json_file, browser_file, pictures] = process.argv.slice(2);
const estimate = JSON.parse(readFileSync(json_file, 'utf8'));
const failures = [];
const expect = (good, words) => good || failures.push(words);

const largest_page = 3e6;
const slowest_plot_ms = 1000;

// Share of a canvas's pixels that are not fully transparent and not the colour of its first pixel.
const drawn_share = (canvas) => {
  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let drawn = 0;
  for (let k = 0; k < data.length; k += 4) {
    drawn += data[k + 3] > 0 && (data[k] !== data[0] || data[k + 1] !== data[1] || data[k + 2] !== data[2]) ? 1 : 0;
  }
  return drawn / (data.length / 4);
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

async function check_plots(page, where) {
  const canvases = await page.$$('.plot canvas');
  expect(canvases.length === 24 + 4, `${where}: ${canvases.length} plots, 28 expected`);
  for (const canvas of canvases) {
    const share = await canvas.evaluate(drawn_share);
    const name = await canvas.evaluate((element) => element.closest('.plot').id);
    expect(share > 0.005, `${where}: plot ${name} is empty (${share})`);
  }
  const labels = await page.$$eval('.plot', (plots) => plots.map((plot) => plot.getAttribute('aria-label')));
  for (const label of labels) {
    expect(/: .+\(.+\) against .+\(.+\)$/.test(label), `${where}: an axis without unit: ${label}`);
  }
  for (const fault of await page.evaluate(layout_faults)) {
    failures.push(`${where}: ${fault}`);
  }
}

async function check_values(page) {
  const document_in_page = JSON.parse(await page.$eval('#document', (element) => element.textContent));
  const rows = await page.$$eval('#values tbody tr', (lines) => lines.map(
      (line) => [...line.cells].map((cell) => cell.textContent.trim())));
  expect(rows.length === 24, `${rows.length} rows in the table`);
  estimate.parameters.forEach((parameter, k) => {
    const held = document_in_page.parameters[k];
    for (const key of ['name', 'unit', 'value', 'sigma', 'determined', 'tolerance']) {
      expect(held[key] === parameter[key], `${parameter.name}: ${key} ${held[key]} in the page, ${parameter[key]} in the JSON`);
    }
    const [name, value, sigma, , , , state] = rows[k] ?? [];
    // Shown to two digits of sigma: within half of the last one.
    const last = 10 ** -(value?.split('.')[1]?.length ?? 0);
    expect(name === parameter.name, `row ${k}: ${name}`);
    expect(Math.abs(value - parameter.value) <= 0.501 * last, `${name}: shows ${value} for ${parameter.value}`);
    expect(Math.abs(sigma - parameter.sigma) <= 0.501 * last, `${name}: shows sigma ${sigma} for ${parameter.sigma}`);
    expect(/not determined/.test(state) === !parameter.determined, `${name}: shows ${state}`);
  });
  const verdict = await page.textContent('#verdict');
  expect(verdict.includes(estimate.acceptable ? 'Accepted' : 'Not accepted'), `verdict: ${verdict}`);
}

async function check_saving(page) {
  for (const [kind, begin] of [['CSV', 'time'], ['JSON', '['], ['SVG', '<svg'], ['PNG', '']]) {
    const [download] = await Promise.all([
      page.waitForEvent('download'), page.click(`figure:has(#nis) button:text-is("${kind}")`)]);
    const content = readFileSync(await download.path(), kind === 'PNG' ? 'latin1' : 'utf8');
    const good = kind === 'PNG' ? content.slice(1, 4) === 'PNG' : content.startsWith(begin);
    expect(good && content.length > 300, `saving ${kind}: ${content.length} bytes, begins ${JSON.stringify(content.slice(0, 20))}`);
  }
}

async function check_keyboard(page) {
  await page.focus('#gimbal');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowRight');
  const readout = await page.$eval('figure:has(#gimbal) .readout', (element) => element.textContent);
  expect(/time .*min.*outer.*°/.test(readout), `arrow keys read out: "${readout}"`);
}

const browser = await chromium.launch({executablePath: browser_file, args: ['--no-sandbox']});
try {
  expect(statSync(page_file).size < largest_page, `${statSync(page_file).size} bytes`);
  for (const [width, scheme] of [[1400, 'light'], [800, 'dark']]) {
    const where = `${width} px ${scheme}`;
    const context = await browser.newContext({viewport: {width, height: 1000}, colorScheme: scheme, offline: true});
    const page = await context.newPage();
    page.on('console', (message) => failures.push(`${where}: console: ${message.text()}`));
    page.on('pageerror', (error) => failures.push(`${where}: ${error.message}`));
    page.on('request', (request) => expect(/^(file|data|blob):/.test(request.url()), `${where}: asks for ${request.url()}`));
    await page.goto(pathToFileURL(page_file).href);
    const first_plot = await page.evaluate(() => performance.getEntriesByName('first-plot')[0]?.startTime);
    expect(first_plot < slowest_plot_ms, `${where}: first plot after ${first_plot} ms`);
    console.log(`${where}: first plot after ${Math.round(first_plot)} ms`);
    await check_plots(page, where);
    if (width === 1400) {
      await check_values(page);
      await check_keyboard(page);
      await check_saving(page);
      const pdf = await page.pdf({format: 'A4', preferCSSPageSize: true});
      const pages = pdf.toString('latin1').match(/\/Type \/Page\b(?!s)/g)?.length ?? 0;
      expect(pages >= 3 && pages <= 12, `${pages} A4 pages`);
      if (pictures) {
        writeFileSync(`${pictures}/report-a4.pdf`, pdf);
      }
    }
    if (pictures) {
      await page.screenshot({path: `${pictures}/report-${width}.png`, fullPage: true});
    }
    await context.close();
  }
} finally {
  await browser.close();
}
failures.forEach((words) => console.error(words));
process.exitCode = failures.length > 0 ? 1 : 0;
