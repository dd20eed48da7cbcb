// Equations of laws, set as mathematics. The text is the estimator's own (estimator/laws): numbers, + - * / **, parentheses,
// functions of one argument, the variables of the motion, and ? for a constant that is fitted.
'use strict';

const mathNamespace = 'http://www.w3.org/1998/Math/MathML';

function math(tag, ...content) {
  const made = document.createElementNS(mathNamespace, tag);
  made.append(...content);
  return made;
}

const mathRow = (...content) => math('mrow', ...content);
const withIndex = (letter, index) => math('msub', math('mi', letter), math('mi', index));
const inParentheses = (content) => mathRow(math('mo', '('), content, math('mo', ')'));

const mathVariables = {
  ...Object.fromEntries(['x', 'y', 'z'].flatMap((axis) => [['f' + axis, () => withIndex('f', axis)], ['w' + axis, () => withIndex('ω', axis)]])),
  outer: () => withIndex('θ', 'outer'), inner: () => withIndex('θ', 'inner'),
  wo: () => withIndex('ω', 'outer'), wi: () => withIndex('ω', 'inner'),
  so: () => withIndex('s', 'outer'), si: () => withIndex('s', 'inner'),
  since: () => withIndex('t', 'turn'), rest: () => withIndex('t', 'rest'),
  t: () => math('mi', 't'), n: () => math('mi', 'n'), pi: () => math('mi', 'π'), T: () => math('mi', 'T'),
  dT: () => math('mover', math('mi', 'T'), math('mo', '˙')),
};
const mathFunctions = ['sin', 'cos', 'exp', 'log', 'sqrt', 'abs', 'sign', 'tanh'];
// Letter, the names that it stands for, what it is.
const mathLetters = [
  ['f', /\bf[xyz]\b/, 'specific force over g'], ['ω', /\bw[xyzoi]\b/, 'angular rate in °/s'],
  ['θ', /\b(outer|inner)\b/, 'gimbal angle in rad'], ['s', /\bs[oi]\b/, 'sense of the last turn'],
  ['t', /\bt\b/, 'time in h'], ['t with turn', /\bsince\b/, 'time since the last turn in s'],
  ['t with rest', /\brest\b/, 'time at rest in s'], ['n', /\bn\b/, 'number of the dwell'],
  ['T', /\bd?T\b/, 'temperature less its mean'],
];

// A tree of {kind, ...}; throws where the text is no expression.
function parseLaw(text) {
  const tokens = text.match(/\*\*|[-+*/()?]|\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?|[A-Za-z_]\w*|\S/g) ?? [];
  let at = 0;
  const take = (wanted) => tokens[at] === wanted && ++at > 0;
  const need = (wanted) => {
    if (!take(wanted)) {
      throw new Error(`${wanted} is missing`);
    }
  };
  const atom = () => {
    const token = tokens[at++] ?? '';
    if (token === '(') {
      const inner = sum();
      need(')');
      return inner;
    }
    if (mathFunctions.includes(token)) {
      need('(');
      const argument = sum();
      need(')');
      return {kind: 'function', name: token, argument};
    }
    if (/^[.\d]/.test(token)) {
      return {kind: 'number', text: token};
    }
    if (token === '?' || Object.hasOwn(mathVariables, token)) {
      return {kind: 'name', text: token};
    }
    throw new Error(`${token} is no part of a law`);
  };
  const power = () => {
    const base = atom();
    return take('**') ? {kind: 'power', base, exponent: signed()} : base;
  };
  const signed = () => (take('-') ? {kind: 'minus', of: signed()} : power());
  const product = () => {
    let left = signed();
    while (tokens[at] === '*' || tokens[at] === '/') {
      left = {kind: tokens[at++], left, right: signed()};
    }
    return left;
  };
  const sum = () => {
    let left = product();
    while (tokens[at] === '+' || tokens[at] === '-') {
      left = {kind: tokens[at++], left, right: product()};
    }
    return left;
  };
  const whole = sum();
  if (at !== tokens.length) {
    throw new Error(`${tokens[at]} is too much`);
  }
  return whole;
}

const isSum = (tree) => ['+', '-', 'minus'].includes(tree.kind);

function mathNumber(text) {
  const [mantissa, exponent] = text.toLowerCase().split('e');
  const number = math('mn', mantissa);
  return exponent === undefined ? number
      : mathRow(number, math('mo', '×'), math('msup', math('mn', '10'), math('mn', exponent.replace('+', '').replace('-', '−'))));
}

function mathFunction({name, argument}) {
  const inner = mathOfTree(argument);
  switch (name) {
    case 'exp': return math('msup', math('mi', 'e'), mathOfTree(argument, true));
    case 'sqrt': return math('msqrt', inner);
    case 'abs': return mathRow(math('mo', '|'), inner, math('mo', '|'));
    default: return mathRow(math('mi', name === 'log' ? 'ln' : name), inParentheses(inner));
  }
}

const isPlain = (tree) => ['name', 'number', 'function'].includes(tree.kind);

// `raised`: in an exponent, where a fraction on two lines could not be read.
function mathOfTree(tree, raised = false) {
  const guarded = (part, guard) => (guard(part) ? inParentheses(mathOfTree(part, raised)) : mathOfTree(part, raised));
  switch (tree.kind) {
    case 'number': return mathNumber(tree.text);
    case 'name': return tree.text === '?' ? math('mi', '?') : mathVariables[tree.text]();
    case 'function': return mathFunction(tree);
    case 'minus': return mathRow(math('mo', '−'), guarded(tree.of, isSum));
    case 'power': return math('msup', guarded(tree.base, (b) => !['name', 'number'].includes(b.kind)), mathOfTree(tree.exponent, true));
    case '/': return raised ? mathRow(guarded(tree.left, (left) => left.kind === '+' || left.kind === '-'), math('mo', '/'), guarded(tree.right, (right) => !isPlain(right)))
        : math('mfrac', mathOfTree(tree.left), mathOfTree(tree.right));
    case '*': return mathRow(guarded(tree.left, isSum), math('mo', '·'), guarded(tree.right, isSum));
    default: return mathRow(mathOfTree(tree.left, raised), math('mo', tree.kind === '-' ? '−' : '+'),
                            guarded(tree.right, (right) => tree.kind === '-' ? isSum(right) : right.kind === 'minus'));
  }
}

// The equation, or the text as it stands where it is none.
function lawAsMath(text) {
  try {
    return math('math', mathOfTree(parseLaw(text)));
  } catch {
    return element('code', {}, text);
  }
}

// What the letters of these equations stand for.
function lawSymbols(texts) {
  const names = texts.join(' ');
  return mathLetters.filter(([, pattern]) => pattern.test(names)).map(([letter, , words]) => `${letter}: ${words}`).join('; ');
}
