// Work in slices, in the order it was given: what stands first on the page is painted before the rest is made.
'use strict';

const sliceMs = 12;
const waiting = [];
let resting = false;   // until the next slice, which is ordered already
let whenDone = () => {};

function later(...work) {
  waiting.push(...work);
  if (!resting) {
    resting = true;
    setTimeout(workOn, 0);
  }
}

function workOn() {
  resting = false;
  const end = performance.now() + sliceMs;
  while (waiting.length > 0 && performance.now() < end && !resting) {
    waiting.shift()();
  }
  if (waiting.length > 0 && !resting) {
    resting = true;
    setTimeout(workOn, 0);
  }
  if (waiting.length === 0) {
    whenDone();
  }
}

// All that is left, at once: paper does not wait.
function finishWork() {
  while (waiting.length > 0) {
    waiting.shift()();
  }
  whenDone();
}

// Ends the slice until the browser has painted; a page that is not seen paints nothing, and is not waited for.
function letPaint(name) {
  resting = true;
  let painted = false;
  const go = () => {
    if (!painted) {
      painted = true;
      workOn();
    }
  };
  requestAnimationFrame(() => setTimeout(() => {
    performance.mark(name);
    go();
  }, 0));
  setTimeout(go, 500);
}
