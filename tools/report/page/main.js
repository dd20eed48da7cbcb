// Reads the document of this page and shows it.
'use strict';

function showCalibration(report) {
  document.title = `Self-calibration of ${report.serial || report.run?.serial || 'an INS'}`;
  showVerdict(report);
  showRun(report);
  showHistory(report);
  if (report.parameters) {
    showFacts(report);
    showParameters(report);
    showConsistency(report);
    showUndetermined(report);
  } else {
    ['parameters', 'consistency', 'noise', 'correlation'].forEach(hideSection);
  }
  showDiagnosis(report);
  // What only the recording itself can tell.
  if (report.gimbal) {
    showPasses(report);
    showConvergence(report);
    showNis(report);
    showInnovations(report);
    showGimbal(report);
    showSegments(report);
    showAllan(report);
    showCorrelation(report);
  } else {
    ['convergence', 'schedule', 'noise'].forEach(hideSection);
  }
}

(function show() {
  const report = JSON.parse(document.getElementById('document').textContent);
  ({calibration: showCalibration, plan: showPlan, fleet: showFleet})[report.kind](report);
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
