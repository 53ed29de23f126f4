// A pane shows one mesh, or the points of scans, in a plot of k3d. K3DInstance, lib, data and _base64ToArrayBuffer belong to
// the snapshot that this script runs in.

const size = told.n_vertices;
const faces = new Uint32Array((await unpacked(told.faces)).buffer);

class Plot {
  constructor(node, plot, map) {
    Object.assign(this, { node, plot, map });
    const drawables = Object.values(plot.getWorld().ObjectsListJson);
    this.mesh = drawables.find((drawable) => drawable.type === 'Mesh');
    this.dots = drawables.find((drawable) => drawable.type === 'Points');
  }

  changed(drawable, changes) {
    return this.plot.reload(Object.assign(drawable, changes), changes, true);
  }
}

class Cloud extends Plot {
  constructor(node, plot, map, points, counts) {
    super(node, plot, map);
    this.points = points;
    this.starts = counts.reduce((starts, count) => [...starts, starts.at(-1) + count], [0]);
    this.mesh.indices = array(new Uint32Array(0), 3);
  }

  async draw(frame) {
    const some = this.points.subarray(3 * this.starts[frame], 3 * this.starts[frame + 1]);
    await Promise.all([
      this.changed(this.mesh, { indices: this.mesh.indices }),
      this.changed(this.dots, {
        positions: array(Float32Array.from(some, (place) => place / told.grid), 3),
        attribute: array(new Float32Array(some.length / 3)),
        color_map: array(Float32Array.from(this.map)),
        point_size: told.scan_dot,
      }),
    ]);
    await this.plot.render(true);
  }
}

class Pane extends Plot {
  constructor(node, plot, positions, seen, map) {
    super(node, plot, map); // without a map: that of the colours
    Object.assign(this, { positions, seen });
    this.whole = null; // the triangles without a missing vertex
    this.alone = [0, 1]; // the visible vertices in none of them; the snapshot has two dots
  }

  async draw(frame, colour) {
    const vertices = this.vertices(frame);
    const places = new Float32Array(size);
    if (!this.map && colour.places) {
      const first = frame * size;
      for (let i = 0; i < size; i++) places[i] = colour.places[first + i] / 255;
    }
    const map = array(Float32Array.from(this.map || colour.map));
    const hadDots = this.alone.length > 0;
    const mesh = { vertices: array(vertices, 3), attribute: array(places), color_map: map };
    if (this.seen || this.whole === null) {
      this.sort(this.seen && this.seen(frame));
      mesh.indices = array(this.whole, 3); // without it, k3d updates positions in place
    }
    const changed = [this.changed(this.mesh, mesh)];
    if (hadDots || this.alone.length) {
      const positions = this.alone.flatMap((i) => [...vertices.subarray(3 * i, 3 * i + 3)]);
      changed.push(this.changed(this.dots, {
        positions: array(Float32Array.from(positions), 3),
        attribute: array(Float32Array.from(this.alone, (i) => places[i])),
        color_map: map,
      }));
    }
    await Promise.all(changed);
    await this.plot.render(true);
  }

  vertices(frame) {
    const first = 3 * size * frame;
    const vertices = new Float32Array(3 * size);
    for (let axis = 0; axis < 3; axis++) {
      for (let i = 0; i < size; i++) {
        vertices[3 * i + axis] = this.positions[first + axis * size + i] / told.grid;
      }
    }
    return vertices;
  }

  sort(seen) {
    const whole = [];
    for (let i = 0; i < faces.length; i += 3) {
      const a = faces[i], b = faces[i + 1], c = faces[i + 2];
      if (!seen || (seen[a] && seen[b] && seen[c])) whole.push(a, b, c);
    }
    this.whole = Uint32Array.from(whole);
    const used = new Uint8Array(size);
    for (const corner of whole) used[corner] = 1;
    this.alone = [];
    for (let i = 0; i < size; i++) if (!used[i] && (!seen || seen[i])) this.alone.push(i);
  }
}

function array(values, width) {
  return { data: values, shape: width ? [values.length / width, width] : [values.length] };
}

function division(name) {
  return Object.assign(document.createElement('div'), { className: name });
}

async function panesOf(descriptions, parent) {
  const main = descriptions.find(({ map }) => !map); // the sequence itself
  const base = await unpackedPositions(main.positions, size);
  const panes = [];
  for (const description of descriptions) {
    const { caption, map, seen } = description;
    const pane = parent.appendChild(division('dynmesh-pane'));
    if (descriptions.length > 1) {
      pane.appendChild(division('dynmesh-caption')).append(caption);
    }
    const node = pane.appendChild(division('dynmesh-canvas'));
    let plot = K3DInstance;
    let positions = base;
    if (!map) {
      node.append(document.getElementById('canvasTarget'));
    } else {
      const target = node.appendChild(division(''));
      plot = await lib.CreateK3DAndLoadBinarySnapshot(_base64ToArrayBuffer(data), target);
      if (!description.points) {
        positions = await unpackedPositions(description.positions, size);
        for (let i = 0; i < positions.length; i++) positions[i] += base[i];
      }
    }
    if (description.points) {
      const points = new Int16Array((await unpacked(description.points)).buffer);
      panes.push(new Cloud(node, plot, map, points, description.counts));
      continue;
    }
    const masks = seen && await unpackedMasks(seen, size);
    panes.push(new Pane(node, plot, positions, masks, map));
  }
  return panes;
}
