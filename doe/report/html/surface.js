"use strict";
// A surface over two factors in space, drawn back to front, with contours on the floor and the runs around it.
const surface_3d = (() => {
  const TALL = 0.62;

  // From shares (0 to 1) of the three axes to the eye: right, up, and how near.
  function eye(view) {
    const ca = Math.cos(view.azimuth), sa = Math.sin(view.azimuth), ce = Math.cos(view.elevation), se = Math.sin(view.elevation);
    return (x, y, z) => {
      const [a, b, c] = [2 * x - 1, 2 * y - 1, TALL * (2 * z - 1)];
      const along = a * ca + b * sa;
      return [b * ca - a * sa, c * ce - along * se, along * ce + c * se];
    };
  }

  function draw(canvas, s, view) {
    const sheet = page.sharp(canvas);
    if (!sheet) return null;
    const {pen, width, height} = sheet, see = eye(view);
    const size = Math.min((width - 70) / 2.95, (height - 50) / 2.5);
    const screen = (x, y, z) => {
      const [right, up, near] = see(x, y, z);
      return [width / 2 + 8 + size * right, height / 2 - 12 - size * up, near];
    };
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "center";
    frame(pen, s, screen);
    floor(pen, s, screen);
    const share = value => (value - s.low) / (s.high - s.low), n = s.z.length;
    const corners = s.z.map((line, i) => line.map((value, j) => screen(i / (n - 1), j / (n - 1), share(value))));
    skin(pen, s, corners, share);
    runs(pen, s, screen, share);
    return nearest(corners);
  }

  // The floor, and the three axes that stand clear of the surface, with ticks and names.
  function frame(pen, s, screen) {
    const line = page.colour("line"), ink = page.colour("ink");
    const base = [[0, 0], [1, 0], [1, 1], [0, 1]].map(([x, y]) => screen(x, y, 0));
    pen.strokeStyle = line;
    pen.fillStyle = page.colour("card");
    pen.lineWidth = 1;
    pen.beginPath();
    base.forEach(([u, v], k) => k ? pen.lineTo(u, v) : pen.moveTo(u, v));
    pen.closePath();
    pen.fill();
    pen.stroke();
    const middle = screen(0.5, 0.5, 0);
    const y_side = screen(0.5, 0, 0)[2] > screen(0.5, 1, 0)[2] ? 0 : 1, x_side = screen(0, 0.5, 0)[2] > screen(1, 0.5, 0)[2] ? 0 : 1;
    const axis = (limits, at) => {
      const values = page.ticks(limits[0], limits[1], 4);
      const [u, v] = at(0.5), side = Math.sign(u - middle[0]);
      const slope = Math.abs(u - middle[0]) / (Math.hypot(u - middle[0], v - middle[1]) || 1);
      pen.fillStyle = ink;
      pen.textAlign = slope < 0.35 ? "center" : side > 0 ? "left" : "right";
      for (const value of values) {
        const share = (value - limits[0]) / (limits[1] - limits[0]), [p, q] = at(share);
        pen.fillText(values.text(value), p + 6 * side * slope, q + 14);
      }
      pen.textAlign = "center";
      return u;
    };
    const x_at = axis(s.x, share => screen(share, y_side, 0)), y_at = axis(s.y, share => screen(x_side, share, 0));
    // Names at the foot, each on the side of its axis: there nothing is in their way.
    const foot = pen.canvas.clientHeight - 8, names = x_at < y_at ? s.labels : [s.labels[1], s.labels[0]];
    pen.textAlign = "left";
    pen.fillText(`↖ ${names[0]}`, 6, foot);
    pen.textAlign = "right";
    pen.fillText(`${names[1]} ↗`, pen.canvas.clientWidth - 6, foot);
    pen.textAlign = "center";
    upright(pen, s, screen, ink, line);
  }

  // The upright axis at the corner furthest to the left.
  function upright(pen, s, screen, ink, line) {
    const corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
    const [x, y] = corners.reduce((a, b) => screen(...b, 0)[0] < screen(...a, 0)[0] ? b : a);
    const foot = screen(x, y, 0), head = screen(x, y, 1), values = page.ticks(s.low, s.high, 4);
    pen.strokeStyle = line;
    pen.beginPath();
    pen.moveTo(foot[0], foot[1]);
    pen.lineTo(head[0], head[1]);
    pen.stroke();
    pen.fillStyle = ink;
    pen.textAlign = "right";
    for (const value of values) {
      const [u, v] = screen(x, y, (value - s.low) / (s.high - s.low));
      pen.fillText(values.text(value), u - 6, v + 4);
    }
    pen.textAlign = "left";
    pen.fillText(s.labels[2], 6, 14);
    pen.textAlign = "center";
  }

  // Contours of the surface, dropped to the floor.
  function floor(pen, s, screen) {
    const n = s.z.length;
    const lines = page.ticks(s.low, s.high, 9).map(level => [level, viridis.css((level - s.low) / (s.high - s.low)), 1.3]);
    for (const [level, paint, thick] of [...lines, ...s.bounds.map(bound => [bound, page.colour("vermilion"), 2.6])]) {
      pen.strokeStyle = paint;
      pen.lineWidth = thick;
      pen.beginPath();
      for (const segment of contours.segments(s.z, level))
        segment.forEach(([i, j], end) => {
          const [u, v] = screen(i / (n - 1), j / (n - 1), 0);
          if (end) pen.lineTo(u, v); else pen.moveTo(u, v);
        });
      pen.stroke();
    }
  }

  function skin(pen, s, corners, share) {
    const n = corners.length, tiles = [];
    for (let i = 0; i + 1 < n; i++)
      for (let j = 0; j + 1 < n; j++) {
        const tile = [corners[i][j], corners[i + 1][j], corners[i + 1][j + 1], corners[i][j + 1]];
        const mean = (s.z[i][j] + s.z[i + 1][j] + s.z[i + 1][j + 1] + s.z[i][j + 1]) / 4;
        if (Number.isFinite(mean)) tiles.push([tile.reduce((sum, p) => sum + p[2], 0), tile, viridis.css(share(mean))]);
      }
    tiles.sort((a, b) => a[0] - b[0]);
    pen.lineWidth = 0.6;
    for (const [, tile, paint] of tiles) {
      pen.beginPath();
      tile.forEach(([u, v], k) => k ? pen.lineTo(u, v) : pen.moveTo(u, v));
      pen.closePath();
      pen.fillStyle = paint;
      pen.fill();
      pen.strokeStyle = "rgba(255, 255, 255, .22)";
      pen.stroke();
    }
  }

  // Runs of this slice on stems to the surface; marks and the marker on it.
  function runs(pen, s, screen, share) {
    const x_share = x => (x - s.x[0]) / (s.x[1] - s.x[0]), y_share = y => (y - s.y[0]) / (s.y[1] - s.y[0]);
    const ink = page.colour("ink"), paper = page.colour("paper");
    for (const p of s.points) {
      const [u, v] = screen(x_share(p.x), y_share(p.y), share(p.z));
      if (p.here) {
        const [a, b] = screen(x_share(p.x), y_share(p.y), share(p.surface));
        pen.strokeStyle = ink;
        pen.lineWidth = 1.2;
        pen.beginPath();
        pen.moveTo(u, v);
        pen.lineTo(a, b);
        pen.stroke();
      }
      contours.symbol(pen, u, v, "dot", p.here ? ink : null, p.here ? paper : ink);
    }
    for (const p of s.marks) {
      const [u, v] = screen(x_share(p.x), y_share(p.y), share(p.surface));
      contours.symbol(pen, u, v, p.shape, p.here ? "#d55e00" : null, p.here ? "#fff" : "#d55e00");
    }
    const [u, v] = screen(x_share(s.marker[0]), y_share(s.marker[1]), share(s.height));
    contours.symbol(pen, u, v, "dot", "#fff", "#000");
  }

  // The grid point under the pointer that is nearest to the eye, as shares of the two axes.
  function nearest(corners) {
    const n = corners.length, REACH = 12;
    return (p, q) => {
      let best = null, near = -Infinity;
      corners.forEach((line, i) => line.forEach(([u, v, depth], j) => {
        if (Math.hypot(u - p, v - q) < REACH && depth > near) { near = depth; best = [i / (n - 1), j / (n - 1)]; }
      }));
      return best;
    };
  }

  return {draw};
})();
