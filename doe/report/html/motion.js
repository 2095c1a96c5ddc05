"use strict";
// Plays the motion at the points side by side: button, moment, speed, magnification of the clearances.
(() => {
  const {data, by} = page, SECONDS_A_TURN = 6;
  const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

  // Numbers in two letters each, the inverse of `packed` in doe/report/page.py.
  const code = Object.fromEntries([...LETTERS].map((letter, k) => [letter, k]));
  const numbers = ({step, first, letters}) => Float64Array.from(
    {length: letters.length / 2}, (_, k) => step * (first + 64 * code[letters[2 * k]] + code[letters[2 * k + 1]]));
  const unpacked = record => Object.fromEntries(
    Object.entries(record).map(([key, value]) => [key, value && value.letters ? numbers(value) : value]));

  const shown = Object.entries(data.motion).map(([name, record]) => {
    const motion = unpacked(record);
    const canvas = page.element("canvas", "", {role: "img", "aria-label": `Moving cross-section of the bearing at the ${name}, with its forces`});
    const figure = page.element("figure", "");
    figure.append(page.element("figcaption", `${name}: ${motion.title}`), canvas);
    by("bearing_canvases").append(figure);
    return {motion, canvas};
  });
  const first = shown[0].motion, frames = Math.min(...shown.map(each => each.motion.frames));
  const largest = Math.min(...shown.map(each => each.motion.largest_magnification));
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  let frame = 0, playing = false, before = 0, debt = 0;

  // The colours of the drawing, darker or lighter with the page.
  const ROLES = {
    outer: "blue", inner: "vermilion", cage: "green", ring: "metal", ring_edge: "edge", space: "paper", mark: "quiet",
    land: "orange", bar: "brass", bar_edge: "orange", rim: "orange", roller: "steel", roller_edge: "edge", ink: "ink",
  };

  function draw() {
    const colours = Object.fromEntries(Object.entries(ROLES).map(([role, name]) => [role, page.colour(name)]));
    const magnification = Number(by("bearing_magnify").value);
    for (const each of shown) draw_bearing(each.canvas, each.motion, frame, magnification, colours);
    const turn = first.time_us[frame] * 1e-6 / first.turn_s;
    by("bearing_moment").value = frame;
    by("bearing_time").textContent = `turn ${turn.toFixed(2)}, ${(first.time_us[frame] * 1e-3).toFixed(3)} ms`;
    by("bearing_moment").setAttribute("aria-valuetext", by("bearing_time").textContent);
    by("bearing_magnify_shown").textContent = `${magnification} × magnified`;
  }

  const interval = () => (first.time_us[1] - first.time_us[0]) * 1e-6;
  const frames_a_second = () => first.turn_s / interval() / SECONDS_A_TURN * 2 ** Number(by("bearing_speed").value);

  function show_speed() {
    const slower = 1 / (frames_a_second() * interval());
    by("bearing_speed_shown").textContent = `${Number(slower.toPrecision(2))} times slower`;
  }

  function tick(now) {
    if (!playing) return;
    debt += Math.min(Math.max(now - before, 0) / 1000, 0.2) * frames_a_second();
    before = now;
    const whole = Math.floor(debt);
    if (whole) { debt -= whole; frame = (frame + whole) % frames; draw(); }
    requestAnimationFrame(tick);
  }

  function play(wish) {
    playing = wish;
    by("bearing_play").textContent = wish ? "Pause" : "Play";
    by("bearing_play").setAttribute("aria-pressed", String(wish));
    if (wish) { before = performance.now(); requestAnimationFrame(tick); }
  }

  by("bearing_moment").max = frames - 1;
  by("bearing_magnify").max = largest;
  by("bearing_magnify").value = Math.min(...shown.map(each => each.motion.magnification));
  by("bearing_magnify").disabled = largest <= 1;
  by("bearing_play").addEventListener("click", () => play(!playing));
  by("bearing_moment").addEventListener("input", () => { play(false); frame = Number(by("bearing_moment").value); draw(); });
  by("bearing_magnify").addEventListener("input", draw);
  by("bearing_speed").addEventListener("input", show_speed);
  // Whoever wants no motion starts it by the button, or moves the slider; others see it move when it comes into view.
  if (!still.matches)
    new IntersectionObserver((seen, observer) => {
      if (!seen.some(each => each.isIntersecting)) return;
      observer.disconnect();
      play(true);
    }, {threshold: 0.5}).observe(by("bearing_play"));
  still.addEventListener("change", () => { if (still.matches) play(false); });
  window.addEventListener("beforeprint", () => play(false));
  show_speed();
  page.draws(draw);
})();
