// The story of an investigation (`selfcal investigate --json`): what was known before each rotation, why it was made, what it showed.
'use strict';

const sameLaw = (a, b) => a.axis === b.axis && a.expression === b.expression;
const classOf = (law) => (listOf(law.class).length > 0 ? law.class : [{expression: law.expression, axis: law.axis, odds: 1}]).map(objectOf);
const runsText = (runs) => `run${listOf(runs).length > 1 ? 's' : ''} ${listOf(runs).map(textOf).join(', ')}`;

function lawSizes(laws) {
  return table([
    {title: 'sensor', cells: laws.map((l) => textOf(l.axis)), class: 'left'},
    {title: 'puts out too much', cells: laws.map((l) => lawAsMath(textOf(l.expression))), class: 'words'},
    {title: 'times (± σ)', cells: laws.map((l) => `${withSigma(l.coefficient, l.sigma)} ${unitSymbol(textOf(l.unit))}`)},
    {title: 'significance (σ)', cells: laws.map((l) => significant(l.significance, 3))},
    {title: 'of the misfit', cells: laws.map((l) => (Number.isFinite(l.share) ? `${significant(100 * l.share, 3)} %` : '–'))},
  ], {class: 'laws'});
}

// Every equation that was in a class before or is now, with its odds against the best. A class before of the same law: of that with
// which it shares an equation.
function classTable(law, before) {
  const now = classOf(law);
  const earlier = before.map(classOf).find((others) => others.some((o) => now.some((n) => sameLaw(n, o)))) ?? [];
  const all = [...now, ...earlier.filter((o) => !now.some((n) => sameLaw(n, o)))];
  const odds = (list, one) => list.find((m) => sameLaw(m, one))?.odds;
  const shown = (value, absent) => (value === undefined ? absent : value === 1 ? 'best' : significant(value, 2));
  const columns = [];
  if (before.length > 0) {
    columns.push({title: 'odds before', cells: all.map((m) => shown(odds(earlier, m), '–'))});
  }
  columns.push({title: before.length > 0 ? 'odds now' : 'odds against the best', cells: all.map((m) => shown(odds(now, m), 'ruled out'))});
  return oddsTable(all, columns, all.map((m) => odds(now, m) === undefined));
}

// Times and angles of a schedule that dwells at each position in turn.
function courseOf(schedule) {
  const course = {time: [], outer: [], inner: []};
  let at = 0;
  listOf(schedule.positions).forEach((position, k) => {
    for (const stay of [0, listOf(schedule.dwell_s)[k]]) {
      at += stay;
      course.time.push(at / 60);
      course.outer.push(position[0]);
      course.inner.push(position[1]);
    }
    at += schedule.rotation_s;
  });
  return course;
}

function whyNext(step) {
  const next = objectOf(step.next_experiment);
  const splits = listOf(next.splits);
  if (splits.length === 0) {
    return 'To see the same in other positions: what one recording alone shows is not written.';
  }
  return element('span', {}, `Of the rotations that were tried this one most probably leaves one equation: ${significant(next.separation_sigma, 3)} σ are expected between the best and `,
                 lawAsMath(textOf(splits[0])), Number.isFinite(next.separation_now_sigma) ? `; these recordings alone have ${significant(next.separation_now_sigma, 3)} σ.` : '.');
}

function addExperiment(section, step, number) {
  const schedule = objectOf(objectOf(step.next_experiment).schedule);
  const course = courseOf(schedule);
  const minutes = significant(course.time.at(-1), 3);
  section.append(element('h3', {}, 'Why the next rotation'), element('p', {}, whyNext(step)));
  addPlot(section, {
    id: `rotation-${number}`,
    title: `The next rotation: ${listOf(schedule.positions).length} positions, ${minutes} min${step.experiment ? `, run ${textOf(step.experiment)}` : ', not made'}`,
    height: 240,
    x: {label: 'time', unit: 'min', values: course.time},
    y: {label: 'gimbal angle', unit: 'deg', steps: angleSteps},
    series: [{label: 'outer', colour: 'x', values: course.outer}, {label: 'inner', colour: 'y', dash: [6, 3], values: course.inner}],
  });
}

function showStep(steps, k) {
  const step = objectOf(steps[k]);
  const laws = listOf(step.discovered).map(objectOf);
  const before = k > 0 ? listOf(objectOf(steps[k - 1]).discovered).map(objectOf) : [];
  const summary = objectOf(step.summary);
  const id = `step-${k + 1}`;
  const section = element('section', {'aria-labelledby': id}, element('h2', {id}, `${k + 1}. What ${runsText(step.runs)} show${listOf(step.runs).length > 1 ? ' together' : 's'}`),
                          element('p', {class: 'lead'}, textOf(summary.verdict)));
  if (summary.cause) {
    section.append(element('p', {}, textOf(summary.cause)));
  }
  document.getElementById('steps').append(section);
  if (laws.length > 0) {
    section.append(lawSizes(laws));
    for (const law of laws) {
      section.append(element('h3', {}, classOf(law).length > 1 ? `What explains ${textOf(law.axis)} as well` : `Nothing else ${classOf(law).some((m) => listOf(m.only_here).length > 0) ? 'that a rotation could part ' : ''}explains ${textOf(law.axis)} as well`),
                     classTable(law, before));
    }
    const texts = [...laws, ...before].flatMap(classOf).map((m) => textOf(m.expression));
    section.append(element('p', {class: 'note symbols'}, lawSymbols(texts) + '.'));
  }
  const unsure = listOf(step.unsure).map(objectOf);
  if (unsure.length > 0) {
    section.append(element('p', {}, `None of the equations of ${unsure.map((law) => textOf(law.axis)).join(', ')} holds on another plan more probably than not: they are not told.`),
                   ...classTables(unsure));
  }
  if (step.next_experiment) {
    addExperiment(section, step, k + 1);
  }
  document.getElementById('save-json').before(element('a', {href: '#' + id}, `${k + 1}. ${runsText(step.runs)}`), ' ');
}

function showInvestigation(report) {
  const steps = listOf(report.steps);
  const last = objectOf(steps.at(-1));
  const written = numberOrNull(report.written_by);
  document.title = `Investigation of ${runsText(objectOf(steps[0]).runs)}`;
  const good = report.exit_status === 0;
  showBanner({standing: good ? 'good' : 'bad', verdict: textOf(objectOf(last.summary).verdict), cause: `${textOf(report.ended)}.`,
              next: written !== null ? `selfcal show ${written}` : textOf(objectOf(last.summary).next)});
  showOrigin(report);
  fillFacts([['Recordings', textOf(listOf(last.runs).length)], ['Rotations made for it', textOf(steps.filter((s) => objectOf(s).experiment).length)]]);
  later(...steps.map((_, k) => () => showStep(steps, k)), () => {
    document.getElementById('end-words').textContent = `It ended because: ${textOf(report.ended)}. `
        + (written !== null ? `Run ${written} wrote the set${good ? ' and proved it' : ', without success'}.` : 'No set was written.');
  });
}
