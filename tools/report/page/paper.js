// What stands at the foot of every printed sheet: program and version, the recording's hash, the date, the number of the sheet.
'use strict';

// A text inside a style sheet.
function cssString(text) {
  return '"' + text.replace(/["\\]/g, '\\$&').replace(/[\u0000-\u001f<]/g, (sign) => `\\${sign.charCodeAt(0).toString(16)} `) + '"';
}

function programOf(report) {
  const program = report.program;
  const version = typeof program === 'string' ? program : textOf(objectOf(program).version);
  return `selfcal ${version}`.trim();
}

const minuteOf = (date) => date.toISOString().slice(0, 16).replace('T', ' ') + ' UTC';

// The short form of a hash, as git and people use it.
const shortHash = (report) => textOf(objectOf(report.input).sha256).slice(0, 12);

// Anew before each printing: the date is that of the sheet.
function setPaperMargins(report) {
  const hash = shortHash(report);
  const left = programOf(report) + (hash ? ` · recording SHA-256 ${hash}…` : '');
  let sheet = document.getElementById('paper-margins');
  if (!sheet) {
    sheet = element('style', {id: 'paper-margins'});
    document.head.append(sheet);
  }
  const words = 'font: 8px system-ui, "DejaVu Sans", sans-serif; color: #59636e; vertical-align: top; padding-top: 2mm;';
  sheet.textContent = `@page {
  @bottom-left { content: ${cssString(left)}; ${words} width: 55%; text-align: left; }
  @bottom-center { content: ${cssString('printed ' + minuteOf(new Date()))}; ${words} width: 25%; text-align: center; }
  @bottom-right { content: "page " counter(page) " of " counter(pages); ${words} width: 20%; text-align: right; }
}`;
}
