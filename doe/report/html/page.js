"use strict";
// What all pictures share: the data, colours of the style sheet, canvases, drawing again when the page changes.
const page = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const by = id => document.getElementById(id);
  const drawers = [], probe = document.createElement("span");
  let waiting = false;
  probe.hidden = true;
  document.body.append(probe);
  document.documentElement.classList.add("live");

  // A colour of the style sheet, resolved for light, dark or paper.
  function colour(name) {
    probe.style.color = `var(--${name})`;
    return getComputedStyle(probe).color;
  }

  function redraw() { for (const draw of drawers) draw(); }

  // Draw now, and again whenever size, colours or medium change.
  function draws(draw) { drawers.push(draw); draw(); }

  // A canvas as sharp as the screen; undefined while it has no size.
  function sharp(canvas) {
    const dense = Math.max(window.devicePixelRatio || 1, document.documentElement.classList.contains("printing") ? 2 : 1);
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return undefined;
    if (canvas.width !== Math.round(width * dense) || canvas.height !== Math.round(height * dense)) {
      canvas.width = Math.round(width * dense);
      canvas.height = Math.round(height * dense);
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.clearRect(0, 0, width, height);
    return {pen, width, height};
  }

  function later() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; redraw(); });
  }

  function shown(value, digits = 4) {
    if (value === null || value === undefined || !Number.isFinite(value)) return "";
    const text = Number(value.toPrecision(digits));
    return Math.abs(text) >= 1e7 || (text !== 0 && Math.abs(text) < 1e-4) ? value.toPrecision(digits) : String(text);
  }

  // The error to two significant digits, the value to the same place; the rule of `rounded` in rbdyn.base.words.
  function rounded(value, error) {
    if (!(error > 0) || !Number.isFinite(error) || !Number.isFinite(value)) return [shown(value, 5), ""];
    const power = number => Number(number.toExponential(1).split("e")[1]), places = 1 - power(error);
    const largest = Math.max(Math.abs(value), error);
    const fixed = (number, digits) => {
      const text = digits < 0 ? String(Math.round(number / 10 ** -digits) * 10 ** -digits) : number.toFixed(Math.min(digits, 100));
      return Number(text) === 0 ? text.replace("-", "") : text;
    };
    if (largest < 1e7 && places <= 9) return [fixed(value, places), fixed(error, places)];
    const exponent = Number(largest.toExponential(6).split("e")[1]);
    return [value, error].map(each => `${fixed(each / 10 ** exponent, places + exponent)}e${exponent}`);
  }

  const with_error = (value, error) => rounded(value, error).filter(text => text).join(" ± ");

  const named = each => each.unit ? `${each.words} [${each.unit}]` : each.words;

  function element(tag, words, attributes = {}) {
    const node = document.createElement(tag);
    node.textContent = words;
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    return node;
  }

  // Multiples of 1, 2 or 5 times a power of ten within a range.
  function ticks(low, high, count = 5) {
    const raw = (high - low) / count, decade = 10 ** Math.floor(Math.log10(raw)), values = [];
    const step = [1, 2, 5, 10].map(digit => digit * decade).find(each => each >= raw * (1 - 1e-9));
    for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n++) values.push(n * step);
    values.text = value => value.toFixed(Math.max(-Math.floor(Math.log10(step) + 1e-9), 0));
    return values;
  }

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", later);
  window.addEventListener("resize", later);
  // Paper is light whatever the screen is.
  window.addEventListener("beforeprint", () => { document.documentElement.classList.add("printing"); redraw(); });
  window.addEventListener("afterprint", () => { document.documentElement.classList.remove("printing"); redraw(); });
  return {data, by, colour, draws, redraw: later, sharp, shown, rounded, with_error, named, element, ticks};
})();
