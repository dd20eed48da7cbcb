// Work in slices, in the order it was given: what stands first on the page is painted before the rest is made.
'use strict';

const sliceMs = 12;
const waiting = [];
let resting = false;   // until the next slice, which is ordered already
let whenDone = () => {};
let whenBroken = () => {};   // (error): a piece of work ended there; the others go on

function workOnce() {
  const work = waiting.shift();
  try {
    work();
  } catch (error) {
    whenBroken(error);
  }
}

function later(...work) {
  waiting.push(...work);
  if (!resting) {
    resting = true;
    setTimeout(workOn, 0);
  }
}

// Before all that waits.
function sooner(...work) {
  waiting.unshift(...work);
  later();
}

function workOn() {
  resting = false;
  const end = performance.now() + sliceMs;
  while (waiting.length > 0 && performance.now() < end && !resting) {
    workOnce();
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
    workOnce();
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
