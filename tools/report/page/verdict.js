// The banner: the document's own summary, the same that `estimate`, `show` and `diagnose` print; and the facts below it.
'use strict';

const standingMarks = {good: '✔', bad: '✘', open: '○'};

// A command stands as one; anything else is a sentence.
function nextOf(text) {
  return /^selfcal /.test(text) ? element('code', {}, text) : text;
}

function showBanner(summary) {
  const place = document.getElementById('verdict');
  const standing = standingMarks[summary.standing] ? summary.standing : 'open';
  place.className = standing;
  place.append(element('p', {class: 'lead'}, `${standingMarks[standing]} ${textOf(summary.verdict) || 'The document states no verdict.'}`));
  for (const [name, content] of [['Cause', textOf(summary.cause)], ['Next', nextOf(textOf(summary.next))]]) {
    if (content) {
      place.append(element('p', {}, element('span', {class: 'faint'}, name + ': '), content));
    }
  }
}

function showVerdict(report) {
  showBanner(objectOf(report.summary));
}

function fillFacts(facts) {
  const list = document.getElementById('facts');
  for (const [name, value] of facts) {
    list.append(element('div', {}, element('dt', {}, name), element('dd', {}, value)));
  }
}

// Which program said it, when, and of which file: on every kind of page.
function showOrigin(report) {
  const input = objectOf(report.input);
  const run = objectOf(report.run);
  const facts = report.serial || !run.serial ? [] : [['Serial number', textOf(run.serial)]];
  facts.push(['Program', programOf(report)]);
  if (report.made_utc) {
    facts.push(['Page made', textOf(report.made_utc)]);
  }
  if (input.name) {
    facts.push(['Recording', textOf(input.name)]);
  }
  fillFacts(facts);
  if (input.sha256) {
    document.getElementById('facts').append(element('div', {class: 'wide'}, element('dt', {}, 'SHA-256 of the recording'),
                                                    element('dd', {id: 'hash'}, textOf(input.sha256))));
  }
}

function showFacts(report) {
  const attitude = objectOf(report.initial_attitude_deg);
  const site = objectOf(report.site);
  fillFacts([
    ['Serial number', textOf(report.serial) || '–'],
    ['Recorded', textOf(report.start_time_utc) || '–'],
    ['Duration', `${significant(report.duration_s / 60, 4)} min, ${textOf(report.samples) || '–'} samples at ${significant(report.sample_rate_hz, 4)} Hz`],
    ['Site', `${significant(site.latitude_deg, 6)}°, ${significant(site.longitude_deg, 6)}°, ${significant(site.height_m, 3)} m`],
    ['Attitude at the start', `roll ${fixed(attitude.roll, 3)}°, pitch ${fixed(attitude.pitch, 3)}°, heading ${fixed(attitude.heading, 3)}°`],
    ['Base', textOf(objectOf(report.noise).base) || '–'],
    ['Computed in', `${significant(report.elapsed_s, 3)} s, ${listOf(report.passes).length} passes`],
  ]);
}
