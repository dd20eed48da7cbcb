// Reads the document of this page and shows it.
'use strict';

(function show() {
  const report = JSON.parse(document.getElementById('document').textContent);
  document.title = `Self-calibration of ${report.serial || 'an INS'}`;
  showVerdict(report);
  showFacts(report);
  showParameters(report);
  showPasses(report);
  showConvergence(report);
  showConsistency(report);
  showNis(report);
  showGimbal(report);
  showSegments(report);
  showAllan(report);
  showUndetermined(report);
  showCorrelation(report);
  document.getElementById('save-json').addEventListener(
      'click', () => saveBlob('report.json', 'application/json', JSON.stringify(report)));

  // Canvases do not follow style sheets: drawn anew for another colour scheme, width or paper.
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redrawPlots);
  matchMedia('print').addEventListener('change', (event) => {
    document.documentElement.classList.toggle('print', event.matches);
    redrawPlots();
  });
  let pending = 0;
  addEventListener('resize', () => {
    clearTimeout(pending);
    pending = setTimeout(redrawPlots, 150);
  });
  document.documentElement.dataset.ready = 'true';
})();
