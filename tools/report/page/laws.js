// What the search for laws found: the equations, what cannot be told from them, and with which odds.
'use strict';

// Laws and processes that take away all but a tenth of the misfit.
function explained(d) {
  return d.unexplained && objectOf(d.discovery).explained_share >= 0.9 && listOf(d.described).length === 0;
}

// Laws alone explain it: the 24, what is left and the pictures are those with the laws.
function correctedByLaws(d) {
  return explained(d) && listOf(d.discovered).length > 0 && listOf(d.processes).length === 0;
}

function discoveredTable(laws, processes, id) {
  const all = [...laws, ...processes];
  return table([
    {title: 'sensor', cells: all.map((l) => textOf(l.axis)), class: 'left'},
    {title: 'law', cells: [...laws.map((l) => lawAsMath(textOf(l.expression))), ...processes.map((p) => textOf(p.process))], class: 'words'},
    ...(laws.some((l) => l.effect) ? [{title: 'as in the catalogue', cells: laws.map((l) => textOf(l.effect) || '–'), class: 'left'}] : []),
    {title: 'size ± σ', cells: all.map((l) => `${withSigma(l.coefficient, l.sigma)} ${unitSymbol(l.unit)}${l.process === 'random walk' ? '/√h' : ''}`)},
    ...(laws.some((l) => l.why) ? [{title: 'no equation, for', cells: all.map((l) => textOf(l.why) || '–'), class: 'words'}] : []),
    {title: 'holds on another plan', cells: all.map((l) => (Number.isFinite(l.carries_over) ? `${significant(100 * l.carries_over, 2)} %` : '–'))},
  ], {id});
}

// No rotation tells these apart; some of them another attitude of the base would.
function otherWords(member) {
  const most = 3;
  const some = listOf(member.also);
  const cell = element('span', {}, some.length === 0 ? '–' : '');
  const here = listOf(member.only_here).map(textOf);
  some.slice(0, most).forEach((text, k) => {
    cell.append(k > 0 ? ', ' : '', lawAsMath(textOf(text)), here.includes(textOf(text)) ? ' (on this base)' : '');
  });
  cell.append(some.length > most ? ` and ${some.length - most} more` : '');
  return cell;
}

// Equations with what is the same in other words; `columns` with their odds.
function oddsTable(members, columns, faint) {
  const first = [
    {title: 'equation', cells: members.map((m) => lawAsMath(textOf(m.expression))), class: 'words'},
    {title: 'sensor', cells: members.map((m) => textOf(m.axis)), class: 'left'},
  ];
  if (members.some((m) => listOf(m.also).length > 0)) {
    first.push({title: 'the same in other words', cells: members.map(otherWords), class: 'words'});
  }
  return table([...first, ...columns], {class: 'odds'}, faint);
}

// Every equation that this recording cannot tell from a law, with its odds, one table a law.
function classTables(laws) {
  const members = (law) => listOf(law.class).map(objectOf);
  const open = laws.map(objectOf).filter((law) => members(law).length > 1 || members(law).some((m) => listOf(m.also).length > 0));
  return open.flatMap((law) => {
    const all = members(law);
    const words = all.length > 1 ? `What this recording cannot tell from the equation of ${textOf(law.axis)}:` : `The equation of ${textOf(law.axis)} in other words:`;
    return [element('p', {class: 'note'}, words),
            oddsTable(all, [{title: 'odds against the best', cells: all.map((m) => (m.odds === 1 ? 'best' : significant(m.odds, 2)))}])];
  });
}

// What explains the recording in the place of all that was found; nothing where nothing does.
function insteadNote(instead) {
  const parts = [];
  for (const law of listOf(objectOf(instead).laws).map(objectOf)) {
    parts.push([`${textOf(law.axis)} follows `, lawAsMath(textOf(law.expression))]);
  }
  for (const process of listOf(objectOf(instead).processes).map(objectOf)) {
    parts.push([`a ${textOf(process.process)} of ${textOf(process.axis)}`]);
  }
  const words = parts.flatMap((part, k) => (k > 0 ? [' and ', ...part] : part));
  return element('p', {class: 'note', id: 'instead'},
                 ...(parts.length > 0 ? ['In place of all that this explains the recording too: ', ...words, `. Odds ${significant(instead.odds, 2)}.`] : []));
}

// How the equations that are left open can be told apart; nothing where none is.
function nextExperiment(laws) {
  const open = laws.map(objectOf).some((law) => listOf(law.class).length > 1);
  return element('p', {class: 'note', id: 'next-experiment'}, ...(open ? ['They differ on a rotation designed for it: ',
    element('code', {}, 'selfcal diagnose RECORDING --next-experiment next.toml'), ' writes it, ', element('code', {}, 'selfcal investigate RUN'), ' makes it.'] : []));
}
