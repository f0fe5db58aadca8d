// Where the parts of a structure are drawn: chains from the ground outwards, disks as rings of sectors.

export const GROUND = "ground";
const MOST_SECTORS = 24;
const SHOWN_OF_MANY = 3;

export const ownName = (end) => end.split("@")[0];

// Distance of every DOF from the ground over the springs; what hangs on contacts alone is one farther than its
// neighbour, and what hangs on nothing comes last.
function layersOf(dofs, springs, contacts) {
  const layers = new Map([[GROUND, 0]]);
  spread(layers, springs);
  spread(layers, [...springs, ...contacts]);
  let last = Math.max(...layers.values());
  for (const dof of dofs) if (!layers.has(dof)) layers.set(dof, (last += 1));
  return layers;
}

function spread(layers, joints) {
  for (let more = true; more; ) {
    more = false;
    const found = new Map();
    for (const { between } of joints) {
      const [a, b] = between.map(ownName);
      for (const [from, to] of [[a, b], [b, a]]) {
        if (layers.has(from) && !layers.has(to)) found.set(to, Math.min(layers.get(from) + 1, found.get(to) ?? Infinity));
      }
    }
    for (const [name, layer] of found) {
      layers.set(name, layer);
      more = true;
    }
  }
}

// What a scene's structure consists of, whatever its kind.
export function partsOf({ body: { structure, observe }, joints: contacts }) {
  const masses = structure.masses ? Object.keys(structure.masses) : Object.keys(structure.dofs ?? {});
  const used = [...contacts.flatMap((c) => c.between), observe.dof].map(ownName);
  const dofs = masses.length ? masses : [...new Set(used)].filter((name) => name !== GROUND);
  return {
    dofs: dofs.map(ownName).filter((name, i, all) => all.indexOf(name) === i),
    springs: structure.springs ?? [],
    contacts,
    sectors: structure.kind === "cyclic" ? structure.sectors : 1,
    cyclic: structure.kind === "cyclic",
    matrices: structure.kind === "matrices",
  };
}

export function chain(parts, width, height) {
  const inOrder = new Map(parts.dofs.map((dof, i) => [dof, i + 1]));
  const layers = parts.matrices ? inOrder : layersOf(parts.dofs, parts.springs, parts.contacts);
  const above = parts.contacts.some((c) => !c.between.includes(GROUND)) ? 22 : 0;
  const columns = new Map();
  for (const dof of parts.dofs) {
    const layer = layers.get(dof);
    columns.set(layer, [...(columns.get(layer) ?? []), dof]);
  }
  const last = Math.max(...columns.keys(), 1);
  const places = new Map();
  for (const [layer, names] of columns) {
    names.forEach((name, i) => {
      const x = 54 + (layer / (last + 0.35)) * (width - 90);
      places.set(name, { x, y: (height * (i + 1)) / (names.length + 1) - 18 + above });
    });
  }
  const size = Math.min(24, (0.36 * (width - 90)) / (last + 1), (0.3 * height) / Math.max(...[...columns.values()].map((n) => n.length)));
  return { places, size: Math.max(size, 5), ground: { x: 22 } };
}

// The places of sector j's DOFs on their rings; of very many sectors only the first few, widely fanned.
export function ring(parts, radius) {
  const layers = layersOf(parts.dofs, parts.springs, parts.contacts);
  const last = Math.max(...layers.values(), 1);
  const all = parts.sectors <= MOST_SECTORS;
  const shown = all ? parts.sectors : SHOWN_OF_MANY;
  const step = all ? (2 * Math.PI) / Math.max(parts.sectors, 2) : Math.PI / 5;
  const start = all ? -Math.PI / 2 : -Math.PI / 2 - step;
  const inner = 0.3;
  const place = (dof, j) => {
    const share = inner + ((1 - inner) * (layers.get(dof) - 1)) / Math.max(last - 1, 1);
    const angle = start + j * step;
    return { x: radius * share * Math.cos(angle), y: radius * share * Math.sin(angle), angle };
  };
  const hub = (j) => {
    const angle = start + j * step;
    return { x: radius * 0.12 * Math.cos(angle), y: radius * 0.12 * Math.sin(angle), angle };
  };
  const size = Math.min(15, (0.3 * radius * (1 - inner)) / last, 0.32 * radius * inner * step + 4);
  return { place, hub, shown, closed: all, size: Math.max(size, 3.5) };
}
