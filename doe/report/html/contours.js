"use strict";
// Lines of equal height on a square grid by marching squares; a contour map with its scale.
const contours = (() => {
  // Segments [[x, y], [x, y]] in grid steps; the saddle's two lines are told apart by the mean of its corners.
  function segments(z, level) {
    const segments = [], n = z.length;
    for (let i = 0; i + 1 < n; i++)
      for (let j = 0; j + 1 < n; j++) {
        const corner = [z[i][j], z[i + 1][j], z[i + 1][j + 1], z[i][j + 1]];
        if (!corner.every(Number.isFinite)) continue;
        const at = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]], cuts = [];
        for (let k = 0; k < 4; k++) {
          const a = corner[k] - level, b = corner[(k + 1) % 4] - level;
          if (a < 0 === b < 0) continue;
          const share = a / (a - b), from = at[k], to = at[(k + 1) % 4];
          cuts.push([from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]);
        }
        if (cuts.length === 2) segments.push(cuts);
        if (cuts.length === 4) {
          const joined = (corner[0] < level) === ((corner[0] + corner[1] + corner[2] + corner[3]) / 4 < level);
          segments.push(joined ? [cuts[0], cuts[1]] : [cuts[0], cuts[3]], joined ? [cuts[2], cuts[3]] : [cuts[2], cuts[1]]);
        }
      }
    return segments;
  }

  // Each line is labelled near a diagonal of the map, where neither a point nor another label is in the way.
  function label(pen, lines, words, place, n, diagonal, taken) {
    const ROOM = 26;
    let best = null, least = Infinity;
    for (const [a] of lines) {
      const off = Math.abs(diagonal ? a[0] - a[1] : a[0] + a[1] - n + 1), at = place(...a);
      const edge = Math.min(a[0], a[1], n - 1 - a[0], n - 1 - a[1]);
      const free = taken.every(each => Math.hypot(each[0] - at[0], each[1] - at[1]) > ROOM);
      if (edge > 2 && free && off < least) { least = off; best = at; }
    }
    if (!best) return;
    taken.push(best);
    const [u, v] = best, wide = pen.measureText(words).width + 6;
    pen.fillStyle = page.colour("paper");
    pen.fillRect(u - wide / 2, v - 8, wide, 16);
    pen.fillStyle = page.colour("ink");
    pen.fillText(words, u, v + 4);
  }

  function symbol(pen, u, v, shape, fill, edge) {
    const corners = {
      square: [[-5, -5], [5, -5], [5, 5], [-5, 5]],
      star: Array.from({length: 10}, (_, k) => {
        const radius = k % 2 ? 3.6 : 8.5, angle = k * Math.PI / 5;
        return [radius * Math.sin(angle), -radius * Math.cos(angle)];
      }),
    }[shape];
    pen.beginPath();
    if (corners) corners.forEach(([p, q], k) => k ? pen.lineTo(u + p, v + q) : pen.moveTo(u + p, v + q));
    else pen.arc(u, v, 4, 0, 2 * Math.PI);
    pen.closePath();
    if (fill) { pen.fillStyle = fill; pen.fill(); }
    pen.strokeStyle = edge;
    pen.lineWidth = 1.4;
    pen.stroke();
  }

  // The map; gives back the way from pixels to shares of the two axes.
  function draw(canvas, s) {
    const sheet = page.sharp(canvas);
    if (!sheet) return null;
    const {pen, width, height} = sheet, n = s.z.length, ink = page.colour("ink");
    const left = 62, top = 14, wide = width - left - 80, high = height - top - 50;
    const place = (i, j) => [left + wide * i / (n - 1), top + high * (1 - j / (n - 1))];
    const share = value => (value - s.low) / (s.high - s.low);
    // A pixel a grid point, enlarged smoothly; the outer half of the rim is beyond the axes.
    pen.drawImage(pixels(s.z, share), 0.5, 0.5, n - 1, n - 1, left, top, wide, high);
    const at = (x, y) => place((n - 1) * (x - s.x[0]) / (s.x[1] - s.x[0]), (n - 1) * (y - s.y[0]) / (s.y[1] - s.y[0]));
    const taken = [...s.points, ...s.marks].map(each => at(each.x, each.y));
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "center";
    const levels = page.ticks(s.low, s.high, 9);
    levels.forEach(level => {
      const lines = segments(s.z, level);
      pen.strokeStyle = "rgba(255, 255, 255, .85)";
      pen.lineWidth = 1.2;
      pen.beginPath();
      for (const [a, b] of lines) { pen.moveTo(...place(...a)); pen.lineTo(...place(...b)); }
      pen.stroke();
    });
    for (const bound of s.bounds) {
      pen.strokeStyle = page.colour("vermilion");
      pen.lineWidth = 2.6;
      pen.beginPath();
      for (const [a, b] of segments(s.z, bound)) { pen.moveTo(...place(...a)); pen.lineTo(...place(...b)); }
      pen.stroke();
    }
    levels.forEach((level, k) => label(pen, segments(s.z, level), levels.text(level), place, n, k % 2, taken));
    axes(pen, s, left, top, wide, high, ink);
    scale(pen, s, left + wide + 14, top, high, ink);
    for (const p of s.points) symbol(pen, ...at(p.x, p.y), "dot", p.here ? "#fff" : null, p.here ? "#000" : "#fff");
    for (const p of s.marks) symbol(pen, ...at(p.x, p.y), p.shape, p.here ? "#d55e00" : null, "#fff");
    const [u, v] = at(...s.marker);
    for (const [paint, thick] of [["#000", 3.5], ["#fff", 1.5]]) {
      pen.strokeStyle = paint;
      pen.lineWidth = thick;
      pen.beginPath();
      pen.moveTo(u - 9, v); pen.lineTo(u + 9, v); pen.moveTo(u, v - 9); pen.lineTo(u, v + 9);
      pen.stroke();
    }
    return (p, q) => [(p - left) / wide, 1 - (q - top) / high];
  }

  function pixels(z, share) {
    const n = z.length, small = document.createElement("canvas"), pen = small.getContext("2d");
    small.width = small.height = n;
    z.forEach((line, i) => line.forEach((value, j) => {
      if (!Number.isFinite(value)) return;
      pen.fillStyle = viridis.css(share(value));
      pen.fillRect(i, n - 1 - j, 1, 1);
    }));
    return small;
  }

  function axes(pen, s, left, top, wide, high, ink) {
    pen.strokeStyle = page.colour("line");
    pen.fillStyle = ink;
    pen.lineWidth = 1;
    pen.strokeRect(left, top, wide, high);
    const across = page.ticks(...s.x), up = page.ticks(...s.y);
    for (const value of across)
      pen.fillText(across.text(value), left + wide * (value - s.x[0]) / (s.x[1] - s.x[0]), top + high + 17);
    pen.textAlign = "right";
    for (const value of up)
      pen.fillText(up.text(value), left - 5, top + high * (1 - (value - s.y[0]) / (s.y[1] - s.y[0])) + 4);
    pen.textAlign = "center";
    pen.fillText(s.labels[0], left + wide / 2, top + high + 40);
    pen.save();
    pen.translate(14, top + high / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(s.labels[1], 0, 0);
    pen.restore();
  }

  // The bar of colours at the right.
  function scale(pen, s, left, top, high, ink) {
    for (let k = 0; k < high; k++) {
      pen.fillStyle = viridis.css(1 - k / high);
      pen.fillRect(left, top + k, 12, 1.5);
    }
    pen.fillStyle = ink;
    pen.textAlign = "left";
    const values = page.ticks(s.low, s.high);
    for (const value of values)
      pen.fillText(values.text(value), left + 16, top + high * (1 - (value - s.low) / (s.high - s.low)) + 4);
    pen.textAlign = "center";
  }

  return {draw, segments, symbol};
})();
