"use strict";
// The bearing at one moment on a canvas, its clearances magnified; ``d`` is the record of rbdyn/plots/drawing.py.
// Shared by every page that plays the motion. Colours by role, so that a page can have its own.
const LIGHT_BEARING = {
  outer: "#0072b2", inner: "#d55e00", cage: "#009e73", ring: "#e4e7ea", ring_edge: "#8a9096", space: "#fff",
  mark: "#3c4248", land: "#b08a3c", bar: "#e3c27a", bar_edge: "#9c7a2e", rim: "#c9a95c", roller: "#cdd6df",
  roller_edge: "#59636d", ink: "#20262c",
};

function draw_bearing(canvas, d, frame, magnification, colour) {
  const pen = canvas.getContext("2d"), Z = d.rollers, RING = 0.45, unit = d.extent / 33;

  // The bearing's x points down, its y to the right.
  const polar = (middle, radius, angle) =>
    [middle[0] + radius * Math.cos(angle), middle[1] + radius * Math.sin(angle)];

  function circle(middle, radius, fill, edge) {
    pen.beginPath();
    pen.arc(middle[1], middle[0], radius, 0, 2 * Math.PI);
    if (fill) { pen.fillStyle = fill; pen.fill(); }
    if (edge) { pen.strokeStyle = edge; pen.stroke(); }
  }

  function path(points, fill, edge) {
    pen.beginPath();
    points.forEach((p, i) => i ? pen.lineTo(p[1], p[0]) : pen.moveTo(p[1], p[0]));
    if (fill) { pen.closePath(); pen.fillStyle = fill; pen.fill(); }
    pen.strokeStyle = edge;
    pen.stroke();
  }

  function arrow(tail, tip, paint) {
    const long = Math.hypot(tip[0] - tail[0], tip[1] - tail[1]), head = Math.min(1.1 * unit, long);
    if (long < 0.05 * unit) return;
    const way = Math.atan2(tip[1] - tail[1], tip[0] - tail[0]), width = pen.lineWidth;
    const neck = polar(tip, -0.8 * head, way);
    pen.lineWidth = 0.4 * unit;
    path([tail, neck], null, paint);
    pen.lineWidth = 0.05 * unit;
    path([tip, polar(polar(tip, -head, way), 0.4 * head, way + Math.PI / 2),
          polar(polar(tip, -head, way), 0.4 * head, way - Math.PI / 2)], paint, paint);
    pen.lineWidth = width;
  }

  const m = magnification, f = frame, um = 1e-3 * m;
  const pixels = Math.round(canvas.clientWidth * (window.devicePixelRatio || 1));
  if (!pixels) return;
  if (canvas.width !== pixels) { canvas.width = pixels; canvas.height = pixels; }
  const scale = pixels / (2 * d.extent);
  pen.setTransform(scale, 0, 0, scale, pixels / 2, pixels / 2);
  pen.clearRect(-d.extent, -d.extent, 2 * d.extent, 2 * d.extent);
  pen.lineWidth = 0.12 * unit;
  const outer = d.pitch + d.roller + m * d.outer_gap, inner = d.pitch - d.roller - m * d.inner_gap;
  const thick = RING * d.roller;
  const cage = [um * d.cage_x_um[f], um * d.cage_y_um[f]], ring = [um * d.ring_x_um[f], um * d.ring_y_um[f]];
  circle([0, 0], outer + thick, colour.ring, colour.ring_edge);
  circle([0, 0], outer, colour.space, colour.ring_edge);
  circle(ring, inner, colour.ring, colour.ring_edge);
  circle(ring, inner - 1.6 * thick, colour.space, colour.ring_edge);
  circle(polar([0, 0], outer + 0.5 * thick, d.outer_angle[f]), 0.3 * thick, colour.mark);
  circle(polar(ring, inner - 0.8 * thick, d.inner_angle[f]), 0.3 * thick, colour.mark);
  if (d.guide_side) {
    pen.setLineDash([unit, 0.6 * unit]);
    circle(d.guide_side > 0 ? [0, 0] : ring, d.pitch + d.guide_side * (d.cage_half + m * d.guide_gap), null, colour.land);
    pen.setLineDash([]);
  }
  const half = d.roller + m * d.pocket_gap, low = d.pitch - d.cage_half, high = d.pitch + d.cage_half;
  const a = Math.asin(Math.min(half / low, 1)), b = Math.asin(Math.min(half / high, 1)), step = 2 * Math.PI / Z;
  for (let j = 0; j < Z; j++) {
    const here = d.cage_angle[f] + j * step;
    path([[low, a], [high, b], [high, step / 2], [high, step - b], [low, step - a], [low, step / 2]]
         .map(([radius, angle]) => polar(cage, radius, here + angle)), colour.bar, colour.bar_edge);
  }
  circle(cage, low, null, colour.rim);
  circle(cage, high, null, colour.rim);
  const arrows = [];
  for (let j = 0; j < Z; j++) {
    const i = f * Z + j, angle = d.cage_angle[f] + j * step + um * d.ahead_um[i] / d.pitch;
    const centre = polar([0, 0], d.pitch + um * d.out_um[i], angle);
    circle(centre, d.roller, colour.roller, colour.roller_edge);
    path([centre, polar(centre, 0.8 * d.roller, d.spin[i])], null, colour.roller_edge);
    if (d.outer_load_N[i])
      arrows.push([
          polar(centre, d.roller + d.outer_load_N[i] / d.race_scale, angle), polar(centre, d.roller, angle), colour.outer]);
    if (d.inner_load_N[i])
      arrows.push([
          polar(centre, -d.roller - d.inner_load_N[i] / d.race_scale, angle), polar(centre, -d.roller, angle), colour.inner]);
    if (d.pocket_load_N[i])
      arrows.push([centre, polar(centre, d.pocket_load_N[i] / d.cage_scale, angle + Math.PI / 2), colour.cage]);
  }
  if (d.land_load_N[f]) {
    const middle = d.guide_side > 0 ? [0, 0] : ring, touch = d.pitch + d.guide_side * d.cage_half;
    const angle = Math.atan2(cage[1] - middle[1], cage[0] - middle[0]) + (d.guide_side < 0 ? Math.PI : 0);
    arrows.push([
      polar(cage, touch + d.guide_side * d.land_load_N[f] / d.cage_scale, angle), polar(cage, touch, angle), colour.cage]);
  }
  for (const each of arrows) arrow(...each);
  // Reference arrows, at the foot.
  pen.font = `${1.5 * unit}px system-ui, sans-serif`;
  d.references.forEach(([u, v, tip_u, tip_v, words, beside], line) => {
    arrow([v, u], [tip_v, tip_u], [colour.outer, colour.inner, colour.cage][line]);
    pen.fillStyle = colour.ink;
    pen.fillText(words, beside, v + 0.016 * d.extent);
  });
}
