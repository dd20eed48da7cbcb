// Building the page: elements and numbers.
'use strict';

// element('td', {class: 'bad'}, 'text', child, ...)
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

const svgNamespace = 'http://www.w3.org/2000/svg';

function svgElement(tag, attributes = {}, ...children) {
  const made = document.createElementNS(svgNamespace, tag);
  for (const [name, value] of Object.entries(attributes)) {
    made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

// Units as people read them; the JSON keeps its plain ones.
const unitSymbols = {'ug': 'µg', 'deg/h': '°/h', 'arcsec': '″', 'deg': '°'};

function unitSymbol(unit) {
  return unitSymbols[unit] || unit;
}

// The shortest text with `digits` significant digits.
function significant(value, digits = 4) {
  if (!Number.isFinite(value)) {
    return '–';
  }
  if (value === 0) {
    return '0';
  }
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e7) {
    return value.toExponential(digits - 1);
  }
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return value.toFixed(Math.min(decimals, 12));
}

// As toFixed, without a minus before zero; a dash for what is no number.
function fixed(value, decimals) {
  return Number.isFinite(value) ? value.toFixed(decimals).replace(/^-(0(?:\.0*)?)$/, '$1') : '–';
}

// A document may lack what it should have: lists then are empty, texts are.
const listOf = (value) => (Array.isArray(value) ? value : []);
const numberOrNull = (value) => (Number.isFinite(value) ? value : null);
const textOf = (value) => (typeof value === 'string' ? value : typeof value === 'number' ? String(value) : '');
const objectOf = (value) => (value && typeof value === 'object' && !Array.isArray(value) ? value : {});

// Decimals that show two significant digits of sigma: value and sigma are then cut at the same place.
function decimalsFor(sigma) {
  if (!(sigma > 0) || !Number.isFinite(sigma)) {
    return 6;
  }
  return Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(sigma))));
}

// "value ± sigma", both cut where sigma has two significant digits; a sigma too small for that, or none, cuts nothing.
function withSigma(value, sigma) {
  if (!(sigma >= 1e-5) || !Number.isFinite(sigma)) {
    return `${significant(value, 5)} ± ${significant(sigma, 2)}`;
  }
  const decimals = decimalsFor(sigma);
  return `${fixed(value, decimals)} ± ${sigma.toFixed(decimals)}`;
}

// Kept until the colour scheme changes: asking the style sheet makes the browser compute the styles of the whole page.
const knownColours = new Map();

function cssColour(name) {
  if (!knownColours.has(name)) {
    knownColours.set(name, getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim());
  }
  return knownColours.get(name);
}

// columns: [{title, cells, class}], cells being texts or elements; faint: for each row whether it is grey.
function table(columns, attributes = {}, faint = []) {
  const head = element('tr');
  for (const column of columns) {
    head.append(element('th', {scope: 'col', class: column.class || ''}, column.title));
  }
  const body = element('tbody');
  const rows = Math.max(0, ...columns.map((column) => column.cells.length));
  for (let row = 0; row < rows; ++row) {
    const line = element('tr');
    for (const column of columns) {
      line.append(element('td', {class: column.class || ''}, column.cells[row] ?? ''));
    }
    if (faint[row]) {
      line.className = 'faint';
    }
    body.append(line);
  }
  return element('div', {class: 'scroll'}, element('table', attributes, element('thead', {}, head), body));
}
