"use strict";
// A fitted surface: value and 95 % confidence interval of the mean at coded factors.
const model = (() => {
  const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";
  const parsed = new Map();

  // "A^2B" as [[0, 2], [1, 1]]; "1" as [].
  function powers(term) {
    if (!parsed.has(term)) {
      const factors = [...term.matchAll(/([A-Z])(?:\^(\d+))?/g)];
      parsed.set(term, factors.map(([, letter, power]) => [LETTERS.indexOf(letter), Number(power || 1)]));
    }
    return parsed.get(term);
  }

  const row = (surface, coded) =>
    surface.terms.map(term => powers(term).reduce((product, [place, power]) => product * coded[place] ** power, 1));

  // Out of a Box-Cox transform; undefined beyond its range.
  function back(surface, value) {
    if (surface.power === null) return value;
    if (surface.power === 0) return Math.exp(value);
    const base = surface.power * value + 1;
    return base > 0 ? base ** (1 / surface.power) : NaN;
  }

  function linear(surface, coded) {
    return row(surface, coded).reduce((sum, each, place) => sum + each * surface.coefficients[place], 0);
  }

  const value = (surface, coded) => back(surface, linear(surface, coded));

  // Half-width, the mean of both sides where the transform makes them differ; null where it is unknown.
  function half_width(surface, coded) {
    if (!surface.covariance || !surface.student) return null;
    const x = row(surface, coded);
    let variance = 0;
    for (let i = 0; i < x.length; i++)
      for (let j = 0; j < x.length; j++) variance += x[i] * surface.covariance[i][j] * x[j];
    variance += surface.missed || 0;
    const half = surface.student * Math.sqrt(Math.max(variance, 0)), middle = linear(surface, coded);
    return Math.abs(back(surface, middle + half) - back(surface, middle - half)) / 2;
  }

  return {row, value, half_width};
})();
