// Reads the document of this page and shows it.
'use strict';

function showCalibration(report) {
  document.title = `Self-calibration of ${textOf(report.serial) || textOf(objectOf(report.run).serial) || 'an INS'}`;
  const known = listOf(report.parameters).length > 0;
  const sections = [showVerdict, ...(known ? [showFacts] : []), showOrigin, showRun, showHistory];
  if (known) {
    sections.push(showParameters, showConsistency, showUndetermined);
  } else {
    delete report.parameters;
    ['parameters', 'consistency', 'noise', 'correlation'].forEach(hideSection);
  }
  sections.push(showDiagnosis);
  // What only the recording itself can tell.
  if (report.gimbal && known) {
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
  // A part that the document does not allow says so, and the others stand.
  whenBroken = (error) => document.querySelector('main').append(
      element('p', {class: 'bad missing-part'}, `A part of this page is missing, for the document lacks what it needs: ${error.message}`));
  later(() => ({calibration: showCalibration, plan: showPlan, fleet: showFleet, investigation: showInvestigation, overlay: showOverlay,
                poses: showPoses})[report.kind](report));
  setPaperMargins(report);
  workOn();
  document.getElementById('save-json').addEventListener(
      'click', () => saveBlob('report.json', 'application/json', JSON.stringify(report)));

  // Canvases do not follow style sheets: drawn anew for another colour scheme or paper.
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redrawPlots);
  const onPaper = (paper) => {
    document.documentElement.classList.toggle('print', paper);
    setPaperMargins(report);
    finishWork();
    redrawPlots();
  };
  // Before the sheets are counted for the heights, and again for the widths when the page is laid out on them.
  addEventListener('beforeprint', () => onPaper(true));
  addEventListener('afterprint', () => onPaper(false));
  matchMedia('print').addEventListener('change', (event) => onPaper(event.matches));
})();
