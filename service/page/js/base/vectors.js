// Vectors of two or three numbers.

export const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const unit = (a) => a.map((v) => v / (Math.hypot(...a) || 1));
export const times = (a, k) => a.map((value) => k * value);
export const plus = (a, b) => a.map((value, i) => value + b[i]);
export const minus = (a, b) => a.map((value, i) => value - b[i]);

// The turn about an axis of length 1 by an angle, as the rows of a matrix (Rodrigues).
export function turning(k, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const across = [[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]];
  return [0, 1, 2].map((i) => [0, 1, 2].map((j) => (i === j ? c : 0) + s * across[i][j] + (1 - c) * k[i] * k[j]));
}
