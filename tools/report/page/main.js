// Reads the document of this page and shows it.
'use strict';

function showCalibration(report) {
  document.title = `Self-calibration of ${report.serial || report.run?.serial || 'an INS'}`;
  const sections = [showVerdict, showRun, showHistory];
  if (report.parameters) {
    sections.push(showFacts, showParameters, showConsistency, showUndetermined);
  } else {
    ['parameters', 'consistency', 'noise', 'correlation'].forEach(hideSection);
  }
  sections.push(showDiagnosis);
  // What only the recording itself can tell.
  if (report.gimbal) {
    sections.push(showPasses, showConvergence, showNis, showInnovations, showGimbal, showSegments, showAllan, showCorrelation);
  } else {
    ['convergence', 'schedule', 'noise'].forEach(hideSection);
  }
  later(...sections.map((section) => () => section(report)));
}

(function show() {
  const report = JSON.parse(document.getElementById('document').textContent);
  whenDone = () => {
    // What was made later has moved the place that the address asked for.
    if (!document.documentElement.dataset.ready && location.hash && scrollY > 0) {
      document.getElementById(location.hash.slice(1))?.scrollIntoView();
    }
    document.documentElement.dataset.ready = 'true';
  };
  ({calibration: showCalibration, plan: showPlan, fleet: showFleet})[report.kind](report);
  workOn();
  document.getElementById('save-json').addEventListener(
      'click', () => saveBlob('report.json', 'application/json', JSON.stringify(report)));

  // Canvases do not follow style sheets: drawn anew for another colour scheme, width or paper.
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redrawPlots);
  const onPaper = (paper) => {
    document.documentElement.classList.toggle('print', paper);
    finishWork();
    redrawPlots();
  };
  // Before the sheets are counted for the heights, and again for the widths when the page is laid out on them.
  addEventListener('beforeprint', () => onPaper(true));
  addEventListener('afterprint', () => onPaper(false));
  matchMedia('print').addEventListener('change', (event) => onPaper(event.matches));
  let pending = 0;
  addEventListener('resize', () => {
    clearTimeout(pending);
    pending = setTimeout(redrawPlots, 150);
  });
})();
