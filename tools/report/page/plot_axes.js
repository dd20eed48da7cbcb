// The axes of a plot: titles with units, ticks and their labels.
'use strict';

function axisTitle(axis) {
  return axis.unit ? `${axis.label} (${unitSymbol(axis.unit)})` : axis.label;
}

// Zero and powers of ten on either side, as many as have room beside each other: a quarter of a half-axis apart.
function asinhTicks(low, high, linear) {
  const along = (value) => Math.asinh(value / linear);
  const most = Math.max(Math.abs(low), Math.abs(high));
  const powers = [];
  let above = Infinity;
  for (let power = Math.floor(Math.log10(most) + 1e-9); along(10 ** power) > along(most) / 4; --power) {
    if (above - along(10 ** power) > along(most) / 4) {
      powers.unshift(10 ** power);
      above = along(10 ** power);
    }
  }
  return [...powers.map((value) => -value).reverse(), 0, ...powers].filter((value) => value >= low && value <= high);
}

// Small and large powers of ten as such: a label of six digits does not fit.
function powerText(value) {
  const size = Math.abs(value);
  const power = Math.round(Math.log10(size));
  if (size === 0 || (power >= -2 && power <= 3)) {
    return (value < 0 ? '−' : '') + String(+size.toPrecision(6));
  }
  const digits = String(power).replace(/[-0-9]/g, (sign) => (sign === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[sign]));
  return (value < 0 ? '−10' : '10') + digits;
}

// Powers of ten; where few of them are in sight, twice and five times them too.
function logTicks(low, high) {
  if (!(low > 0) || !Number.isFinite(high)) {
    return [];
  }
  const ticks = [];
  const few = Math.log10(high / low) < 2;
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); ++power) {
    ticks.push(...(few ? [1, 2, 5] : [1]).map((times) => times * 10 ** power));
  }
  return ticks.filter((at) => at >= low * (1 - 1e-9) && at <= high * (1 + 1e-9));
}

function axisOptions(spec, which, ticks) {
  const axis = spec[which];
  const all = (plot, splits) => splits;
  const special = axis.asinh ? {splits: (plot, at, low, high) => asinhTicks(low, high, axis.asinh), filter: all}
      : axis.log ? {splits: (plot, at, low, high) => logTicks(low, high), filter: all} : axis.steps ? {incrs: axis.steps} : {};
  return {
    ...special,
    scale: which,
    label: axisTitle(axis),
    labelSize: 18,
    labelFont: '12px system-ui, sans-serif',
    font: '11px system-ui, sans-serif',
    size: which === 'y' ? 62 : 34,
    stroke: cssColour('text'),
    grid: {stroke: cssColour('rule'), width: 1},
    ticks: {stroke: cssColour('rule'), width: 1},
    values: (plot, splits) => {
      const decimals = decimalsOfStep(splits.length > 1 ? Math.abs(splits[1] - splits[0]) : 1);
      const labels = splits.map((at) => {
        if (at === null) return '';
        return axis.log ? String(+at.toPrecision(1)) : axis.asinh ? powerText(at) : at.toFixed(decimals).replace('-', '−');
      });
      ticks[which] = splits.map((at, k) => ({at, label: labels[k]})).filter((tick) => tick.at !== null);
      return labels;
    },
  };
}

// The fewest decimals that write every multiple of the step exactly (2.5 takes one).
function decimalsOfStep(step) {
  for (let decimals = 0; decimals < 9; ++decimals) {
    const scaled = step * 10 ** decimals;
    if (Math.abs(scaled - Math.round(scaled)) < 1e-6 * scaled) {
      return decimals;
    }
  }
  return 9;
}
