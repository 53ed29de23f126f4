// Unpacks what document.py packed.

async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function unpackedBytes(text, size) {
  const values = await unpacked(text);
  for (let i = size; i < values.length; i++) values[i] += values[i - size];
  return values;
}

// Returns all x of a frame, then all y, then all z, frame by frame, in steps of the grid.
async function unpackedPositions(text, size) {
  const bytes = await unpacked(text);
  const count = bytes.length / 2;
  const positions = new Int16Array(count);
  for (let row = 0; row < count; row += size) {
    const before = row - 3 * size; // the same axis in the frame before
    let sum = 0;
    for (let i = 0; i < size; i++) {
      const folded = bytes[row + i] | (bytes[count + row + i] << 8);
      sum += (folded >>> 1) ^ -(folded & 1);
      positions[row + i] = sum + (before < 0 ? 0 : positions[before + i]);
    }
  }
  return positions;
}

async function unpackedMasks(text, size) {
  const rowLength = Math.ceil(size / 8);
  const bits = await unpacked(text);
  return (frame) => Uint8Array.from({ length: size }, (_, i) => (
    (bits[frame * rowLength + (i >> 3)] >> (i & 7)) & 1
  ));
}
