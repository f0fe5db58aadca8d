// Viridis, which everybody can read, in 16 stops between which colours are mixed.

const STOPS = [
  [68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142], [35, 136, 142],
  [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54], [210, 226, 27], [253, 231, 37],
];

export const SHADES = (() => {
  const table = new Uint8ClampedArray(256 * 4);
  for (let i = 0; i < 256; i += 1) {
    const place = (i / 255) * (STOPS.length - 1);
    const at = Math.min(Math.floor(place), STOPS.length - 2);
    for (let c = 0; c < 3; c += 1) table[4 * i + c] = STOPS[at][c] + (place - at) * (STOPS[at + 1][c] - STOPS[at][c]);
    table[4 * i + 3] = 255;
  }
  return table;
})();
