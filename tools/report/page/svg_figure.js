// A figure whose picture is SVG rather than a uPlot canvas: the same frame, saving and table of numbers.
'use strict';

// Style sheets and custom properties do not travel with a saved picture.
function standaloneSvg(svg) {
  const copy = svg.cloneNode(true);
  const box = svg.viewBox.baseVal;
  copy.setAttribute('xmlns', svgNamespace);
  copy.setAttribute('width', box.width);
  copy.setAttribute('height', box.height);
  const style = `text { fill: ${cssColour('text')}; font: 11px sans-serif; }`;
  copy.prepend(svgElement('style', {}, style), svgElement('rect', {width: '100%', height: '100%', fill: cssColour('ground')}));
  return new XMLSerializer().serializeToString(copy).replace(/var\(--(\w+)\)/g, (_, name) => cssColour(name));
}

async function svgToPng(svg) {
  const picture = new Image();
  picture.src = 'data:image/svg+xml;charset=utf-8,' + encodeURIComponent(standaloneSvg(svg));
  await picture.decode();
  const canvas = element('canvas', {width: 2 * picture.naturalWidth, height: 2 * picture.naturalHeight});
  canvas.getContext('2d').drawImage(picture, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve) => canvas.toBlob(resolve, 'image/png'));
}

// spec: {id, title, svg, columns: [{title, values}]}
function addSvgFigure(parent, spec) {
  const button = (label, type, content) => {
    const made = element('button', {type: 'button', title: `Save "${spec.title}" as ${label}`}, label);
    made.addEventListener('click', async () => saveBlob(`${spec.id}.${label.toLowerCase()}`, type, await content()));
    return made;
  };
  const tools = element('div', {class: 'tools'},
      button('CSV', 'text/csv', () => columnsCsv(spec.columns)),
      button('JSON', 'application/json', () => JSON.stringify(spec.columns)),
      button('SVG', 'image/svg+xml', () => standaloneSvg(spec.svg)),
      button('PNG', 'image/png', () => svgToPng(spec.svg)));
  const details = element('details', {}, element('summary', {}, 'Numbers'));
  details.addEventListener('toggle', () => {
    if (details.open && details.children.length === 1) {
      details.append(table(spec.columns.map((column) => ({title: column.title, cells: column.values.map(
          (value) => (typeof value === 'number' ? significant(value, 4) : String(value ?? '–')))}))));
    }
  });
  spec.svg.classList.add('picture');
  spec.svg.id = spec.id;
  parent.append(element('figure', {}, element('header', {}, element('h3', {}, spec.title), tools), spec.svg, details));
}
